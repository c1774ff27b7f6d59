//! Radii of the balls about a landmark.

use crate::landmark::{RUNG, SPAN};

/// The radii of a description whose largest ball has the radius `largest`, and some more of the ladder `below` and
/// `above`: ascending, with the ratio [`RUNG`].
///
/// A landmark seen with them has `1 + below + above` views; view `below` has the largest ball of radius `largest`.
///
/// ```
/// use sombrero_landmarks::{SPAN, ladder};
///
/// assert_eq!(ladder(0.17, 0, 0).len(), SPAN + 1);
/// assert_eq!(ladder(0.17, 2, 3)[SPAN + 2], 0.17);
/// ```
pub fn ladder(largest: f64, below: usize, above: usize) -> Vec<f64> {
    let rungs = 0..SPAN + 1 + below + above;
    rungs.map(|rung| largest * RUNG.powi(rung as i32 - (SPAN + below) as i32)).collect()
}
