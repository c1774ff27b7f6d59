//! From a question to candidates.

use nalgebra::{Similarity3, Translation3};
use rayon::prelude::*;

use crate::candidate::Candidate;
use crate::describe::Described;
use crate::entry::Entry;
use crate::matching::{Fit, fit};
use crate::portrait::{Likeness, Portrait};
use crate::question::Question;

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

pub(crate) fn search(
    held: &[(Entry, Portrait)],
    question: &Question,
    options: &SearchOptions,
) -> Vec<Candidate> {
    let of_entry = |(entry, portrait): &(Entry, Portrait)| {
        let mut best: Option<Candidate> = None;
        for (number, asked) in question.pieces.iter().enumerate() {
            for likeness in &portrait.pieces {
                let Some(fit) = fit(asked, likeness) else { continue };
                if best.as_ref().is_none_or(|best| fit.score > best.score) {
                    best = Some(candidate(entry, number, asked, likeness, &fit));
                }
            }
        }
        best
    };
    let mut found: Vec<Candidate> = held.par_iter().filter_map(of_entry).collect();
    found.sort_by(|a, b| b.score.total_cmp(&a.score).then_with(|| a.entry.cmp(&b.entry)));
    found.truncate(options.top);
    found
}

fn candidate(entry: &Entry, number: usize, asked: &Described, likeness: &Likeness, fit: &Fit) -> Candidate {
    Candidate {
        entry: entry.clone(),
        score: fit.score,
        part: number.checked_sub(1),
        pose: in_model_units(asked, likeness, fit),
        mirrored: fit.mirrored,
    }
}

/// q' = (q - c_q) / s_q and p' = M (p - c_p) / s_p with q' = σ R p' + t, so q = σ (s_q / s_p) R M (p - c_p) + s_q t + c_q.
fn in_model_units(asked: &Described, likeness: &Likeness, fit: &Fit) -> Similarity3<f64> {
    let rotation = fit.pose.isometry.rotation;
    let scale = fit.pose.scaling() * asked.size / likeness.size;
    let mut centre = likeness.centroid.coords;
    if fit.mirrored {
        centre.x = -centre.x;
    }
    let shift =
        asked.centroid.coords + fit.pose.isometry.translation.vector * asked.size - rotation * centre * scale;
    Similarity3::from_parts(Translation3::from(shift), rotation, scale)
}
