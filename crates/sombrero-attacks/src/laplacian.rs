//! Plain Laplacian smoothing: v ← v + λ L v, with L v = mean of the neighbours - v.
//!
//! Unlike Taubin's filter it shrinks. Along a rim the neighbours are all neighbours too, as there. The benchmark
//! of Wang, Lavoué, Denis, Baskurt and He (2010) takes λ = 0.1 and 5 to 50 iterations.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::Point3;
use rand::Rng;
use sombrero_mesh::{Soup, Umbrella};

/// How much to smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Laplacian {
    /// Steps. Default 10.
    pub iterations: usize,
    /// λ, between 0 and 1. Default 0.1.
    pub lambda: f64,
}

impl Default for Laplacian {
    fn default() -> Self {
        Self { iterations: 10, lambda: 0.1 }
    }
}

/// The smoothed positions. Vertices without a face stay where they are.
///
/// # Errors
/// [`AttackError::Parameter`] unless λ is between 0 and 1.
pub fn laplacian(soup: &Soup, smoothing: &Laplacian) -> Result<Vec<Point3<f64>>, AttackError> {
    in_range("lambda", smoothing.lambda, (0.0, 1.0), "between 0 and 1")?;
    let umbrella = Umbrella::new(soup);
    let step = |points: Vec<Point3<f64>>, _| umbrella.step(&points, smoothing.lambda);
    Ok((0..smoothing.iterations).fold(soup.points.clone(), step))
}

impl Operation for Laplacian {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        let usual = Self::default();
        Ok(Self {
            iterations: given.whole("iterations")?.unwrap_or(usual.iterations),
            lambda: given.number("lambda")?.unwrap_or(usual.lambda),
        })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("iterations", self.iterations.to_string()), ("lambda", self.lambda.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::moved(soup, laplacian(soup, self)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::{Smoothing, smooth};
    use sombrero_shapes as shapes;

    #[test]
    fn it_shrinks_where_taubin_does_not() {
        let sphere = shapes::sphere(3);
        let radius = |points: &[Point3<f64>]| {
            points.iter().map(|p| p.coords.norm()).sum::<f64>() / points.len() as f64
        };
        let plain = laplacian(&sphere, &Laplacian { iterations: 50, lambda: 0.33 }).unwrap();
        let taubin = smooth(&sphere, &Smoothing { iterations: 50, ..Smoothing::default() });
        assert!(radius(&plain) < 0.95 && radius(&taubin) > 0.99);
    }

    #[test]
    fn a_whole_step_is_the_mean_of_the_neighbours() {
        let tetrahedron = shapes::tetrahedron();
        let once = laplacian(&tetrahedron, &Laplacian { iterations: 1, lambda: 1.0 }).unwrap();
        let sum: nalgebra::Vector3<f64> = tetrahedron.points.iter().map(|p| p.coords).sum();
        let mean = |p: &Point3<f64>| Point3::from((sum - p.coords) / 3.0);
        assert!(once.iter().zip(&tetrahedron.points).all(|(a, p)| (a - mean(p)).norm() < 1e-15));
    }
}
