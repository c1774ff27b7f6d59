//! The faces whose boxes a box touches: what may meet a face is among those of its own box.

use std::ops::ControlFlow;

use sombrero_mesh::BoundingBox;

use crate::surface::Surface;
use crate::tree::{Node, WIDTH};

/// Each level leaves three siblings waiting, and 2³² slots make at most 16 levels.
const STACK: usize = 64;

impl Surface {
    /// Visits every face whose bounding box has a point in common with `bounds`, until `visit` breaks off. The order
    /// depends on the number of faces and their centres alone. O(log n) and what is visited, as a rule.
    ///
    /// ```
    /// use nalgebra::Point3;
    /// use sombrero_mesh::BoundingBox;
    /// use sombrero_spatial::Surface;
    /// use std::ops::ControlFlow;
    ///
    /// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 5.0]].map(Point3::from);
    /// let surface = Surface::new(&points, &[[0, 1, 2], [1, 2, 3]]);
    /// let above = BoundingBox { min: Point3::new(0.0, 0.0, 2.0), max: Point3::new(1.0, 1.0, 3.0) };
    /// let mut met = Vec::new();
    /// surface.visit_overlapping(&above, |face| {
    ///     met.push(face);
    ///     ControlFlow::Continue(())
    /// });
    /// assert_eq!(met, [1]);
    /// ```
    pub fn visit_overlapping(&self, bounds: &BoundingBox, mut visit: impl FnMut(u32) -> ControlFlow<()>) {
        let tree = self.tree();
        let mut stack = [0u32; STACK];
        let mut waiting = usize::from(!tree.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let node = &tree.nodes[stack[waiting] as usize];
            for (child, _) in (node.first..).zip(touched(node, bounds)).filter(|(_, touched)| *touched) {
                if !node.leaf {
                    stack[waiting] = child;
                    waiting += 1;
                } else if visit(tree.faces[child as usize]).is_break() {
                    return;
                }
            }
        }
    }
}

/// Which children's boxes have a point in common with `bounds`; never one that is absent or empty.
#[inline]
fn touched(node: &Node, bounds: &BoundingBox) -> [bool; WIDTH] {
    std::array::from_fn(|child| {
        (0..3).all(|axis| {
            node.low[axis][child] <= bounds.max[axis] && node.high[axis][child] >= bounds.min[axis]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        let x = || prop_oneof![8 => (-8i32..=8).prop_map(f64::from), 1 => Just(f64::NAN)];
        [x(), x(), x()].prop_map(Point3::from)
    }

    proptest! {
        #[test]
        fn all_faces_that_touch_and_no_others(
            points in prop::collection::vec(point(), 1..40),
            triangles in prop::collection::vec([0u32..42, 0..42, 0..42], 0..80),
            a in point(), b in point()
        ) {
            let bounds = BoundingBox { min: a.inf(&b), max: a.sup(&b) };
            let surface = Surface::new(&points, &triangles);
            let mut met = Vec::new();
            surface.visit_overlapping(&bounds, |face| { met.push(face); ControlFlow::Continue(()) });
            met.sort_unstable();
            let touches = |t: &[u32; 3]| {
                let corners = t.map(|v| points.get(v as usize).filter(|p| p.iter().all(|x| x.is_finite())));
                let [Some(a), Some(b), Some(c)] = corners else { return false };
                let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
                (0..3).all(|k| low[k] <= bounds.max[k] && high[k] >= bounds.min[k])
            };
            let expected: Vec<u32> =
                triangles.iter().zip(0..).filter(|(t, _)| touches(t)).map(|(_, face)| face).collect();
            prop_assert_eq!(met, expected);
        }
    }

    #[test]
    fn breaks_off() {
        let soup = sombrero_shapes::cube();
        let surface = Surface::new(&soup.points, &soup.triangles);
        let mut met = 0;
        let all = BoundingBox::of(&soup.points).unwrap();
        surface.visit_overlapping(&all, |_| {
            met += 1;
            if met == 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert_eq!(met, 5);
    }
}
