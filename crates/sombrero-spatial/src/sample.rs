//! Random points on a surface.
//!
//! A face is drawn with probability area / total area, by looking a uniform number up in the running
//! sum of areas. On it, (u, v) uniform in the unit square is folded into the triangle u + v ≤ 1 and
//! gives the weights (1 - u - v, u, v) of the corners.

use nalgebra::Point3;
use rand::{Rng, RngExt};

use crate::limits::corners;

/// A point on a face.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SurfaceSample {
    /// Index of the triangle.
    pub face: u32,
    /// Weights of its corners, in their order: each at least 0, sum 1.
    pub barycentric: [f64; 3],
}

impl SurfaceSample {
    /// The position; `None` when the triangle or one of its corners does not exist.
    pub fn point(&self, points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<Point3<f64>> {
        let [a, b, c] = corners(points, *triangles.get(self.face as usize)?)?;
        let w = self.barycentric;
        Some(Point3::from(a.coords * w[0] + b.coords * w[1] + c.coords * w[2]))
    }
}

/// `count` independent points, uniform by area. Empty when no face has area.
///
/// Takes three numbers a sample from `rng`. Faces with bad indices or corners are left out.
pub fn sample_surface<R: Rng + ?Sized>(
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    count: usize,
    rng: &mut R,
) -> Vec<SurfaceSample> {
    let areas = RunningAreas::new(points, triangles);
    let total = areas.total();
    if total <= 0.0 {
        return Vec::new();
    }
    let mut sample = || SurfaceSample {
        face: areas.face_at(rng.random::<f64>() * total),
        barycentric: folded(rng.random(), rng.random()),
    };
    (0..count).map(|_| sample()).collect()
}

/// The unit square folded along its diagonal, as weights of three corners.
pub(crate) fn folded(u: f64, v: f64) -> [f64; 3] {
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    [(1.0 - u - v).max(0.0), u, v]
}

/// Sums of the areas of the faces up to each one.
#[derive(Debug, Clone)]
pub(crate) struct RunningAreas(Vec<f64>);

impl RunningAreas {
    pub(crate) fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let area =
            |&t: &[u32; 3]| corners(points, t).map_or(0.0, |[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0);
        let add = |sum: &mut f64, triangle| {
            *sum += area(triangle);
            Some(*sum)
        };
        Self(triangles.iter().scan(0.0, add).collect())
    }

    pub(crate) fn total(&self) -> f64 {
        self.0.last().copied().unwrap_or(0.0)
    }

    /// The face that covers `0 ≤ area < total()` in the running sum.
    pub(crate) fn face_at(&self, area: f64) -> u32 {
        let covering = self.0.partition_point(|&sum| sum <= area);
        // Rounding may bring `area` up to the total, which the last face with area covers.
        let last = self.0.partition_point(|&sum| sum < self.total());
        covering.min(last) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn corner(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }

    #[test]
    fn faces_are_drawn_by_area_and_evenly() {
        let points = [corner(0., 0., 0.), corner(3., 0., 0.), corner(0., 1., 0.), corner(0., 0., 1.)];
        // Areas 1.5 and 0.5; no area, a bad index.
        let triangles = [[0, 0, 1], [0, 1, 2], [1, 2, 9], [0, 2, 3], [3, 3, 3]];
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let samples = sample_surface(&points, &triangles, 40_000, &mut rng);
        assert_eq!(samples.len(), 40_000);
        let on = |face| samples.iter().filter(move |s| s.face == face);
        assert_eq!(on(1).count() + on(3).count(), 40_000);
        // Four standard deviations of the binomial distribution are 350.
        assert!(on(1).count().abs_diff(30_000) < 350);
        for weight in 0..3 {
            let mean = on(1).map(|s| s.barycentric[weight]).sum::<f64>() / on(1).count() as f64;
            assert!((mean - 1.0 / 3.0).abs() < 0.006, "{mean}");
        }
        for s in samples {
            assert!((s.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!(s.barycentric.iter().all(|&w| w >= 0.0));
            assert!(s.point(&points, &triangles).is_some());
        }
    }

    #[test]
    fn nothing_to_sample() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        assert!(sample_surface(&[], &[], 9, &mut rng).is_empty());
        let flat = [corner(0., 0., 0.), corner(1., 0., 0.), corner(f64::NAN, 1., 0.)];
        assert!(sample_surface(&flat, &[[0, 1, 0], [0, 1, 2], [5, 6, 7]], 9, &mut rng).is_empty());
    }

    #[test]
    fn the_whole_running_sum_is_covered() {
        let points = [corner(0., 0., 0.), corner(1., 0., 0.), corner(0., 2., 0.)];
        let areas = RunningAreas::new(&points, &[[0, 0, 0], [0, 1, 2], [0, 1, 1], [2, 1, 0], [0, 0, 0]]);
        assert_eq!(areas.total(), 2.0);
        let faces = [0.0, 0.999, 1.0, 1.999, 2.0, 3.0].map(|area| areas.face_at(area));
        assert_eq!(faces, [1, 1, 3, 3, 3, 3]);
    }
}
