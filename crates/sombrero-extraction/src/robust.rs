//! Robust weights: Tukey's biweight with a scale from the median, as `sombrero_spatial::robust` has them.

pub(crate) use sombrero_spatial::robust::{MAD_TO_DEVIATION, biweight, median};

/// Standard deviation of each of three Gaussian numbers over the median length of the vector that they make: 1 / 1.5382.
pub(crate) const MAXWELL: f64 = 0.6501;
/// c of the biweight.
pub(crate) const TUKEY: f64 = 4.685;
