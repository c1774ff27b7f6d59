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

use crate::refinement::affine_map::AffineMap;
use crate::refinement::pairs::{self, Pair};
use crate::surface::sample::{Sample, samples};
use crate::surface::shape::Shape;
use sombrero_spatial::robust::median;

/// Distance from which two surfaces have nothing to do with each other, τ.
pub(crate) const REACH: f64 = 0.02;
/// Distance up to which they agree.
pub(crate) const CLOSE: f64 = REACH / 4.0;
/// A counterpart on the boundary must be this many median distances close: beyond the rim is nothing.
const BOUNDARY_MEDIANS: f64 = 4.0;
/// Samples of a side in a quick look.
const COARSE: usize = 1_000;

/// The fit measure: two surfaces and the samples by which they are compared.
pub(crate) struct FitMeasure<'a> {
    reference: &'a Shape,
    suspect: &'a Shape,
    reference_samples: Vec<Sample>,
    suspect_samples: Vec<Sample>,
}

/// How well a pose fits; lengths in units of the reference's diagonal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    /// How little the surfaces have in common, from 0, the same surface, to 1, nothing.
    pub(crate) score: f64,
    /// Root mean square distance of the suspect's matched samples; of all when none is matched.
    pub(crate) rms: f64,
    /// Share of the reference's area that has a counterpart.
    pub(crate) overlap: f64,
    /// Share of the suspect's area that has a counterpart.
    pub(crate) suspect_overlap: f64,
    /// Shares of the areas of reference and suspect that lie within [`CLOSE`] of the other.
    pub(crate) close: [f64; 2],
    /// Samples of each side.
    pub(crate) samples: usize,
}

impl Fit {
    /// Share of the two surfaces that lie close to each other, 0 to 1.
    pub(crate) fn agreement(&self) -> f64 {
        (self.close[0] + self.close[1]) / 2.0
    }

    /// Standard error of the score when what has no counterpart is counted by samples: √(p (1 - p) / n) on each side.
    pub(crate) fn error(&self) -> f64 {
        let variance = |share: f64| share * (1.0 - share) / self.samples.max(1) as f64;
        (variance(self.overlap) + variance(self.suspect_overlap)).max(0.0).sqrt() / 2.0
    }

    /// Share of what has a counterpart that is close to it, 0 to 1.
    pub(crate) fn sharpness(&self) -> f64 {
        let matched = self.overlap + self.suspect_overlap;
        if matched > 0.0 { (self.close[0] + self.close[1]) / matched } else { 0.0 }
    }
}

impl<'a> FitMeasure<'a> {
    /// The measure for choosing between starts.
    pub(crate) fn coarse(reference: &'a Shape, suspect: &'a Shape) -> Self {
        Self::new(reference, suspect, COARSE)
    }

    /// The measure for the final figures, by half of `samples` on each side.
    pub(crate) fn fine(reference: &'a Shape, suspect: &'a Shape, samples: usize) -> Self {
        Self::new(reference, suspect, samples.div_ceil(2))
    }

    fn new(reference: &'a Shape, suspect: &'a Shape, count: usize) -> Self {
        let reference_samples = samples(reference, count);
        Self { reference, suspect, reference_samples, suspect_samples: samples(suspect, count) }
    }

    /// The fit of the pose `map`, in the unit frames.
    pub(crate) fn of(&self, map: &AffineMap) -> Fit {
        let there = pairs::find(self.reference, &self.suspect_samples, map, &mut Vec::new());
        let back = self.back(map);
        let score = (mean(&there, loss) + mean(&back, loss)) / 2.0;
        let rim = BOUNDARY_MEDIANS * median(there.iter().map(|p| p.distance).collect());
        let is_matched =
            |p: &Pair| p.compatible && p.distance < REACH && (!p.on_boundary || p.distance <= rim);
        let matched: Vec<Pair> = there.iter().copied().filter(is_matched).collect();
        let counted = if matched.is_empty() { &there } else { &matched };
        Fit {
            score,
            rms: mean(counted, |p| p.distance * p.distance).sqrt(),
            overlap: mean(&back, |p| f64::from(is_matched(p))),
            suspect_overlap: matched.len() as f64 / there.len().max(1) as f64,
            samples: self.reference_samples.len(),
            close: [&back, &there]
                .map(|pairs| mean(pairs, |p| f64::from(is_matched(p) && p.distance < CLOSE))),
        }
    }

    /// Pairs from the reference to the suspect, found where the suspect lies, measured where the reference lies.
    fn back(&self, map: &AffineMap) -> Vec<Pair> {
        let Some(inverse) = map.inverse() else { return Vec::new() };
        let mut pairs = pairs::find(self.suspect, &self.reference_samples, &inverse, &mut Vec::new());
        pairs.iter_mut().for_each(|pair| pair.distance = (map.linear * (pair.p - pair.q)).norm());
        pairs
    }
}

fn loss(pair: &Pair) -> f64 {
    if pair.compatible { (pair.distance / REACH).min(1.0).powi(2) } else { 1.0 }
}

/// The mean over pairs; 1 of nothing, which has nothing in common with anything.
fn mean(pairs: &[Pair], value: impl Fn(&Pair) -> f64) -> f64 {
    if pairs.is_empty() { 1.0 } else { pairs.iter().map(value).sum::<f64>() / pairs.len() as f64 }
}
