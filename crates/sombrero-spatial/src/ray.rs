//! The first face that a ray meets.
//!
//! With corners a, b, c, edges e₁ = b - a and e₂ = c - a, and the ray o + t d (Möller and Trumbore 1997),
//!
//! ```text
//! u = (d × e₂) · (o - a) / D,   v = ((o - a) × e₁) · d / D,   t = ((o - a) × e₁) · e₂ / D,   D = (d × e₂) · e₁;
//! ```
//!
//! it meets the face where u, v and 1 - u - v are not negative. They may be so by a rounding error, so that no ray slips
//! through the seam of two faces.

use nalgebra::{Point3, Vector3};

use crate::limits::usable;
use crate::surface::Surface;
use crate::tree::{Node, Tree, WIDTH};

/// A ray may miss a face by this share of it and meet it still.
const SEAM: f64 = 1e-12;

/// Each level leaves three siblings waiting, and 2³² slots make at most 16 levels.
const STACK: usize = 64;

/// A straight line from a point on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Point3<f64>,
    /// Where it goes; its length is the unit of distances along the ray.
    pub direction: Vector3<f64>,
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Hit {
    /// Distance from the origin, in lengths of the direction.
    pub distance: f64,
    /// The face that is met.
    pub face: u32,
}

impl Surface {
    /// The nearest of the faces that `ray` meets within `reach` and that `counts`; among equally near ones that of the
    /// smallest index. O(log n) as a rule.
    ///
    /// ```
    /// use nalgebra::{Point3, Vector3};
    /// use sombrero_spatial::{Ray, Surface};
    ///
    /// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
    /// let surface = Surface::new(&points, &[[0, 1, 2]]);
    /// let ray = Ray { origin: Point3::new(0.25, 0.25, 2.0), direction: -Vector3::z() };
    /// assert_eq!(surface.first_hit(&ray, f64::INFINITY, |_| true).map(|hit| hit.distance), Some(2.0));
    /// assert_eq!(surface.first_hit(&ray, 1.0, |_| true), None);
    /// ```
    pub fn first_hit(&self, ray: &Ray, reach: f64, counts: impl Fn(u32) -> bool) -> Option<Hit> {
        if !usable(&ray.origin) || !usable(&Point3::from(ray.direction)) {
            return None;
        }
        first_hit(self.tree(), ray, reach, counts)
    }
}

fn first_hit(tree: &Tree, ray: &Ray, mut reach: f64, counts: impl Fn(u32) -> bool) -> Option<Hit> {
    let inverse = ray.direction.map(|d| 1.0 / d);
    let mut best: Option<Hit> = None;
    let mut stack = [0u32; STACK];
    let mut waiting = usize::from(!tree.nodes.is_empty());
    while waiting > 0 {
        waiting -= 1;
        let node = &tree.nodes[stack[waiting] as usize];
        let entered = entered(node, ray, &inverse, reach);
        for (child, _) in (node.first..).zip(entered).filter(|(_, entered)| *entered) {
            if !node.leaf {
                stack[waiting] = child;
                waiting += 1;
                continue;
            }
            let face = tree.faces[child as usize];
            let distance = meets(ray, &tree.triangles[child as usize]).filter(|t| *t <= reach);
            if let Some(distance) = distance.filter(|_| counts(face)) {
                if best.is_none_or(|best| (distance, face) < (best.distance, best.face)) {
                    best = Some(Hit { distance, face });
                    reach = distance;
                }
            }
        }
    }
    best
}

/// Which children's boxes the ray enters within `reach`.
#[inline]
fn entered(node: &Node, ray: &Ray, inverse: &Vector3<f64>, reach: f64) -> [bool; WIDTH] {
    /// A box is entered a little earlier and left a little later than rounding says.
    const SLACK: f64 = 1e-14;
    let (mut enter, mut leave) = ([0.0_f64; WIDTH], [reach; WIDTH]);
    for axis in 0..3 {
        let (origin, inverse) = (ray.origin[axis], inverse[axis]);
        for child in 0..WIDTH {
            let near = (node.low[axis][child] - origin) * inverse;
            let far = (node.high[axis][child] - origin) * inverse;
            // NaN, of a ray within a side, limits nothing: `max` and `min` pass over it.
            enter[child] = enter[child].max(near.min(far) - SLACK * near.min(far).abs());
            leave[child] = leave[child].min(near.max(far) + SLACK * near.max(far).abs());
        }
    }
    let mut entered = [false; WIDTH];
    for child in 0..WIDTH {
        entered[child] = enter[child] <= leave[child] && node.low[0][child] <= node.high[0][child];
    }
    entered
}

/// How far along the ray the triangle is met.
#[inline]
fn meets(ray: &Ray, [a, b, c]: &[Point3<f64>; 3]) -> Option<f64> {
    let (one, two, seen) = (b - a, c - a, ray.origin - a);
    let across = ray.direction.cross(&two);
    let determinant = across.dot(&one);
    let other = seen.cross(&one);
    let (u, v) = (across.dot(&seen) / determinant, other.dot(&ray.direction) / determinant);
    let distance = other.dot(&two) / determinant;
    // A comparison with NaN, of a ray within the plane, is false.
    (u >= -SEAM && v >= -SEAM && u + v <= 1.0 + SEAM && distance >= 0.0).then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(|[x, y, z]: [f64; 3]| Vector3::new(x, y, z))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn the_first_of_all_faces(origin in vector(), direction in vector(), reach in 0.1..3.0f64, odd in 0u32..3) {
            let soup = shapes::bumpy_sphere(200);
            let surface = Surface::new(&soup.points, &soup.triangles);
            let ray = Ray { origin: Point3::from(origin), direction };
            let counts = |face: u32| face % 3 != odd;
            let all = soup.triangles.iter().zip(0..).filter(|(_, face)| counts(*face)).filter_map(|(t, face)| {
                let distance = meets(&ray, &t.map(|v| soup.points[v as usize]))?;
                (distance <= reach).then_some(Hit { distance, face })
            });
            let expected = all.min_by(|a, b| a.distance.total_cmp(&b.distance).then(a.face.cmp(&b.face)));
            prop_assert_eq!(surface.first_hit(&ray, reach, counts), expected);
        }

        #[test]
        fn nothing_slips_out_of_a_closed_surface(direction in vector()) {
            prop_assume!(direction.norm() > 0.1);
            let soup = shapes::cube();
            let surface = Surface::new(&soup.points, &soup.triangles);
            let ray = Ray { origin: Point3::origin(), direction };
            prop_assert!(surface.first_hit(&ray, f64::INFINITY, |_| true).is_some());
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
            let ray = Ray { origin: Point3::origin(), direction };
            let hit = surface.first_hit(&ray, f64::INFINITY, |_| true).unwrap();
            assert!((hit.distance - half).abs() < 1e-15);
        }
        let nowhere = Ray { origin: Point3::origin(), direction: Vector3::zeros() };
        assert_eq!(surface.first_hit(&nowhere, f64::INFINITY, |_| true), None);
        let lost = Ray { origin: Point3::new(f64::NAN, 0.0, 0.0), direction: Vector3::x() };
        assert_eq!(surface.first_hit(&lost, f64::INFINITY, |_| true), None);
    }
}
