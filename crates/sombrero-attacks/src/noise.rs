//! White noise (the paper's rows C to E): vertex j moves by a vector drawn evenly from a ball.
//!
//! The paper gives only the length of the largest displacement as a fraction of the largest side.

use nalgebra::{Point3, Vector3};
use rand::{Rng, RngExt};

/// Moves each point by a random vector no longer than `radius`, in model units.
pub fn noise<R: Rng + ?Sized>(points: &[Point3<f64>], radius: f64, rng: &mut R) -> Vec<Point3<f64>> {
    points.iter().map(|p| p + in_unit_ball(rng) * radius).collect()
}

/// Moves each coordinate by a number drawn evenly from ± `amplitude` times the mean distance of the vertices from their
/// centre: the noise of the benchmark for mesh watermarking by Wang, Lavoue, Denis, Baskurt and He (2010). Only
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

/// An even draw from the unit ball, by rejection from the cube (no trigonometry, so the same everywhere).
pub(crate) fn in_unit_ball<R: Rng + ?Sized>(rng: &mut R) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| 2.0 * rng.random::<f64>() - 1.0);
        if v.norm_squared() <= 1.0 {
            return v;
        }
    }
}

/// Any direction, all equally likely.
pub(crate) fn random_direction<R: Rng + ?Sized>(rng: &mut R) -> Vector3<f64> {
    in_unit_ball(rng).try_normalize(0.0).unwrap_or_else(Vector3::x)
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
