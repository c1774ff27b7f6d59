//! White noise (the paper's rows C to E): vertex j moves by a vector drawn evenly from a ball.
//!
//! The paper gives only the length of the largest displacement as a fraction of the largest side.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::Point3;
use rand::Rng;
use sombrero_mesh::Soup;
use sombrero_spatial::sample_ball;

/// Moves each point by a random vector no longer than `radius`, in model units.
pub fn noise<R: Rng + ?Sized>(points: &[Point3<f64>], radius: f64, rng: &mut R) -> Vec<Point3<f64>> {
    points.iter().map(|p| p + sample_ball(rng) * radius).collect()
}

/// White noise: a random vector for each vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Length of the longest one as a fraction of the largest side, between 0 and 10.
    pub amplitude: f64,
}

impl Operation for Noise {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self { amplitude: given.needed_number("amplitude")? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("amplitude", self.amplitude.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        in_range("amplitude", self.amplitude, (0.0, 10.0), "between 0 and 10")?;
        let side = soup.bounding_box().map_or(0.0, |b| b.largest_side());
        Ok(Attacked::moved(soup, noise(&soup.points, self.amplitude * side, rng)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn displacements_fill_the_ball_evenly() {
        let n = 20_000;
        let moved = noise(&vec![Point3::origin(); n], 2.0, &mut ChaCha8Rng::seed_from_u64(1));
        let mean = moved.iter().map(|p| p.coords).sum::<Vector3<f64>>() / n as f64;
        assert!(mean.norm() < 0.03);
        let longest = moved.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
        assert!(longest <= 2.0 && longest > 1.99);
        // Mean square of an even ball of radius R: 3/5 R².
        let square = moved.iter().map(|p| p.coords.norm_squared()).sum::<f64>() / n as f64;
        assert!((square - 2.4).abs() < 0.03);
    }
}
