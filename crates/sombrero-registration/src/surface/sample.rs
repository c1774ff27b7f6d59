//! Points spread evenly over a surface, the same ones every time.
//!
//! Places from [`Spread`](sombrero_spatial::Spread); here each gets its normals.

use nalgebra::{Point3, Vector3};
use sombrero_spatial::SurfaceSample;

use crate::surface::shape::Shape;

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
    /// This sample with a normal of length 1, or 0 where there is none.
    pub(crate) fn with_unit_normal(self) -> Self {
        Self { normal: self.normal.try_normalize(0.0).unwrap_or_default(), ..self }
    }
}

/// `count` samples, each standing for the same area.
pub(crate) fn samples(shape: &Shape, count: usize) -> Vec<Sample> {
    let sample = |place: SurfaceSample| {
        Some(Sample {
            point: place.point(&shape.points, &shape.triangles)?,
            normal: shape.smooth_normal(place.face, place.barycentric),
            face_normal: shape.face_normal(place.face),
        })
    };
    shape.spread.samples(count).into_iter().filter_map(sample).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Side;
    use sombrero_shapes as shapes;

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
