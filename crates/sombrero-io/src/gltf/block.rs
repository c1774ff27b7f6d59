//! Positions that are stored once, and the bounds that the file states for them.

use std::ops::Range;

use super::elements::Elements;
use crate::placement::Placement;

/// Positions that are stored once.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub(super) elements: Elements,
    pub(super) placement: Placement,
    /// The number of its first point in the document.
    pub(super) first: usize,
}

/// The `min` and `max` of an accessor, as spans of the JSON.
#[derive(Debug, Clone)]
pub(super) struct Bounds {
    pub(super) block: usize,
    pub(super) min: Option<[Range<usize>; 3]>,
    pub(super) max: Option<[Range<usize>; 3]>,
}
