//! The nearest face on a line.
//!
//! With corners a, b, c, edges e₁ = b - a and e₂ = c - a, and the line o + t d (Möller and Trumbore 1997),
//!
//! ```text
//! u = (d × e₂) · (o - a) / D,   v = ((o - a) × e₁) · d / D,   t = ((o - a) × e₁) · e₂ / D,   D = (d × e₂) · e₁;
//! ```
//!
//! it meets the face where u, v and 1 - u - v are not negative. They may be so by a rounding error, so that no line slips
//! through the seam of two faces.

use nalgebra::{Point3, Vector3};

use crate::limits::usable;
use crate::surface::Surface;
use crate::tree::{Node, Tree, WIDTH};

/// A line may miss a face by this share of it and meet it still.
const SEAM: f64 = 1e-12;

/// Three siblings wait at each level, and 2³² slots make at most 16 levels.
const STACK: usize = 64;

/// A straight line with a point to measure from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// The point that distances are from.
    pub origin: Point3<f64>,
    /// Where positive distances are; its length is their unit.
    pub direction: Vector3<f64>,
}

/// Where a line meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Crossing {
    /// Signed distance from the origin, in lengths of the direction.
    pub distance: f64,
    /// The face that is met.
    pub face: u32,
}

impl Surface {
    /// The nearest of the faces that `line` meets within `reach` on both sides of its origin and that `counts`; among
    /// equally near ones that of the smallest index. O(log n) as a rule.
    ///
    /// ```
    /// use nalgebra::{Point3, Vector3};
    /// use sombrero_spatial::{Line, Surface};
    ///
    /// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
    /// let surface = Surface::new(&points, &[[0, 1, 2]]);
    /// let line = Line { origin: Point3::new(0.25, 0.25, 2.0), direction: Vector3::z() };
    /// let met = surface.nearest_on_line(&line, f64::INFINITY, |_| true);
    /// assert_eq!(met.map(|met| met.distance), Some(-2.0));
    /// assert_eq!(surface.nearest_on_line(&line, 1.0, |_| true), None);
    /// ```
    pub fn nearest_on_line(&self, line: &Line, reach: f64, counts: impl Fn(u32) -> bool) -> Option<Crossing> {
        if !usable(&line.origin) || !usable(&Point3::from(line.direction)) {
            return None;
        }
        let [behind, ahead] = search(self.tree(), line, Found::new(reach, false), counts);
        [behind, ahead].into_iter().flatten().reduce(|a, b| if b.rank() < a.rank() { b } else { a })
    }

    /// The same behind the origin, where distances are negative, and ahead of it. A face at the origin is on both sides.
    pub fn nearest_each_way(
        &self,
        line: &Line,
        reach: f64,
        counts: impl Fn(u32) -> bool,
    ) -> [Option<Crossing>; 2] {
        if !usable(&line.origin) || !usable(&Point3::from(line.direction)) {
            return [None; 2];
        }
        search(self.tree(), line, Found::new(reach, true), counts)
    }
}

impl Crossing {
    /// The nearest comes first, and of equally near ones that of the smallest index.
    fn rank(&self) -> (f64, u32) {
        (self.distance.abs(), self.face)
    }
}

/// What was found so far behind the origin, and ahead of it.
struct Found {
    best: [Option<Crossing>; 2],
    /// How far to look on both sides.
    reach: [f64; 2],
    /// Whether each side has a nearest of its own.
    apart: bool,
}

impl Found {
    fn new(reach: f64, apart: bool) -> Self {
        Self { best: [None; 2], reach: [reach; 2], apart }
    }

    /// Nothing further away is looked for on any side.
    fn furthest(&self) -> f64 {
        self.reach[0].max(self.reach[1])
    }

    fn try_face(&mut self, crossing: Crossing, counts: impl Fn(u32) -> bool) {
        let (distance, face) = crossing.rank();
        for (side, is_there) in [crossing.distance <= 0.0, crossing.distance >= 0.0].into_iter().enumerate() {
            let nearer = self.best[side].is_none_or(|best| crossing.rank() < best.rank());
            if is_there && distance <= self.reach[side] && nearer && counts(face) {
                self.best[side] = Some(crossing);
                self.reach[side] = distance;
                self.reach[1 - side] = if self.apart { self.reach[1 - side] } else { distance };
            }
        }
    }
}

fn search(tree: &Tree, line: &Line, mut found: Found, counts: impl Fn(u32) -> bool) -> [Option<Crossing>; 2] {
    let ray = Ray::new(tree, line);
    // Nodes that wait, the nearest last, with how near the line may meet something in them.
    let mut stack = [(0u32, 0.0_f64); STACK];
    let mut waiting = usize::from(!tree.nodes.is_empty());
    while waiting > 0 {
        waiting -= 1;
        let (number, near) = stack[waiting];
        if near > found.furthest() {
            continue;
        }
        let node = &tree.nodes[number as usize];
        let from = waiting;
        for (child, near) in (node.first..).zip(ray.entered(node, found.reach)) {
            if near > found.furthest() || near == f64::INFINITY {
                continue;
            }
            if !node.leaf {
                let place = (from..waiting).find(|&k| stack[k].1 < near).unwrap_or(waiting);
                stack.copy_within(place..waiting, place + 1);
                stack[place] = (child, near);
                waiting += 1;
                continue;
            }
            if let Some(distance) = meets(line, &tree.triangles[child as usize]) {
                found.try_face(Crossing { distance, face: tree.faces[child as usize] }, &counts);
            }
        }
    }
    found.best
}

/// A line as boxes see it.
struct Ray {
    inverse: Vector3<f64>,
    /// From where the low and the high sides of boxes are seen.
    origins: [Point3<f64>; 2],
}

impl Ray {
    fn new(tree: &Tree, line: &Line) -> Self {
        /// Sides that a line runs along are so many sizes of the tree further out, so that no face is missed by rounding.
        const MARGIN: f64 = 1e-9;
        let sides = tree.nodes.first().map(Node::around).unwrap_or_default();
        let size = sides.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
        let margin = line.direction.map(|d| if d == 0.0 { MARGIN * size } else { 0.0 });
        let inverse = line.direction.map(|d| 1.0 / d);
        Self { inverse, origins: [line.origin + margin, line.origin - margin] }
    }

    /// How near to its origin the line enters each child's box; infinite where it does not within `reach` on both sides.
    #[inline]
    fn entered(&self, node: &Node, [behind, ahead]: [f64; 2]) -> [f64; WIDTH] {
        /// A box is left a little later than rounding says.
        const SLACK: f64 = 1e-13;
        let (mut enter, mut leave) = ([-behind; WIDTH], [ahead; WIDTH]);
        for axis in 0..3 {
            let inverse = self.inverse[axis];
            let low = (&node.low[axis], self.origins[0][axis]);
            let high = (&node.high[axis], self.origins[1][axis]);
            let [near, far] = if inverse.is_sign_positive() { [low, high] } else { [high, low] };
            for child in 0..WIDTH {
                let ((near, start), (far, end)) = (near, far);
                let (near, far) = ((near[child] - start) * inverse, (far[child] - end) * inverse);
                // A comparison with NaN is false: a line within a side is limited by the others.
                enter[child] = if near > enter[child] { near } else { enter[child] };
                leave[child] = if far < leave[child] { far } else { leave[child] };
            }
        }
        let mut nearest = [f64::INFINITY; WIDTH];
        for child in 0..WIDTH {
            let slack = SLACK * (enter[child].abs() + leave[child].abs());
            // What a line beside a box never enters is infinitely far, and so would be the slack.
            let enters = enter[child] < f64::INFINITY && enter[child] <= leave[child] + slack;
            if enters && node.low[0][child] <= node.high[0][child] {
                // Ahead, behind, or around the origin.
                nearest[child] = (enter[child].max(-leave[child]) - slack).max(0.0);
            }
        }
        nearest
    }
}

/// How far along the line the triangle is met.
#[inline]
fn meets(line: &Line, [a, b, c]: &[Point3<f64>; 3]) -> Option<f64> {
    let (one, two, seen) = (b - a, c - a, line.origin - a);
    let across = line.direction.cross(&two);
    let determinant = across.dot(&one);
    let other = seen.cross(&one);
    let (u, v) = (across.dot(&seen) / determinant, other.dot(&line.direction) / determinant);
    // A comparison with NaN, of a line within the plane, is false.
    (u >= -SEAM && v >= -SEAM && u + v <= 1.0 + SEAM).then(|| other.dot(&two) / determinant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(|[x, y, z]: [f64; 3]| Vector3::new(x, y, z))
    }

    /// Any direction, and such along planes of the axes.
    fn direction() -> impl Strategy<Value = Vector3<f64>> {
        (vector(), prop::array::uniform3(prop_oneof![4 => Just(1.0), 1 => Just(0.0), 1 => Just(-0.0)]))
            .prop_map(|(d, factors)| d.component_mul(&Vector3::from(factors)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn the_nearest_of_all_faces(origin in vector(), direction in direction(), reach in 0.1..3.0f64, odd in 0u32..3) {
            let soup = shapes::bumpy_sphere(200);
            let surface = Surface::new(&soup.points, &soup.triangles);
            let line = Line { origin: Point3::from(origin), direction };
            let counts = |face: u32| face % 3 != odd;
            let all = soup.triangles.iter().zip(0..).filter(|(_, face)| counts(*face)).filter_map(|(t, face)| {
                let distance = meets(&line, &t.map(|v| soup.points[v as usize]))?;
                (distance.abs() <= reach).then_some(Crossing { distance, face })
            });
            let all: Vec<Crossing> = all.collect();
            let least = |is_there: fn(&&Crossing) -> bool| {
                all.iter().filter(is_there).copied().reduce(|a, b| if b.rank() < a.rank() { b } else { a })
            };
            prop_assert_eq!(surface.nearest_on_line(&line, reach, counts), least(|_| true));
            let each_way = [least(|c| c.distance <= 0.0), least(|c| c.distance >= 0.0)];
            prop_assert_eq!(surface.nearest_each_way(&line, reach, counts), each_way);
        }

        #[test]
        fn nothing_slips_out_of_a_closed_surface(direction in direction()) {
            prop_assume!(direction.norm() > 0.1);
            let soup = shapes::cube();
            let surface = Surface::new(&soup.points, &soup.triangles);
            let line = Line { origin: Point3::origin(), direction };
            prop_assert!(surface.nearest_on_line(&line, f64::INFINITY, |_| true).is_some());
        }
    }

    #[test]
    fn a_line_beside_a_box_does_not_enter_it() {
        let soup = shapes::cube();
        let tree = Surface::new(&soup.points, &soup.triangles);
        let tree = tree.tree();
        let half = soup.points[0].x.abs();
        let enters = |x: f64, along: Vector3<f64>| {
            let line = Line { origin: Point3::new(x, 0.1 * half, 0.2 * half), direction: along };
            let entered = Ray::new(tree, &line).entered(&tree.nodes[0], [f64::INFINITY; 2]);
            entered.iter().any(|near| *near < f64::INFINITY)
        };
        for along in
            [Vector3::y(), -Vector3::y(), Vector3::new(-0.0, 1.0, -0.0), Vector3::new(-0.0, -1.0, 0.3)]
        {
            assert!(!enters(1.01 * half, along) && !enters(-1.01 * half, along), "{along}");
            assert!(enters(half, along) && enters(0.3 * half, along), "{along}");
            // A face may be missed by rounding.
            assert!(enters(half * (1.0 + 1e-12), along), "{along}");
        }
    }

    #[test]
    fn along_the_axes_through_seams() {
        let soup = shapes::cube();
        let surface = Surface::new(&soup.points, &soup.triangles);
        let half = soup.points[0].x.abs();
        for axis in 0..3 {
            let mut direction = Vector3::zeros();
            direction[axis] = 1.0;
            let line = Line { origin: Point3::origin(), direction };
            let met = surface.nearest_on_line(&line, f64::INFINITY, |_| true).unwrap();
            assert!((met.distance.abs() - half).abs() < 1e-15);
        }
        let nowhere = Line { origin: Point3::origin(), direction: Vector3::zeros() };
        assert_eq!(surface.nearest_on_line(&nowhere, f64::INFINITY, |_| true), None);
        let lost = Line { origin: Point3::new(f64::NAN, 0.0, 0.0), direction: Vector3::x() };
        assert_eq!(surface.nearest_on_line(&lost, f64::INFINITY, |_| true), None);
    }
}
