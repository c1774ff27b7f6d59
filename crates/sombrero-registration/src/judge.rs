//! How well a pose makes two surfaces one, seen from both.
//!
//! ```text
//! score = 1/2 mean over suspect's samples of ρ(d) + 1/2 mean over reference's samples of ρ(d),
//! ρ(d) = min(d / τ, 1)²,  and 1 where the normals disagree,
//! ```
//!
//! with d the distance to the other surface in units of the reference's diagonal. One side alone would be
//! fooled: a suspect shrunk into a corner of the reference lies on it everywhere. Truncation lets a crop
//! or an added part cost a constant instead of ruling the sum. No watermark is seen here, and none may be
//! (design law 1).

use nalgebra::Similarity3;

use crate::icp::IcpOptions;
use crate::pairs::{self, Pair};
use crate::sample::{Sample, samples};
use crate::shape::Shape;

/// Distance from which two surfaces have nothing to do with each other, τ.
pub(crate) const REACH: f64 = 0.02;
/// A counterpart on the boundary must be this many median distances close: beyond the rim is nothing.
const BOUNDARY_MEDIANS: f64 = 4.0;
/// Samples of a side in a quick look.
const COARSE: usize = 1_000;

/// Two surfaces and the samples by which they are compared.
pub(crate) struct Judge<'a> {
    reference: &'a Shape,
    suspect: &'a Shape,
    reference_samples: Vec<Sample>,
    suspect_samples: Vec<Sample>,
}

/// A pose's verdict; lengths in units of the reference's diagonal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    /// From 0, the same surface, to 1, nothing in common.
    pub(crate) score: f64,
    /// Root mean square distance of the suspect's matched samples; of all when none is matched.
    pub(crate) rms: f64,
    /// Share of the reference's area that has a counterpart.
    pub(crate) overlap: f64,
    /// Share of the suspect's area that has a counterpart.
    pub(crate) suspect_overlap: f64,
}

impl<'a> Judge<'a> {
    /// For choosing between starts.
    pub(crate) fn coarse(reference: &'a Shape, suspect: &'a Shape) -> Self {
        Self::new(reference, suspect, COARSE)
    }

    /// For the final figures.
    pub(crate) fn fine(reference: &'a Shape, suspect: &'a Shape, options: &IcpOptions) -> Self {
        Self::new(reference, suspect, options.samples.div_ceil(2))
    }

    fn new(reference: &'a Shape, suspect: &'a Shape, count: usize) -> Self {
        let reference_samples = samples(reference, count);
        Self { reference, suspect, reference_samples, suspect_samples: samples(suspect, count) }
    }

    pub(crate) fn fit(&self, pose: &Similarity3<f64>) -> Fit {
        let there = pairs::find(self.reference, &self.suspect_samples, pose, &mut Vec::new());
        let back = pairs::find(self.suspect, &self.reference_samples, &pose.inverse(), &mut Vec::new());
        // Distances in the suspect's frame, back in the reference's.
        let s = pose.scaling();
        let score = (mean(&there, |p| loss(p, 1.0)) + mean(&back, |p| loss(p, s))) / 2.0;
        let rim = BOUNDARY_MEDIANS * pairs::median(there.iter().map(|p| p.distance).collect());
        let is_matched = |p: &Pair, s: f64| {
            p.compatible && p.distance * s < REACH && (!p.on_boundary || p.distance * s <= rim)
        };
        let matched: Vec<Pair> = there.iter().copied().filter(|p| is_matched(p, 1.0)).collect();
        let counted = if matched.is_empty() { &there } else { &matched };
        Fit {
            score,
            rms: mean(counted, |p| p.distance * p.distance).sqrt(),
            overlap: mean(&back, |p| f64::from(is_matched(p, s))),
            suspect_overlap: matched.len() as f64 / there.len().max(1) as f64,
        }
    }
}

fn loss(pair: &Pair, scale: f64) -> f64 {
    if pair.compatible { (pair.distance * scale / REACH).min(1.0).powi(2) } else { 1.0 }
}

/// The mean over pairs; 1 of nothing, which has nothing in common with anything.
fn mean(pairs: &[Pair], value: impl Fn(&Pair) -> f64) -> f64 {
    if pairs.is_empty() { 1.0 } else { pairs.iter().map(value).sum::<f64>() / pairs.len() as f64 }
}
