//! Points spread evenly over a surface, the same ones every time.
//!
//! Sample i of n stands for the i-th of n equal shares of the area, counted through the triangles in their
//! order; its place on its triangle comes from the additive sequence
//!
//! ```text
//! uᵢ = frac(1/2 + i/p),  vᵢ = frac(1/2 + i/p²),  p³ = p + 1 (p = 1.3247…),
//! ```
//!
//! which fills the square without clusters. The square is folded onto the triangle.

use nalgebra::Point3;

use crate::sample::{RunningAreas, SurfaceSample, folded};

/// 1/p and 1/p².
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// `count` samples, each standing for the same area; none when no face has area.
///
/// Faces with bad indices or corners are left out.
pub fn spread_samples(points: &[Point3<f64>], triangles: &[[u32; 3]], count: usize) -> Vec<SurfaceSample> {
    Spread::new(points, triangles).samples(count)
}

/// A surface from which samples are taken several times.
#[derive(Debug, Clone)]
pub struct Spread(RunningAreas);

impl Spread {
    /// Adds up the areas of the faces. O(n).
    pub fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        Self(RunningAreas::new(points, triangles))
    }

    /// [`spread_samples`] of the surface.
    pub fn samples(&self, count: usize) -> Vec<SurfaceSample> {
        let share = self.0.total() / count as f64;
        spread_with(&self.0, count, STEPS, |i| (i as f64 + 0.5) * share)
    }
}

/// The samples with other `steps`, sample i on the face that covers the area `place(i)`.
pub(crate) fn spread_with(
    areas: &RunningAreas,
    count: usize,
    steps: [f64; 2],
    place: impl Fn(usize) -> f64,
) -> Vec<SurfaceSample> {
    if areas.total() <= 0.0 {
        return Vec::new();
    }
    let sample = |i: usize| {
        let [u, v] = steps.map(|step| (0.5 + i as f64 * step).fract());
        SurfaceSample { face: areas.face_at(place(i)), barycentric: folded(u, v) }
    };
    (0..count).map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use sombrero_shapes as shapes;

    #[test]
    fn samples_lie_evenly() {
        let soup = shapes::cube();
        let samples = spread_samples(&soup.points, &soup.triangles, 6000);
        assert_eq!(samples.len(), 6000);
        let of_face = |face: u32| samples.iter().filter(|s| s.face == face).count();
        // All triangles of the cube are equal.
        let each = 6000 / soup.triangles.len();
        assert!((0..soup.triangles.len() as u32).all(|face| of_face(face).abs_diff(each) <= 1));
        let place = |s: &SurfaceSample| s.point(&soup.points, &soup.triangles).unwrap().coords;
        let mean = samples.iter().map(place).sum::<Vector3<f64>>() / 6000.0;
        let box_ = soup.bounding_box().unwrap();
        let centre = nalgebra::center(&box_.min, &box_.max).coords;
        assert!((mean - centre).norm() < 5e-3 * box_.largest_side());
    }

    #[test]
    fn nothing_has_no_samples() {
        assert_eq!(spread_samples(&[], &[[0, 1, 2]], 10), []);
        assert_eq!(spread_samples(&[Point3::origin()], &[[0, 0, 0]], 10), []);
        assert_eq!(spread_samples(&shapes::cube().points, &shapes::cube().triangles, 0), []);
    }
}
