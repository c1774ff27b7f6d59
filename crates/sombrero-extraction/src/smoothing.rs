//! What smoothing filters do to the original: S_k v - v for a few filters S_k.
//!
//! A filter with other strength or other steps does to a good part what a combination of these does, so its strength
//! need not be known: it is one more unknown. Umbrella weights, L v = mean of the neighbours - v:
//!
//! ```text
//! S_1 = ((1 - 0.34 L)(1 + 0.33 L))¹⁰                     Taubin 1995, ten iterations
//! S_2 = 1 + L/2,   S_3 = (1 + L/2)⁶,   S_4 = (1 + L/2)³⁰   Laplacian smoothing, weak to strong
//! ```

use nalgebra::Vector3;
use sombrero_mesh::Soup;

const TAUBIN: [f64; 2] = [0.33, -0.34];
const TAUBIN_ITERATIONS: usize = 10;
const LAPLACIAN: f64 = 0.5;
const LAPLACIAN_ITERATIONS: [usize; 3] = [1, 6, 30];

/// The four fields, one vector for each vertex; zero where a vertex has no face.
pub(crate) fn modes(original: &Soup) -> Vec<Vec<Vector3<f64>>> {
    let rings = Rings::new(original);
    let start: Vec<Vector3<f64>> = original.points.iter().map(|p| p.coords).collect();
    let moved = |to: &[Vector3<f64>]| to.iter().zip(&start).map(|(to, from)| to - from).collect();
    let mut taubin = start.clone();
    for _ in 0..TAUBIN_ITERATIONS {
        taubin = TAUBIN.iter().fold(taubin, |v, factor| rings.step(&v, *factor));
    }
    let mut modes: Vec<Vec<Vector3<f64>>> = vec![moved(&taubin)];
    let (mut laplacian, mut done) = (start.clone(), 0);
    for iterations in LAPLACIAN_ITERATIONS {
        laplacian = (done..iterations).fold(laplacian, |v, _| rings.step(&v, LAPLACIAN));
        done = iterations;
        modes.push(moved(&laplacian));
    }
    modes
}

/// The neighbours of each vertex, one after the other.
struct Rings {
    starts: Vec<usize>,
    all: Vec<u32>,
}

impl Rings {
    fn new(soup: &Soup) -> Self {
        let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)];
        let mut pairs: Vec<(u32, u32)> =
            soup.triangles.iter().flat_map(edges).filter(|(a, b)| a != b).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let starts = (0..=soup.points.len()).map(|v| pairs.partition_point(|p| (p.0 as usize) < v)).collect();
        Self { starts, all: pairs.into_iter().map(|p| p.1).collect() }
    }

    /// v + factor · L v.
    fn step(&self, v: &[Vector3<f64>], factor: f64) -> Vec<Vector3<f64>> {
        let moved = |(i, x): (usize, &Vector3<f64>)| {
            let ring = &self.all[self.starts[i]..self.starts[i + 1]];
            if ring.is_empty() {
                return *x;
            }
            let mean = ring.iter().map(|&j| v[j as usize]).sum::<Vector3<f64>>() / ring.len() as f64;
            x + (mean - x) * factor
        };
        v.iter().enumerate().map(moved).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::shapes;

    #[test]
    fn stronger_smoothing_moves_further_and_inwards() {
        let soup = shapes::sphere(3);
        let modes = modes(&soup);
        let inward = |mode: &[Vector3<f64>]| -> f64 {
            -mode.iter().zip(&soup.points).map(|(d, p)| d.dot(&p.coords.normalize())).sum::<f64>()
        };
        let depths: Vec<f64> = modes[1..].iter().map(|m| inward(m)).collect();
        assert!(depths[0] > 0.0 && depths.is_sorted(), "{depths:?}");
        assert!(inward(&modes[0]).abs() < depths[1], "Taubin's filter hardly shrinks");
    }
}
