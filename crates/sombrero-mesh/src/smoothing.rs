//! What smoothing filters do to the original: S_k v - v for a few filters S_k.
//!
//! A filter with other strength or other steps does to a good part what a combination of these does, so its strength
//! need not be known: it is one more unknown. Umbrella weights, L v = mean of the neighbours - v:
//!
//! ```text
//! S_1 = ((1 - 0.34 L)(1 + 0.33 L))¹⁰                     Taubin 1995, ten iterations
//! S_2 = 1 + L/2,   S_3 = (1 + L/2)⁶,   S_4 = (1 + L/2)³⁰   Laplacian smoothing, weak to strong
//! ```

use crate::{Soup, Umbrella};
use nalgebra::{Point3, Vector3};

const TAUBIN: [f64; 2] = [0.33, -0.34];
const TAUBIN_ITERATIONS: usize = 10;
const LAPLACIAN: f64 = 0.5;
const LAPLACIAN_ITERATIONS: [usize; 3] = [1, 6, 30];

/// What the four filters do to the surface: four fields, one vector for each vertex, in model units; zero where a vertex has no
/// face.
///
/// ```
/// let ball = sombrero_shapes::bumpy_sphere(300);
/// let modes = sombrero_mesh::smoothing_modes(&ball);
/// assert!(modes.len() == 4 && modes.iter().all(|mode| mode.len() == ball.points.len()));
/// ```
pub fn smoothing_modes(original: &Soup) -> Vec<Vec<Vector3<f64>>> {
    let umbrella = Umbrella::new(original);
    let start = &original.points;
    let moved = |to: &[Point3<f64>]| to.iter().zip(start).map(|(to, from)| to - from).collect();
    let mut taubin = start.clone();
    for _ in 0..TAUBIN_ITERATIONS {
        taubin = TAUBIN.iter().fold(taubin, |v, factor| umbrella.step(&v, *factor));
    }
    let mut modes: Vec<Vec<Vector3<f64>>> = vec![moved(&taubin)];
    let (mut laplacian, mut done) = (start.clone(), 0);
    for iterations in LAPLACIAN_ITERATIONS {
        laplacian = (done..iterations).fold(laplacian, |v, _| umbrella.step(&v, LAPLACIAN));
        done = iterations;
        modes.push(moved(&laplacian));
    }
    modes
}
