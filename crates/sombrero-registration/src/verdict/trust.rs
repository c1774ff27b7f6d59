//! Whether a pose can be trusted.
//!
//! Two samples of the fit decide, both relative to areas of the two surfaces:
//!
//! - *agreement*, the share that lies within half a percent of the reference's diagonal of the other surface, with
//!   normals that agree, as the mean of both sides: 1 for a whole suspect, 5/6 when a third was cut away, 3/4
//!   when as much was added as there was;
//! - *sharpness*, of what has a counterpart within 2 % of the diagonal the share that has it within that half
//!   percent. Where two surfaces only happen to be near each other, distances up to 2 % are about equally
//!   frequent and a quarter to a half of them are that small; where they are the same surface, nearly all are.
//!
//! A pose is trusted when agreement is at least 0.4 and sharpness at least 0.7. Right poses of attacked models
//! have agreement 0.5 to 1 and sharpness 0.9 to 1; the best poses of unrelated shapes have agreement up to 0.3
//! and sharpness 0.2 to 0.8 (`cargo xtask alignment` measures both). Shapes made of the same large planes, such
//! as two boxes, agree honestly and are between. The verdict knows no watermark: a suspect that is the unmarked
//! original, or a copy marked for somebody else, is trusted as well.

use crate::verdict::fit::Fit;

const LEAST_AGREEMENT: f64 = 0.4;
const LEAST_SHARPNESS: f64 = 0.7;
/// Part of both from which a full refinement may yet make a quickly refined pose trustworthy.
const PROMISING: f64 = 0.75;
/// Part of both that a pose has, measured by few samples, which is trusted when measured by many.
const NEARLY: f64 = 0.9;
/// Part of both below which more steps change nothing.
const HOPELESS: f64 = 0.5;

/// Whether the two surfaces are, in this pose, the same one as far as they go.
pub(crate) fn is_trusted(fit: &Fit) -> bool {
    fit.agreement() >= LEAST_AGREEMENT && fit.sharpness() >= LEAST_SHARPNESS
}

/// Whether a pose of which only few steps were made is worth all of them.
pub(crate) fn is_promising(fit: &Fit) -> bool {
    fit.agreement() >= PROMISING * LEAST_AGREEMENT && fit.sharpness() >= PROMISING * LEAST_SHARPNESS
}

/// Whether a pose that has come to rest on few samples may be trusted after the last steps.
pub(crate) fn is_nearly_trusted(fit: &Fit) -> bool {
    fit.agreement() >= NEARLY * LEAST_AGREEMENT && fit.sharpness() >= NEARLY * LEAST_SHARPNESS
}

/// Whether a pose of which only few steps were made is that of another shape, as far as it tells.
pub(crate) fn is_hopeless(fit: &Fit) -> bool {
    fit.agreement() < HOPELESS * LEAST_AGREEMENT && fit.sharpness() < PROMISING * LEAST_SHARPNESS
        || fit.sharpness() < HOPELESS * LEAST_SHARPNESS
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(overlaps: [f64; 2], close: [f64; 2]) -> Fit {
        let [overlap, suspect_overlap] = overlaps;
        Fit { score: 0.5, rms: 0.01, overlap, suspect_overlap, close, samples: 1000 }
    }

    #[test]
    fn parts_are_trusted_and_neighbourhoods_are_not() {
        assert!(is_trusted(&fit([1.0, 1.0], [0.98, 0.97])));
        assert!(is_trusted(&fit([0.5, 0.5], [0.5, 0.49])));
        assert!(!is_trusted(&fit([0.9, 0.9], [0.5, 0.4])), "near each other, but not the same");
        assert!(!is_trusted(&fit([0.1, 0.6], [0.1, 0.6])), "too little");
        assert!(!is_trusted(&fit([0.0, 0.0], [0.0, 0.0])));
        assert!(!is_trusted(&fit([f64::NAN, 0.0], [f64::NAN, 0.0])));
        assert!(is_promising(&fit([0.6, 0.5], [0.4, 0.3])));
    }
}
