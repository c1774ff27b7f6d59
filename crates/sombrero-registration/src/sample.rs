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

use nalgebra::{Point3, Vector3};

use crate::shape::Shape;

/// 1/p and 1/p².
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// A point of a surface with its normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) point: Point3<f64>,
    /// Smoothed over the neighbouring faces; not normalised.
    pub(crate) normal: Vector3<f64>,
    /// That of its triangle, of length 1 or, for a triangle without area, 0.
    pub(crate) face_normal: Vector3<f64>,
}

impl Sample {
    /// With the normal's length 1, or 0 where there is none.
    pub(crate) fn with_unit_normal(self) -> Self {
        Self { normal: self.normal.try_normalize(0.0).unwrap_or_default(), ..self }
    }
}

/// `count` samples, each standing for the same area.
pub(crate) fn samples(shape: &Shape, count: usize) -> Vec<Sample> {
    let share = shape.moments.area / count as f64;
    let mut out = Vec::with_capacity(count);
    let mut passed = 0.0;
    for (face, t) in (0..).zip(&shape.triangles) {
        let [a, b, c] = t.map(|v| shape.points[v as usize]);
        passed += (b - a).cross(&(c - a)).norm() / 2.0;
        while out.len() < count && (out.len() as f64 + 0.5) * share < passed {
            let w = weights(out.len());
            let point = Point3::from(a.coords * w[0] + b.coords * w[1] + c.coords * w[2]);
            let (normal, face_normal) = (shape.smooth_normal(face, w), shape.face_normal(face));
            out.push(Sample { point, normal, face_normal });
        }
    }
    out
}

/// Samples with normals of length `orientation`, in an order in which the first few are spread all over: by
/// multiples of the golden section.
pub(crate) fn scattered(shape: &Shape, count: usize, orientation: f64) -> Vec<Sample> {
    let samples = samples(shape, count);
    let key = |i: usize| (i as f64 * 0.618_033_988_749_894_9).fract();
    let mut order: Vec<usize> = (0..samples.len()).collect();
    order.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
    let turned = |s: Sample| Sample { normal: s.normal * orientation, ..s };
    order.into_iter().map(|i| turned(samples[i].with_unit_normal())).collect()
}

fn weights(i: usize) -> [f64; 3] {
    let [u, v] = STEPS.map(|step| (0.5 + i as f64 * step).fract());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    [1.0 - u - v, u, v]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Side;
    use sombrero_mesh::shapes;

    #[test]
    fn samples_have_the_moments_of_the_surface() {
        let soup = shapes::part(3);
        let shape = Shape::new(Side::Reference, &soup.points, &soup.triangles).unwrap();
        let drawn = samples(&shape, 4000);
        assert_eq!(drawn.len(), 4000);
        let mean = drawn.iter().map(|s| s.point.coords).sum::<Vector3<f64>>() / 4000.0;
        assert!((mean - shape.moments.centroid.coords).norm() < 5e-3);
    }
}
