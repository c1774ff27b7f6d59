//! How far one model comes in a search, round by round.

use crate::entry::hash;
use crate::error::CatalogueError;
use crate::question::{Asked, Question};
use crate::search::{compared, settled, voted};
use crate::segment::Segment;

/// Places of a model after each round of a search, from 0, each the best among the pieces of the suspect; `None` where it did not
/// get so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Fate {
    /// Among all pieces of the catalogue, by votes.
    pub votes: Option<usize>,
    /// Among those that were compared, by pairs of landmarks.
    pub pairs: Option<usize>,
    /// Among those that were laid on the surface, by distances.
    pub surfaces: Option<usize>,
}

pub(crate) fn fate(segments: &[Segment], question: &Question, name: &str) -> Result<Fate, CatalogueError> {
    let voted = voted(segments, question, usize::MAX)?;
    let of_piece = |(number, asked): (usize, &Asked)| -> Result<Fate, CatalogueError> {
        let voted = &voted[number];
        let votes = voted.iter().position(|(piece, _)| piece.hash == hash(name));
        let compared = compared(segments, asked, voted)?;
        let pairs = compared.iter().position(|compared| compared.entry.name == name);
        let settled = settled(number, asked, compared);
        let surfaces = settled.iter().position(|candidate| candidate.entry.name == name);
        Ok(Fate { votes, pairs, surfaces })
    };
    let fates = question.pieces.iter().enumerate().map(of_piece).collect::<Result<Vec<Fate>, _>>()?;
    let best = |of: fn(&Fate) -> Option<usize>| fates.iter().filter_map(of).min();
    Ok(Fate { votes: best(|f| f.votes), pairs: best(|f| f.pairs), surfaces: best(|f| f.surfaces) })
}
