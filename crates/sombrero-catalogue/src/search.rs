//! From a question to candidates, in three rounds: votes, pairs, surfaces.

use std::collections::HashSet;

use nalgebra::{Similarity3, Translation3};
use rayon::prelude::*;

use crate::candidate::Candidate;
use crate::describe::Described;
use crate::entry::Entry;
use crate::error::CatalogueError;
use crate::matching::{Fit, fits, flipped};
use crate::portrait::Likeness;
use crate::question::{Asked, Question};
use crate::segment::Segment;
use crate::settle::{Settled, settle};
use crate::vote::{Ballots, Voted};

/// Pieces whose landmarks are compared one by one: for the whole suspect, and the least for a part of it.
const COMPARED: (usize, usize) = (750, 100);
/// Fits that are laid on the suspect's surface, likewise.
const SETTLED: (usize, usize) = (150, 24);
/// The least and largest distance at which a landmark still lies on the suspect, and that distance as a multiple of the best
/// candidate's lower quartile.
const REACH: (f64, f64) = (0.004, 0.03);
const QUARTILES: f64 = 4.0;
/// What a mirror image is worth: where both fit, the model as it is comes first.
const MIRRORED: f64 = 0.95;
/// The best candidate of a part comes before the others of another when its score is at least this multiple of the best one's.
const STRONG: f64 = 0.6;

/// How to search.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct SearchOptions {
    /// Candidates that are wanted at most.
    pub top: usize,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self { top: 10 }
    }
}

impl SearchOptions {
    /// With other numbers of candidates.
    #[must_use]
    pub fn top(self, top: usize) -> Self {
        Self { top }
    }
}

/// A piece that was read, and one way in which it fits.
#[derive(Clone)]
pub(crate) struct Compared {
    hash: u64,
    number: u16,
    pub(crate) entry: Entry,
    likeness: Likeness,
    fit: Fit,
}

pub(crate) fn search(
    segments: &[Segment],
    question: &Question,
    options: &SearchOptions,
) -> Result<Vec<Candidate>, CatalogueError> {
    let voted = voted(segments, question, COMPARED.0)?;
    let ask = |(number, asked): (usize, &Asked)| -> Result<Vec<Candidate>, CatalogueError> {
        let compared = compared(segments, asked, &voted[number])?;
        Ok(settled(number, asked, compared))
    };
    let lists = question.pieces.par_iter().enumerate().map(ask);
    Ok(in_order(lists.collect::<Result<_, _>>()?, options.top))
}

/// Of a number for the whole suspect and the least for a part what is due to a part.
fn due((whole, least): (usize, usize), asked: &Asked) -> usize {
    least.max((whole as f64 * asked.share) as usize)
}

/// For each piece of the suspect the pieces of all segments with most votes, best first, with the segment of each.
pub(crate) fn voted(
    segments: &[Segment],
    question: &Question,
    most: usize,
) -> Result<Vec<Vec<(Voted, usize)>>, CatalogueError> {
    let described: Vec<&Described> = question.pieces.iter().map(|asked| &asked.described).collect();
    let ballots = Ballots::new(described);
    let count = |segment: &Segment| {
        let found = ballots.count(&segment.lists, |entry| segment.alive(entry), most);
        found.map_err(CatalogueError::io(&segment.path))
    };
    let found: Vec<Vec<Vec<Voted>>> = segments.par_iter().map(count).collect::<Result<_, _>>()?;
    let of_piece = |piece: usize| {
        let of_all = found.iter().enumerate();
        let of_all = of_all.flat_map(|(index, lists)| lists[piece].iter().map(move |voted| (*voted, index)));
        let mut voted: Vec<(Voted, usize)> = of_all.collect();
        voted.sort_unstable();
        voted.truncate(most);
        voted
    };
    Ok((0..question.pieces.len()).map(of_piece).collect())
}

/// The ways in which those fit whose landmarks lie as the suspect's, best first.
pub(crate) fn compared(
    segments: &[Segment],
    asked: &Asked,
    voted: &[(Voted, usize)],
) -> Result<Vec<Compared>, CatalogueError> {
    let compare = |(voted, index): &(Voted, usize)| {
        let segment = &segments[*index];
        let of = segment.lists.head.pieces[voted.piece as usize];
        let (entry, mut portrait) = segment.read(of.entry)?;
        if usize::from(of.number) >= portrait.pieces.len() {
            return Ok(Vec::new());
        }
        let likeness = portrait.pieces.swap_remove(usize::from(of.number));
        let with = |fit: Fit| Compared {
            hash: voted.hash,
            number: voted.number,
            entry: entry.clone(),
            likeness: likeness.clone(),
            fit,
        };
        Ok(fits(&asked.described, &likeness, voted.rung).into_iter().map(with).collect())
    };
    let voted = voted.par_iter().take(due(COMPARED, asked));
    let found: Vec<Vec<Compared>> = voted.map(compare).collect::<Result<_, CatalogueError>>()?;
    let mut found: Vec<Compared> = found.into_iter().flatten().collect();
    let key = |c: &Compared| (c.hash, c.number, c.fit.mirrored);
    found.sort_by(|a, b| b.fit.score.total_cmp(&a.fit.score).then_with(|| key(a).cmp(&key(b))));
    Ok(found)
}

/// The first of them laid on the suspect's surface: what piece `number` of the suspect brings, best first.
pub(crate) fn settled(number: usize, asked: &Asked, mut compared: Vec<Compared>) -> Vec<Candidate> {
    compared.truncate(due(SETTLED, asked));
    let settled = |c: Compared| {
        let settled = settle(&asked.surface, &asked.normals, &c.likeness, &c.fit);
        (c, settled)
    };
    let found: Vec<(Compared, Settled)> = compared.into_par_iter().map(settled).collect();
    let best = found.iter().map(|(_, settled)| settled.quartile()).fold(f64::INFINITY, f64::min);
    let reach = (QUARTILES * best).clamp(REACH.0, REACH.1);
    // What covers a crumb of a crop tells little of the whole, and must not fill the list; a small object of a scene is told of
    // all the same.
    let covering = asked.share.sqrt().sqrt();
    let candidate = |(compared, settled): (Compared, Settled)| {
        let worth = if compared.fit.mirrored { MIRRORED } else { 1.0 } * covering;
        Candidate {
            score: settled.score(reach) * worth,
            part: number.checked_sub(1),
            pose: in_model_units(&asked.described, &compared.likeness, &settled.pose, compared.fit.mirrored),
            mirrored: compared.fit.mirrored,
            entry: compared.entry,
        }
    };
    let mut found: Vec<Candidate> = found.into_iter().map(candidate).collect();
    found.sort_by(better);
    found
}

fn better(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    b.score.total_cmp(&a.score).then_with(|| a.entry.cmp(&b.entry)).then(a.part.cmp(&b.part))
}

/// One list of all, each entry once: first the best of each part, as far as it is strong, then by score.
fn in_order(lists: Vec<Vec<Candidate>>, top: usize) -> Vec<Candidate> {
    let heads: Vec<Candidate> = lists.iter().filter_map(|list| list.first()).cloned().collect();
    let strong = STRONG * heads.iter().map(|c| c.score).fold(0.0, f64::max);
    let mut all: Vec<(bool, Candidate)> = heads.into_iter().map(|c| (c.score < strong, c)).collect();
    all.extend(lists.into_iter().flatten().map(|c| (true, c)));
    all.sort_by(|a, b| a.0.cmp(&b.0).then_with(|| better(&a.1, &b.1)));
    let mut known = HashSet::new();
    all.retain(|(_, c)| known.insert(c.entry.name.clone()));
    all.truncate(top);
    all.into_iter().map(|(_, c)| c).collect()
}

/// q' = (q - c_q) / s_q and p' = M (p - c_p) / s_p with q' = σ R p' + t, so q = σ (s_q / s_p) R M (p - c_p) + s_q t + c_q.
fn in_model_units(
    asked: &Described,
    likeness: &Likeness,
    pose: &Similarity3<f64>,
    mirrored: bool,
) -> Similarity3<f64> {
    let rotation = pose.isometry.rotation;
    let scale = pose.scaling() * asked.size / likeness.size;
    let centre = flipped(likeness.centroid.coords, mirrored);
    let shift =
        asked.centroid.coords + pose.isometry.translation.vector * asked.size - rotation * centre * scale;
    Similarity3::from_parts(Translation3::from(shift), rotation, scale)
}
