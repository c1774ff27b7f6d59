//! When a step is the last one.
//!
//! A step is small when it moves the samples, root mean square, by less than a fraction of the pose's own uncertainty,
//!
//! ```text
//! motion ≤ tolerance · r / √n,    r the weighted RMS residual of the n pairs,
//! ```
//!
//! or by no more than rounding does. While the floor of the rejector still decides, rather than the medians, weights
//! are about to change and a small step proves nothing.

use crate::refinement::affine_map::AffineMap;
use crate::refinement::pairs::Pair;

/// Steps below this move nothing but rounding errors, in units of the diagonal.
const SMALLEST_STEP: f64 = 1e-13;

/// The length of the last step, in standard errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Criteria {
    pub(crate) tolerance: f64,
}

impl Criteria {
    /// Whether the step `change` that `pairs` asked for is small enough. `mean_square` is their weighted mean square
    /// residual, `floored` whether the floor decided about their weights.
    pub(crate) fn are_met(
        &self,
        pairs: &[Pair],
        change: &AffineMap,
        mean_square: f64,
        floored: bool,
    ) -> bool {
        let motion = root_mean_square_motion(pairs, change);
        let standard_error = (mean_square / pairs.len().max(1) as f64).sqrt();
        motion <= SMALLEST_STEP || !floored && motion <= self.tolerance * standard_error
    }
}

fn root_mean_square_motion(pairs: &[Pair], change: &AffineMap) -> f64 {
    let squares: f64 = pairs.iter().map(|pair| (change.point(&pair.p) - pair.p).norm_squared()).sum();
    (squares / pairs.len().max(1) as f64).sqrt()
}
