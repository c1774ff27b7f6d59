//! Fills the boxes of a [`Tree`] from positions, leaving its shape alone.
//!
//! It ends the construction, and it follows a mesh that deforms. Answers stay exact after any motion;
//! queries slow down when triangles that are neighbours in the tree drift apart.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::limits::corners;
use crate::tree::{Node, Tree, WIDTH};

/// Fewest nodes or slots that are worth a task of their own.
const GRAIN: usize = 1024;

impl Tree {
    /// Copies the corners of `triangles` (indexed by the faces of the slots) and computes all boxes.
    pub(crate) fn refit(&mut self, points: &[Point3<f64>], triangles: &[[u32; 3]]) {
        let Self { nodes, triangles: slots, faces } = self;
        slots.par_iter_mut().zip(faces).with_min_len(GRAIN).for_each(|(slot, face)| {
            let hole = [Point3::new(f64::NAN, f64::NAN, f64::NAN); 3];
            let found = triangles.get(*face as usize).and_then(|&t| corners(points, t));
            *slot = found.unwrap_or(hole);
        });
        nodes.par_iter_mut().with_min_len(GRAIN).filter(|node| node.leaf).for_each(|leaf| {
            for child in 0..WIDTH {
                leaf.set(child, slot_box(&slots[leaf.first as usize + child]));
            }
        });
        // Children come after their parent.
        for i in (0..nodes.len()).rev() {
            if !nodes[i].leaf {
                for child in 0..nodes[i].children as usize {
                    let around = nodes[nodes[i].first as usize + child].around();
                    nodes[i].set(child, around);
                }
            }
        }
    }
}

/// Lowest and highest coordinate by axis; `(∞, -∞)` when empty.
pub(crate) type Sides = [(f64, f64); 3];

impl Node {
    fn set(&mut self, child: usize, sides: Sides) {
        for (axis, side) in sides.into_iter().enumerate() {
            (self.low[axis][child], self.high[axis][child]) = side;
        }
    }

    /// The box around all children.
    pub(crate) fn around(&self) -> Sides {
        [0, 1, 2].map(|axis| {
            let low = self.low[axis].iter().copied().fold(f64::INFINITY, f64::min);
            let high = self.high[axis].iter().copied().fold(f64::NEG_INFINITY, f64::max);
            (low, high)
        })
    }
}

/// The box of a triangle. `min` and `max` pass over NaN, so a hole has the empty box.
fn slot_box([a, b, c]: &[Point3<f64>; 3]) -> Sides {
    [0, 1, 2].map(|axis| {
        let low = f64::INFINITY.min(a[axis]).min(b[axis]).min(c[axis]);
        let high = f64::NEG_INFINITY.max(a[axis]).max(b[axis]).max(c[axis]);
        (low, high)
    })
}
