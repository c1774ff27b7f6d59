//! The umbrella operator L v = mean of the neighbours - v (Kobbelt et al. 1998), which smoothing filters are made of.

use crate::{Rings, Soup};
use nalgebra::{Point3, Vector3};

/// The operator on the vertices of a mesh.
#[derive(Debug, Clone)]
pub struct Umbrella {
    rings: Rings,
}

impl Umbrella {
    /// Neighbours are vertices with a common face. Faces with indices out of range are passed over. O(n log n).
    pub fn new(soup: &Soup) -> Self {
        Self { rings: Rings::new(soup.points.len(), &soup.triangles) }
    }

    /// v + factor · L v for each vertex; vertices without a face stay where they are.
    ///
    /// # Panics
    /// When there are fewer points than vertices of the soup.
    pub fn step(&self, points: &[Point3<f64>], factor: f64) -> Vec<Point3<f64>> {
        let moved = |v: usize| {
            let ring = self.rings.of(v as u32);
            if ring.is_empty() {
                return points[v];
            }
            let sum: Vector3<f64> = ring.iter().map(|&w| points[w as usize] - points[v]).sum();
            points[v] + sum * (factor / ring.len() as f64)
        };
        (0..self.rings.len()).map(moved).collect()
    }
}
