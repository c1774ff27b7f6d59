//! Smoothing filters, as nuisances: the same that `sombrero-extraction` solves for.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::{Soup, Umbrella};

/// What smoothing filters do to the surface.
pub(crate) fn modes(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Vec<Vector3<f64>>> {
    let soup = Soup::new(points.to_vec(), triangles.to_vec());
    let umbrella = Umbrella::new(&soup);
    let moved = |to: &[Point3<f64>]| to.iter().zip(points).map(|(to, from)| to - from).collect();
    let mut taubin = points.to_vec();
    for _ in 0..10 {
        taubin = [0.33, -0.34].iter().fold(taubin, |v, factor| umbrella.step(&v, *factor));
    }
    let mut modes: Vec<Vec<Vector3<f64>>> = vec![moved(&taubin)];
    let (mut laplacian, mut done) = (points.to_vec(), 0);
    for iterations in [1, 6, 30] {
        laplacian = (done..iterations).fold(laplacian, |v, _| umbrella.step(&v, 0.5));
        done = iterations;
        modes.push(moved(&laplacian));
    }
    modes
}
