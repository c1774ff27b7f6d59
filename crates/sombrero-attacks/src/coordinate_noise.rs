//! Noise of each coordinate by itself, as in the benchmark for mesh watermarking by Wang, Lavoué, Denis, Baskurt and He
//! (2010): x moves by a number drawn evenly from ± amplitude times the mean distance of the vertices from their centre.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::{Point3, Vector3};
use rand::{Rng, RngExt};
use sombrero_mesh::Soup;

/// Moves each coordinate by a number drawn evenly from ± `amplitude` times the mean distance of the vertices from their
/// centre. Only
/// vertices with `used` count for centre and distance; all are moved.
pub fn coordinate_noise<R: Rng + ?Sized>(
    points: &[Point3<f64>],
    used: &[bool],
    amplitude: f64,
    rng: &mut R,
) -> Vec<Point3<f64>> {
    let seen = || points.iter().zip(used).filter(|(_, used)| **used).map(|(p, _)| p);
    let count = seen().count().max(1) as f64;
    let centre = seen().map(|p| p.coords).sum::<Vector3<f64>>() / count;
    let radius = amplitude * seen().map(|p| (p.coords - centre).norm()).sum::<f64>() / count;
    let mut draw = || Vector3::from_fn(|_, _| radius * (2.0 * rng.random::<f64>() - 1.0));
    points.iter().map(|p| p + draw()).collect()
}

/// A random number for each coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoordinateNoise {
    /// The largest one as a multiple of the mean distance from the centre, between 0 and 10.
    pub amplitude: f64,
}

impl Operation for CoordinateNoise {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self { amplitude: given.needed_number("amplitude")? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("amplitude", self.amplitude.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        in_range("amplitude", self.amplitude, (0.0, 10.0), "between 0 and 10")?;
        Ok(Attacked::moved(soup, coordinate_noise(&soup.points, &soup.used(), self.amplitude, rng)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn coordinates_stay_within_the_share_of_the_mean_distance() {
        let corner = |i: u32| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        let cube: Vec<_> = (0..8).map(corner).collect();
        let radius = 0.1 * 0.75_f64.sqrt();
        let mut largest: f64 = 0.0;
        for seed in 0..400 {
            let moved = coordinate_noise(&cube, &[true; 8], 0.1, &mut ChaCha8Rng::seed_from_u64(seed));
            largest = moved.iter().zip(&cube).map(|(a, b)| (a - b).amax()).fold(largest, f64::max);
        }
        assert!(largest <= radius && largest > 0.999 * radius);
    }
}
