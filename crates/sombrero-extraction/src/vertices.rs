//! Extraction when the place of each vertex is known: three observations a vertex, one along each axis.

use crate::extractor::{Estimate, EstimateError, Extractor};
use crate::fields::Fields;
use crate::nuisance::Nuisance;
use crate::robust::{MAXWELL, TUKEY, biweight, median};
use crate::system::{Observation, Solution, solve};
use nalgebra::{Point3, Vector3};
use sombrero_progress::Progress;

/// Solves, each with weights from the residuals of the one before.
const ITERATIONS: usize = 4;
/// The least scale of residuals, in largest sides: below it lie rounding errors of the file.
const LEAST_SCALE: f64 = 1e-9;

impl Extractor {
    /// The estimate from vertices that are known one by one: `found[v]` is where vertex v of the original is on the suspect, or `None`. The suspect must have been brought
    /// near the original (first order of the nuisance); an affine map may be any that is not extreme.
    ///
    /// # Errors
    /// [`EstimateError`] for another number of vertices or a position that is not finite.
    pub fn estimate_from_vertices(
        &self,
        found: &[Option<Point3<f64>>],
        nuisance: Nuisance,
    ) -> Result<Estimate, EstimateError> {
        let original = &self.original.points;
        if found.len() != original.len() {
            return Err(EstimateError::Lengths { found: found.len(), original: original.len() });
        }
        let finite = |p: &Option<Point3<f64>>| p.is_none_or(|p| p.coords.iter().all(|x| x.is_finite()));
        if let Some(vertex) = found.iter().position(|p| !finite(p)) {
            return Err(EstimateError::Vertex { which: "suspect", vertex });
        }
        let mut fields = self.fields(nuisance);
        let used = self.original.used();
        let present: Vec<bool> = found.iter().zip(&used).map(|(f, used)| f.is_some() && *used).collect();
        let observations = self.along_axes(found, &present);
        let mut fit = Fit { weights: vec![1.0; observations.len()], variance: LEAST_SCALE * self.side };
        fit.variance = fit.variance.powi(2);
        let progress = Progress::new("extraction", ITERATIONS);
        let mut solution = self.solved(&fields, &observations, &fit);
        for _ in 1..ITERATIONS {
            progress.advance(1);
            fit = self.reweighted(&fields, &observations, &solution);
            fields.spread = solution.spread;
            solution = self.solved(&fields, &observations, &fit);
        }
        let fit = self.reweighted(&fields, &observations, &solution);
        let positions = self.positions(&fields, &solution);
        Ok(Estimate::new(&solution, &fit.weights, fit.variance, positions, present, (ITERATIONS, true)))
    }

    fn along_axes(&self, found: &[Option<Point3<f64>>], present: &[bool]) -> Vec<Observation> {
        let original = &self.original.points;
        let seen = (0..).zip(found).filter(|&(v, _): &(u32, _)| present[v as usize]);
        let offsets = seen.filter_map(|(v, p)| p.map(|p| (v, p - original[v as usize])));
        offsets
            .flat_map(|(v, offset)| {
                [0, 1, 2].map(|axis| Observation {
                    corners: [v; 3],
                    weights: [1.0, 0.0, 0.0],
                    direction: Vector3::ith(axis, 1.0),
                    offset: offset[axis],
                })
            })
            .collect()
    }

    fn solved(&self, fields: &Fields, observations: &[Observation], fit: &Fit) -> Solution {
        solve(&self.mark_matrix, fields, observations, &fit.weights, (fit.variance, self.side))
    }

    /// Weights by the length of each vertex's residual.
    fn reweighted(&self, fields: &Fields, observations: &[Observation], solution: &Solution) -> Fit {
        let length = |three: &[Observation]| {
            let v = three[0].corners[0];
            let explained = self.mark_matrix.displacement(v, &solution.w)
                + fields.displacement(v, solution.beta.as_slice());
            (Vector3::from_iterator(three.iter().map(|o| o.offset)) - explained).norm()
        };
        let lengths: Vec<f64> = observations.chunks_exact(3).map(length).collect();
        let scale = (MAXWELL * median(lengths.clone())).max(LEAST_SCALE * self.side);
        // The length of a Gaussian vector is beyond TUKEY + 1 as rarely as one of its entries beyond TUKEY.
        let weight = |r: &f64| biweight(*r, (TUKEY + 1.0) * scale);
        let weights: Vec<f64> = lengths.iter().flat_map(|r| [weight(r); 3]).collect();
        let squares: f64 = lengths.iter().zip(weights.chunks(3)).map(|(r, w)| w[0] * r * r).sum();
        let variance = squares / weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        Fit { weights, variance: variance.max((LEAST_SCALE * self.side).powi(2)) }
    }
}

/// Weights of the observations and the variance of their residuals.
struct Fit {
    weights: Vec<f64>,
    variance: f64,
}
