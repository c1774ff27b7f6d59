//! Pairs of a suspect's sample and the closest point of the reference, with robust weights.
//!
//! A sample p with closest point q and surface normal n has the residual r = n · (p - q). Its weight is
//! zero when
//!
//! - q lies on the boundary of the reference: p may belong to what the reference does not show;
//! - the normals at p and q are more than [`MAX_ANGLE`] apart: q is on the other side of a thin wall;
//! - |p - q| exceeds `rejection` times the median over all pairs: p has no counterpart;
//!
//! and otherwise Tukey's biweight
//!
//! ```text
//! w(r) = (1 - (r / c σ)²)²  for |r| < c σ,  else 0,    σ = 1.4826 median |r|,
//! ```
//!
//! where 1.4826 makes σ the standard deviation if r is Gaussian. Both medians fall with the distances, so
//! the weights anneal by themselves; but not below a floor that the caller lowers step by step. Without it
//! the large faces of a machined part, once they lie in their planes, would make both medians zero and the
//! few faces that could still slide it into place outliers.

use nalgebra::{Point3, Vector3};

use crate::affine_map::AffineMap;
use crate::sample::Sample;
use crate::shape::Shape;

/// Cosine of the largest angle between the normals of a pair, 75 degrees: noise turns normals far.
const MAX_ANGLE: f64 = 0.26;
/// Distances below this are rounding, in the unit frame.
const ROUNDING: f64 = 1e-13;
/// Median absolute deviation to standard deviation, for Gaussian residuals.
const GAUSSIAN: f64 = 1.4826;

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

/// Outlier policy of one iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Policy {
    /// Distances beyond this many medians are rejected.
    pub(crate) rejection: Option<f64>,
    /// Residuals beyond this many σ are rejected, those near it weigh little.
    pub(crate) tukey: Option<f64>,
    /// Distances and residuals below this are kept in any case.
    pub(crate) floor: f64,
    /// Distances beyond this are rejected, whatever the median.
    pub(crate) reach: f64,
}

/// Weights of some pairs.
pub(crate) struct Weights {
    pub(crate) values: Vec<f64>,
    /// Whether the floor decided, rather than the medians.
    pub(crate) floored: bool,
}

impl Policy {
    /// Keeps and weighs all alike.
    pub(crate) fn all(floor: f64) -> Self {
        Self { rejection: None, tukey: None, floor, reach: f64::INFINITY }
    }

    /// A weight for each pair, 0 to 1.
    pub(crate) fn weights(&self, pairs: &[Pair]) -> Weights {
        let floor = self.floor.max(ROUNDING);
        // What is out of reach has no say in what is usual.
        let distances = pairs.iter().map(|p| p.distance).filter(|d| *d <= self.reach);
        let far = self.rejection.map(|k| k * median(distances.collect()));
        let limit = far.unwrap_or(f64::INFINITY).max(floor).min(self.reach);
        let kept = |p: &Pair| p.compatible && !p.on_boundary && p.distance <= limit;
        let residuals = || pairs.iter().filter(|p| kept(p)).map(|p| p.residual().abs()).collect();
        let wide = self.tukey.map(|c| c * GAUSSIAN * median(residuals()));
        let width = wide.unwrap_or(f64::INFINITY).max(floor);
        let biweight = |r: f64| (1.0 - (r / width).powi(2)).max(0.0).powi(2);
        let values = pairs.iter().map(|p| if kept(p) { biweight(p.residual()) } else { 0.0 }).collect();
        Weights { values, floored: far.is_some_and(|d| d < floor) || wide.is_some_and(|r| r < floor) }
    }
}

/// The upper median; 0 of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
