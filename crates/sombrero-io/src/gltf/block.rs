//! Positions that are stored once, and the bounds that the file states for them.

use std::ops::Range;

use super::elements::Elements;
use crate::placement::Placement;

/// Positions that are stored once. Each of its points stands where the scene shows it first.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub(super) elements: Elements,
    /// The number of its first point in the document.
    pub(super) first: usize,
    /// The accessor that it was read for.
    pub(super) accessor: u32,
    placements: Vec<Placement>,
    /// Which of the placements each point has; empty when all have the first.
    which: Vec<u32>,
    /// Which points a primitive has shown; empty where only one mesh shows any.
    shown: Vec<bool>,
}

impl Block {
    /// A block of which nothing was shown yet. `is_shared`: several meshes show its points.
    pub(super) fn new(
        accessor: u32,
        elements: Elements,
        placement: Placement,
        first: usize,
        is_shared: bool,
    ) -> Self {
        let shown = vec![false; if is_shared { elements.count } else { 0 }];
        Self { elements, first, accessor, placements: vec![placement], which: Vec::new(), shown }
    }

    /// Where the scene puts an element.
    pub(super) fn placement(&self, element: usize) -> &Placement {
        let which = self.which.get(element).map_or(0, |which| *which as usize);
        // There is always a first one.
        self.placements.get(which).unwrap_or(&self.placements[0])
    }

    /// Notes that some elements are shown at `placement`. Calls `moves` for those that nothing has shown yet and that
    /// therefore stand there, unless they do already.
    pub(super) fn show(
        &mut self,
        elements: impl Iterator<Item = usize>,
        placement: &Placement,
        mut moves: impl FnMut(usize),
    ) {
        if self.shown.is_empty() {
            return;
        }
        let known = self.placements.iter().position(|p| p == placement);
        let number = known.unwrap_or(self.placements.len());
        let mut used = false;
        for element in elements {
            let Some(shown) = self.shown.get_mut(element).filter(|shown| !**shown) else { continue };
            *shown = true;
            if number > 0 {
                if self.which.is_empty() {
                    self.which = vec![0; self.elements.count];
                }
                if let Some(which) = self.which.get_mut(element) {
                    *which = number as u32;
                }
                moves(element);
            }
            used = true;
        }
        if known.is_none() && used {
            self.placements.push(*placement);
        }
    }

    /// Stretches of points that cover `elements`, in order, each with the one placement that they have. Where there would be
    /// more than `most`, one takes all of them for such as have the placement of the first.
    pub(super) fn stretches(&self, elements: &[u32], most: usize) -> Vec<(Range<u32>, Placement)> {
        let first = self.first as u32;
        let stretch =
            |least: u32, largest: u32| (first + least..first + largest + 1, *self.placement(least as usize));
        let whole = || elements.iter().min().zip(elements.iter().max());
        if self.which.is_empty() {
            return whole().map(|(least, largest)| stretch(*least, *largest)).into_iter().collect();
        }
        let mut sorted = elements.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        let which = |element: u32| self.which.get(element as usize).copied().unwrap_or(0);
        let alike = |a: &u32, b: &u32| (*a..=*b).all(|element| which(element) == which(*a));
        let ends = || sorted.chunk_by(alike).filter_map(|chunk| chunk.first().zip(chunk.last()));
        if ends().nth(most).is_some() {
            return whole().map(|(least, largest)| stretch(*least, *largest)).into_iter().collect();
        }
        ends().map(|(least, largest)| stretch(*least, *largest)).collect()
    }
}

/// The `min` and `max` of an accessor, as spans of the JSON.
#[derive(Debug, Clone)]
pub(super) struct Bounds {
    pub(super) block: usize,
    /// Which of the block's elements are the accessor's.
    pub(super) elements: Range<usize>,
    pub(super) min: Option<[Range<usize>; 3]>,
    pub(super) max: Option<[Range<usize>; 3]>,
}
