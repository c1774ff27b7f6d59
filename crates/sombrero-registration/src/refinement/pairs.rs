//! Pairs of a suspect's sample and the closest point of the reference.
//!
//! A sample p with closest point q and surface normal n has the residual r = n · (p - q), the signed distance from the
//! tangent plane. A pair is *compatible* when the normals at p and q are at most [`MAX_ANGLE`] apart: else q is on the
//! other side of a thin wall.

use nalgebra::{Point3, Vector3};

use crate::refinement::affine_map::AffineMap;
use crate::surface::sample::Sample;
use crate::surface::shape::Shape;

/// Cosine of the largest angle between the normals of a pair, 75 degrees: noise turns normals far.
const MAX_ANGLE: f64 = 0.26;

/// A sample in the frame of the reference and its counterpart there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub(crate) p: Point3<f64>,
    pub(crate) q: Point3<f64>,
    /// Unit normal of the reference at q.
    pub(crate) normal: Vector3<f64>,
    /// |p - q|.
    pub(crate) distance: f64,
    /// Whether q lies on the boundary of the surface.
    pub(crate) on_boundary: bool,
    /// Whether the normals agree.
    pub(crate) compatible: bool,
}

impl Pair {
    /// Signed distance of p from the tangent plane at q.
    pub(crate) fn residual(&self) -> f64 {
        self.normal.dot(&(self.p - self.q))
    }
}

/// The closest points of `surface` to the samples moved by `map`. `faces` carries guesses from call to call.
pub(crate) fn find(surface: &Shape, samples: &[Sample], map: &AffineMap, faces: &mut Vec<u32>) -> Vec<Pair> {
    let moved: Vec<_> = samples.iter().map(|s| map.point(&s.point)).collect();
    let closest = surface.closest_many(&moved, faces);
    let mut cosines = Vec::with_capacity(samples.len());
    let mut pairs = Vec::with_capacity(samples.len());
    for ((sample, p), closest) in samples.iter().zip(moved).zip(closest) {
        let Some(closest) = closest else { continue };
        let smooth = surface.smooth_normal(closest.face, closest.barycentric);
        let mut normal = surface.face_normal(closest.face);
        if normal == Vector3::zeros() {
            normal = smooth.try_normalize(0.0).unwrap_or_default();
        }
        let turned = map.normal(&sample.normal);
        cosines.push(turned.dot(&smooth) / (turned.norm() * smooth.norm()).max(f64::MIN_POSITIVE));
        pairs.push(Pair {
            p,
            q: closest.point,
            normal,
            distance: closest.distance(),
            on_boundary: surface.on_boundary(&closest),
            compatible: true,
        });
    }
    // A suspect may come with all its faces turned inside out.
    let orientation = cosines.iter().sum::<f64>().signum();
    for (pair, cosine) in pairs.iter_mut().zip(cosines) {
        pair.compatible = cosine * orientation >= MAX_ANGLE;
    }
    pairs
}
