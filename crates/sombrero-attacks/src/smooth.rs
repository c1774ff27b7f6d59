//! Taubin's filter (row F): each iteration shrinks by λ and swells by μ < -λ.
//!
//!   v ← v + λ L v,  then  v ← v + μ L v,   with L v = mean of the umbrella - v.
//!
//! Frequencies k of L below 1/λ + 1/μ pass, so the shape does not shrink (key `taubin1995`). The paper says
//! "10 iterations" without λ and μ. The defaults 0.33 and -0.34 are the usual pair, with a pass band of 0.09;
//! with stronger pairs (0.5 and -0.53; 0.63 and -0.67) less of the mark is left than the paper reports.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::Point3;
use rand::Rng;
use sombrero_mesh::{Soup, Umbrella};

/// How much to smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    /// Iterations of one shrinking and one swelling step. Default 10.
    pub iterations: usize,
    /// λ, between 0 and 1. Default 0.33.
    pub lambda: f64,
    /// μ, between -2 and 0 and usually a little below -λ. Default -0.34.
    pub mu: f64,
}

impl Default for Smoothing {
    fn default() -> Self {
        Self { iterations: 10, lambda: 0.33, mu: -0.34 }
    }
}

/// The smoothed positions. Vertices without a face stay where they are.
pub fn smooth(soup: &Soup, smoothing: &Smoothing) -> Vec<Point3<f64>> {
    let umbrella = Umbrella::new(soup);
    let mut points = soup.points.clone();
    for _ in 0..smoothing.iterations {
        for factor in [smoothing.lambda, smoothing.mu] {
            points = umbrella.step(&points, factor);
        }
    }
    points
}

impl Operation for Smoothing {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        let usual = Self::default();
        Ok(Self {
            iterations: given.whole("iterations")?.unwrap_or(usual.iterations),
            lambda: given.number("lambda")?.unwrap_or(usual.lambda),
            mu: given.number("mu")?.unwrap_or(usual.mu),
        })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![
            ("iterations", self.iterations.to_string()),
            ("lambda", self.lambda.to_string()),
            ("mu", self.mu.to_string()),
        ]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        in_range("lambda", self.lambda, (0.0, 1.0), "between 0 and 1")?;
        in_range("mu", self.mu, (-2.0, 0.0), "between -2 and 0")?;
        Ok(Attacked::moved(soup, smooth(soup, self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;

    #[test]
    fn noise_goes_and_the_sphere_stays() {
        let sphere = shapes::sphere(4);
        let rough = crate::noise::noise(&sphere.points, 0.02, &mut ChaCha8Rng::seed_from_u64(2));
        let deviation = |points: &[Point3<f64>]| {
            let sum: f64 = points.iter().map(|p| (p.coords.norm() - 1.0).powi(2)).sum();
            (sum / points.len() as f64).sqrt()
        };
        let smoothed = smooth(&Soup::new(rough.clone(), sphere.triangles), &Smoothing::default());
        assert!(deviation(&smoothed) < 0.5 * deviation(&rough));
        let mean = smoothed.iter().map(|p| p.coords.norm()).sum::<f64>() / smoothed.len() as f64;
        assert!((mean - 1.0).abs() < 2e-3, "no shrinking");
    }

    #[test]
    fn no_iteration_moves_nothing() {
        let soup = shapes::open_sheet(5, 5);
        assert_eq!(smooth(&soup, &Smoothing { iterations: 0, ..Smoothing::default() }), soup.points);
    }
}
