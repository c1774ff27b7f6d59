//! Normals and areas of triangles.

use crate::geometry::area_vector;
use nalgebra::{Point3, Vector3};

/// A triangle with less than this share of the largest one's area has no normal that means anything.
const LEAST_AREA: f64 = 1e-12;

/// Which way each triangle faces, and how large it is.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Facets {
    /// Of unit length; zero where there is no area to speak of.
    pub normals: Vec<Vector3<f64>>,
    /// In square model units.
    pub areas: Vec<f64>,
}

impl Facets {
    /// Those of `triangles` over `points`.
    ///
    /// # Panics
    /// When a corner is not a point.
    pub fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let vector = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| points[v as usize]);
            area_vector(&a, &b, &c) / 2.0
        };
        let vectors: Vec<Vector3<f64>> = triangles.iter().map(vector).collect();
        let areas: Vec<f64> = vectors.iter().map(Vector3::norm).collect();
        let largest = areas.iter().fold(0.0, |a: f64, b| a.max(*b));
        let unit = |(v, area): (&Vector3<f64>, &f64)| {
            if *area > LEAST_AREA * largest { v / *area } else { Vector3::zeros() }
        };
        Self { normals: vectors.iter().zip(&areas).map(unit).collect(), areas }
    }
}
