//! The umbrella operator L v = mean of the neighbours - v (Kobbelt et al. 1998), which smoothing filters are made of.

use crate::Soup;
use nalgebra::{Point3, Vector3};

/// The neighbours of each vertex.
#[derive(Debug, Clone)]
pub struct Umbrella {
    /// Where each vertex's neighbours start in `all`.
    starts: Vec<usize>,
    all: Vec<u32>,
}

impl Umbrella {
    /// Neighbours are vertices with a common face. Faces with indices out of range are passed over. O(n log n).
    pub fn new(soup: &Soup) -> Self {
        let n = soup.points.len();
        let mut pairs: Vec<(u32, u32)> = soup
            .triangles
            .iter()
            .filter(|corners| corners.iter().all(|&v| (v as usize) < n))
            .flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)])
            .filter(|(a, b)| a != b)
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0; n + 1];
        pairs.iter().for_each(|&(v, _)| starts[v as usize + 1] += 1);
        (0..n).for_each(|v| starts[v + 1] += starts[v]);
        Self { starts, all: pairs.into_iter().map(|(_, w)| w).collect() }
    }

    /// v + factor · L v for each vertex; vertices without a face stay where they are.
    ///
    /// # Panics
    /// When there are fewer points than vertices of the soup.
    pub fn step(&self, points: &[Point3<f64>], factor: f64) -> Vec<Point3<f64>> {
        let moved = |v: usize| {
            let ring = &self.all[self.starts[v]..self.starts[v + 1]];
            if ring.is_empty() {
                return points[v];
            }
            let sum: Vector3<f64> = ring.iter().map(|&w| points[w as usize] - points[v]).sum();
            points[v] + sum * (factor / ring.len() as f64)
        };
        (0..self.starts.len() - 1).map(moved).collect()
    }
}
