//! The closest triangle of a [`Tree`], nearest boxes first.
//!
//! The squared distance from p to the box [l, h] bounds that to everything inside it from below:
//!
//! ```text
//! bound = Σ over axes of max(l - p, p - h, 0)².
//! ```
//!
//! The descent takes the child of least bound first and keeps the others on a stack until the best
//! distance so far rules them out. The answer is the smallest pair (squared distance, face), which no
//! order of visits can change: a box is passed over only when its bound exceeds the best by more than
//! rounding could explain.

use nalgebra::Point3;

use crate::tree::{NO_FACE, Node, Tree, WIDTH};
use crate::triangle::{self, Foot};

/// A bound may exceed the computed distance to something in the box by a few units in the last place.
const SLACK: f64 = 1.0 + 1e-14;

/// More than the square of any distance between usable points, and less than the bound `∞` of an absent child.
const BEYOND_ALL: f64 = 1e300;

/// Three siblings wait at each level, and 2³² slots make at most 16 levels of nodes.
const STACK: usize = 64;

/// The best triangle so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Best {
    pub(crate) foot: Foot,
    pub(crate) face: u32,
    pub(crate) slot: u32,
}

impl Best {
    /// Nothing yet, and nothing accepted beyond this squared distance.
    pub(crate) fn within(squared_distance: f64) -> Self {
        let foot = Foot { squared_distance: squared_distance.min(BEYOND_ALL), barycentric: [1.0, 0.0, 0.0] };
        // A face found exactly at the limit wins against this one, which is larger than all.
        Self { foot, face: NO_FACE, slot: 0 }
    }

    fn limit(&self) -> f64 {
        self.foot.squared_distance * SLACK
    }
}

impl Tree {
    /// Improves `best` by all triangles of the tree whose face is accepted; `p` must be usable.
    pub(crate) fn search(&self, p: &Point3<f64>, mut best: Best, accept: impl Fn(u32) -> bool) -> Best {
        let mut stack = [(0.0, 0); STACK];
        let mut waiting = usize::from(!self.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let (bound, node) = stack[waiting];
            if bound > best.limit() {
                continue;
            }
            let node = &self.nodes[node as usize];
            let bounds = bounds(node, p);
            if node.leaf {
                for (slot, bound) in (node.first..).zip(bounds) {
                    if bound <= best.limit() && accept(self.faces[slot as usize]) {
                        self.try_slot(p, slot, &mut best);
                    }
                }
                continue;
            }
            let base = waiting;
            for (child, bound) in (node.first..).zip(bounds) {
                if bound <= best.limit() {
                    // Insertion keeps the nearest child on top.
                    let mut at = waiting;
                    while at > base && stack[at - 1].0 < bound {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = (bound, child);
                    waiting += 1;
                }
            }
        }
        best
    }

    /// Improves `best` by the triangle of one slot.
    #[inline]
    pub(crate) fn try_slot(&self, p: &Point3<f64>, slot: u32, best: &mut Best) {
        let foot = triangle::closest(p, &self.triangles[slot as usize]);
        let face = self.faces[slot as usize];
        let key = |foot: &Foot, face: u32| (foot.squared_distance, face);
        // NaN, the distance to a hole, is never less.
        if key(&foot, face) < key(&best.foot, best.face) {
            *best = Best { foot, face, slot };
        }
    }
}

/// Squared distances from `p` to the boxes of the children; `∞` where there is none.
#[inline]
fn bounds(node: &Node, p: &Point3<f64>) -> [f64; WIDTH] {
    let mut sum = [0.0; WIDTH];
    for (axis, &x) in p.iter().enumerate() {
        let sides = node.low[axis].iter().zip(&node.high[axis]);
        for (sum, (low, high)) in sum.iter_mut().zip(sides) {
            let gap = larger(larger(low - x, x - high), 0.0);
            *sum += gap * gap;
        }
    }
    sum
}

/// The larger of two numbers in one instruction: `f64::max` spends more on NaN, which boxes never hold.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
