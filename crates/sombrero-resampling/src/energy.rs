//! The sum E = E_dist + c_d E_deform + c_f E_flip and its gradient (section 5).
//!
//! Two passes, both in parallel: faces leave the gradients of E_dist and E_flip at their corners, then
//! vertices add up their corners and springs. Each number is summed by one thread in the order of the
//! mesh, and energies are added chunk by chunk, so nothing depends on the number of threads.
//! Cost: O(n + samples).

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::deform::{self, spring};
use crate::distance::Attachment;
use crate::flip::turned;
use crate::frame::{Frame, Lists};

/// Faces or vertices that one task takes. Part of the result: it fixes the order of sums.
const CHUNK: usize = 1024;

/// The energy of one round: samples are attached to faces.
pub(crate) struct Energy<'a> {
    pub(crate) frame: &'a Frame,
    /// `attachments[f]`: the samples held by face f.
    pub(crate) attachments: Lists<Attachment>,
    /// μ of E_dist.
    pub(crate) resistance: f64,
    /// c_d.
    pub(crate) deform_weight: f64,
    /// c_f.
    pub(crate) flip_weight: f64,
}

/// A value of the energy, by terms and with their weights.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct EnergyTerms {
    /// The distance of the samples, E_dist, in squares of the original's largest side.
    pub distance: f64,
    /// The stretch of the springs, c_d E_deform, in squares of the original's largest side.
    pub deform: f64,
    /// The penalty on turned faces, c_f E_flip.
    pub flip: f64,
}

impl EnergyTerms {
    /// The whole energy E, the sum of its terms.
    pub fn total(&self) -> f64 {
        self.distance + self.deform + self.flip
    }
}

impl Energy<'_> {
    /// The energy at `points` and its gradient, one entry a vertex.
    pub(crate) fn evaluate(&self, points: &[Vector3<f64>], gradient: &mut [Vector3<f64>]) -> EnergyTerms {
        let mut at_corners = vec![[Vector3::zeros(); 3]; self.frame.faces.len()];
        let faces: Vec<(f64, f64)> = at_corners
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(chunk, gradients)| self.faces(chunk * CHUNK, points, gradients))
            .collect();
        let corners = at_corners.as_flattened();
        let springs: Vec<f64> = gradient
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(chunk, gradients)| self.vertices(chunk * CHUNK, points, corners, gradients))
            .collect();
        EnergyTerms {
            distance: faces.iter().map(|f| f.0).sum(),
            deform: springs.iter().sum(),
            flip: faces.iter().map(|f| f.1).sum(),
        }
    }

    /// E_dist and c_f E_flip of the faces from `first` on.
    fn faces(
        &self,
        first: usize,
        points: &[Vector3<f64>],
        gradients: &mut [[Vector3<f64>; 3]],
    ) -> (f64, f64) {
        let (mut distance, mut flip) = (0.0, 0.0);
        for (f, gradient) in (first..).zip(gradients) {
            let corners = self.frame.faces[f].map(|v| points[v as usize]);
            for attachment in self.attachments.of(f) {
                distance += attachment.energy(&corners, self.resistance, gradient);
            }
            flip += turned(&corners, &self.frame.normals[f], self.flip_weight, gradient);
        }
        (distance, flip)
    }

    /// c_d E_deform of the vertices from `first` on, half of each spring, and their whole gradient.
    fn vertices(
        &self,
        first: usize,
        points: &[Vector3<f64>],
        corners: &[Vector3<f64>],
        gradients: &mut [Vector3<f64>],
    ) -> f64 {
        let mut energy = 0.0;
        for (v, gradient) in (first..).zip(gradients) {
            *gradient = self.frame.corners.of(v).iter().map(|&c| corners[c as usize]).sum();
            for &(other, rest) in self.frame.springs.of(v) {
                let (e, g) = spring(&points[v], &points[other as usize], rest);
                energy += 0.5 * self.deform_weight * e;
                *gradient += g * self.deform_weight;
            }
        }
        energy
    }

    /// The second derivative by each vertex, about, E_flip left out; above 0.
    pub(crate) fn curvatures(&self) -> Vec<f64> {
        let of_corner = |&corner: &u32| {
            let (f, i) = (corner as usize / 3, corner as usize % 3);
            self.attachments.of(f).iter().map(|a| a.curvature(i, self.resistance)).sum::<f64>()
        };
        let of_vertex = |v: usize| {
            let springs = self.frame.springs.of(v).len() as f64 * self.deform_weight * deform::CURVATURE;
            let samples: f64 = self.frame.corners.of(v).iter().map(of_corner).sum();
            // A vertex without a face never moves.
            if springs > 0.0 { springs + samples } else { 1.0 }
        };
        (0..self.frame.points.len()).into_par_iter().with_min_len(CHUNK).map(of_vertex).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::projection::Projection;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;

    fn energy(frame: &Frame, flip_weight: f64) -> Energy<'_> {
        let suspect = shapes::bumpy_sphere(500);
        let points = suspect.points.iter().map(|p| frame.relative(p).into()).collect();
        let suspect = sombrero_mesh::Soup::new(points, suspect.triangles);
        let mut projection = Projection::new(frame, &suspect, 600, &mut ChaCha8Rng::seed_from_u64(1));
        let attachments = projection.attach(frame, &frame.points, 1.0).attachments;
        Energy { frame, attachments, resistance: 0.3, deform_weight: 0.7, flip_weight }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn the_total_gradient_is_that_of_finite_differences(seed in 0..1000u32, size in 0.01..0.3f64) {
            let frame = Frame::new(&shapes::sphere(2)).unwrap();
            let energy = energy(&frame, 1e-2);
            let wave = |i: usize, axis: usize| size * f64::sin(f64::from(seed) + (i * (7 + axis)) as f64);
            let shaken = |(i, p): (usize, &Vector3<f64>)| p + Vector3::from_fn(|axis, _| wave(i, axis));
            let points: Vec<Vector3<f64>> = frame.points.iter().enumerate().map(shaken).collect();
            let mut gradient = vec![Vector3::zeros(); points.len()];
            energy.evaluate(&points, &mut gradient);
            let along: Vec<Vector3<f64>> =
                (0..points.len()).map(|i| Vector3::from_fn(|axis, _| wave(3 * i + 1, axis) / size)).collect();
            let at = |t: f64| {
                let moved: Vec<_> = points.iter().zip(&along).map(|(p, d)| p + d * t).collect();
                energy.evaluate(&moved, &mut gradient.clone()).total()
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            let slope: f64 = gradient.iter().zip(&along).map(|(g, d)| g.dot(d)).sum();
            let scale: f64 = gradient.iter().map(Vector3::norm).sum::<f64>() + 1.0;
            prop_assert!((difference - slope).abs() < 1e-6 * scale, "{difference} {slope}");
        }
    }

    #[test]
    fn threads_do_not_matter() {
        let frame = Frame::new(&shapes::bumpy_sphere(4000)).unwrap();
        let energy = energy(&frame, 1.0);
        let points: Vec<_> = frame.points.iter().map(|p| p * 1.01).collect();
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut gradient = vec![Vector3::zeros(); points.len()];
            (pool.install(|| energy.evaluate(&points, &mut gradient)), gradient)
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn curvatures_are_of_the_right_size() {
        let frame = Frame::new(&shapes::sphere(2)).unwrap();
        let energy = energy(&frame, 0.0);
        let slope = |t: f64, v: usize, axis: usize| {
            let mut points = frame.points.clone();
            points[v][axis] += t;
            let mut gradient = vec![Vector3::zeros(); points.len()];
            energy.evaluate(&points, &mut gradient);
            gradient[v][axis]
        };
        for (v, guess) in energy.curvatures().into_iter().enumerate().step_by(9) {
            let sum: f64 = (0..3).map(|axis| (slope(1e-6, v, axis) - slope(-1e-6, v, axis)) / 2e-6).sum();
            assert!((0.5..2.0).contains(&(sum / 3.0 / guess)), "{} for {guess}", sum / 3.0);
        }
    }
}
