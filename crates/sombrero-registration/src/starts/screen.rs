//! A look at starts by table: which of them are worth a trial on the surfaces themselves.
//!
//! A trial takes thousands of closest points, and of a suspect that shows something else all of them are far. So each start is
//! first brought to rest on the table of nearest samples, and asked how sharp it is there: of the samples that are within
//! [`REACH`] of the tangent plane at their nearest sample, the share that is within [`CLOSE`]. That is the sharpness by
//! which poses are trusted, from one side and without closest points. Right poses of 50 suspects (cut, simplified, noisy,
//! printed) had 0.88 to 1, those of suspects that were bent by a tenth of their size 0.56 to 0.67; of 20 pairs of unrelated
//! shapes the sharpest of 16 had 0.4 to 0.8, mostly about 0.5. So where one is sharp, those that are not are left out, and where
//! none is, few are tried.

use rayon::prelude::*;

use crate::refinement::motion::Motion;
use crate::starts::rough;
use crate::surface::lookup::Lookup;
use crate::surface::sample::{Sample, scattered};
use crate::surface::shape::Shape;
use crate::verdict::fit::{CLOSE, REACH};

/// Samples that look.
const SAMPLES: usize = 768;
/// Sharpness of a start that may well be right.
const SHARP: f64 = 0.75;
/// Part of the best one's sharpness that others must have beside a sharp one.
const BESIDE: f64 = 0.75;
/// Starts that are tried where none is sharp.
pub(crate) const FEW: usize = 3;

/// The table of the reference, and the suspect's samples with their normals turned as the reference's may be.
pub(crate) struct Screen<'a> {
    lookup: &'a Lookup,
    samples: Vec<Vec<Sample>>,
}

impl<'a> Screen<'a> {
    /// `orientations` are the factors, 1 or -1, that may turn the suspect's normals to those of the reference.
    pub(crate) fn new(lookup: &'a Lookup, suspect: &Shape, orientations: &[f64]) -> Self {
        let samples = orientations.iter().map(|o| scattered(suspect, SAMPLES, *o)).collect();
        Self { lookup, samples }
    }

    /// The starts that are worth a trial, in their order; `few` where none is sharp.
    pub(crate) fn passed<M: Motion>(&self, starts: Vec<M>, few: usize) -> Vec<M> {
        let sharpness: Vec<f64> = starts.par_iter().map(|start| self.sharpness(start)).collect();
        let mut ranked = sharpness.clone();
        ranked.sort_by(|a, b| b.total_cmp(a));
        let limit = match ranked.first() {
            Some(&best) if best >= SHARP => BESIDE * best,
            _ => ranked.get(few.max(1) - 1).copied().unwrap_or(0.0),
        };
        starts
            .into_iter()
            .zip(sharpness)
            .filter(|(_, sharpness)| *sharpness >= limit)
            .map(|(s, _)| s)
            .collect()
    }

    fn sharpness<M: Motion>(&self, start: &M) -> f64 {
        let look = |samples: &Vec<Sample>| {
            let pose = rough::settled(self.lookup, samples, &rough::icp(self.lookup, samples, start));
            self.sharpness_of(samples, &pose)
        };
        self.samples.iter().map(look).fold(0.0, f64::max)
    }

    fn sharpness_of<M: Motion>(&self, samples: &[Sample], pose: &M) -> f64 {
        let map = pose.map();
        let (mut near, mut close) = (0usize, 0usize);
        for sample in samples {
            let Some(height) = rough::height(self.lookup, sample, &map) else { continue };
            near += usize::from(height < REACH);
            close += usize::from(height < CLOSE);
        }
        close as f64 / near.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Side;
    use nalgebra::{Similarity3, Vector3};
    use sombrero_shapes as shapes;

    #[test]
    fn the_right_start_passes_and_another_does_not() {
        let soup = shapes::part(3);
        let shape = Shape::new(Side::Reference, &soup.points, &soup.triangles).unwrap();
        let lookup = Lookup::new(&shape);
        let screen = Screen::new(&lookup, &shape, &[1.0]);
        let right = Similarity3::new(Vector3::new(0.02, 0.0, -0.01), Vector3::new(0.0, 0.1, 0.0), 1.0);
        let wrong = Similarity3::new(Vector3::zeros(), Vector3::new(1.0, 1.3, 0.4), 0.8);
        assert!(screen.sharpness(&right) > 0.9 && screen.sharpness(&wrong) < SHARP);
        assert_eq!(screen.passed(vec![wrong, right], FEW), [right]);
        // Where none is sharp, the sharpest few.
        let turned = |angle: f64| Similarity3::new(Vector3::zeros(), Vector3::new(1.0, angle, 0.4), 0.8);
        let others: Vec<_> = (0..6).map(|k| turned(1.0 + 0.1 * f64::from(k))).collect();
        assert!(others.iter().all(|other| screen.sharpness(other) < SHARP));
        assert_eq!(screen.passed(others, FEW).len(), FEW);
    }
}
