//! The rejector: which pairs count, and how much.
//!
//! The weight of a pair of points p and q with residual r is zero when
//!
//! - q lies on the boundary of the reference: p may belong to what the reference does not show;
//! - the normals at p and q disagree: q is on the other side of a thin wall;
//! - |p - q| exceeds `rejection` times the median over all pairs: p has no counterpart;
//!
//! and otherwise Tukey's biweight
//!
//! ```text
//! w(r) = (1 - (r / c σ)²)²  for |r| < c σ,  else 0,    σ = 1.4826 median |r|.
//! ```
//!
//! Both medians fall with the distances, so the weights anneal by themselves; but not below a floor that the caller
//! lowers step by step. Without it the large faces of a machined part, once they lie in their planes, would make both
//! medians zero and the few faces that could still slide it into place outliers.

use crate::refinement::pairs::Pair;
use sombrero_spatial::robust::{MAD_TO_DEVIATION, biweight, median};

/// Distances below this are rounding, in the unit frame.
const ROUNDING: f64 = 1e-13;

/// The outlier policy of one iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rejector {
    /// Distance, in medians, beyond which a pair is rejected.
    pub(crate) rejection: Option<f64>,
    /// Residual, in σ, beyond which a pair is rejected; those near it weigh little.
    pub(crate) tukey: Option<f64>,
    /// Distance and residual below which a pair is kept in any case.
    pub(crate) floor: f64,
    /// Distance beyond which a pair is rejected, whatever the median.
    pub(crate) reach: f64,
}

/// Weights of some pairs.
pub(crate) struct Weights {
    pub(crate) values: Vec<f64>,
    /// Whether the floor decided, rather than the medians.
    pub(crate) floored: bool,
}

impl Rejector {
    /// Rejects nothing and weighs all alike.
    pub(crate) fn none(floor: f64) -> Self {
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
        let wide = self.tukey.map(|c| c * MAD_TO_DEVIATION * median(residuals()));
        let width = wide.unwrap_or(f64::INFINITY).max(floor);
        let weight = |p: &Pair| if kept(p) { biweight(p.residual(), width) } else { 0.0 };
        let values = pairs.iter().map(weight).collect();
        Weights { values, floored: far.is_some_and(|d| d < floor) || wide.is_some_and(|r| r < floor) }
    }
}
