//! An answer to a question.

use nalgebra::Similarity3;

use crate::entry::Entry;

/// A model that the suspect may have been made from.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Candidate {
    /// Which model.
    pub entry: Entry,
    /// How well it fits: larger is better, from 0 to 1. Only the order within one answer means anything.
    pub score: f64,
    /// The connected part of the suspect that fits, by [`Question::part`](crate::Question::part); `None` for the whole.
    pub part: Option<usize>,
    /// Roughly where the model is in the suspect: from the model's points to the suspect's, in their own units. With
    /// `mirrored`, the model's x is to be negated first.
    pub pose: Similarity3<f64>,
    /// Whether the suspect fits the model's mirror image better.
    pub mirrored: bool,
}
