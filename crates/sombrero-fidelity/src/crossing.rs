//! Whether two triangles cross, decided exactly.
//!
//! With [a, b, c, d] the sign of det(a - d, b - d, c - d), triangle 1 crosses the plane of triangle 2 when it has corners on
//! both sides of it. When each crosses the other's plane, both meet the line in which the planes cut each other in an
//! interval. Let p₁ be alone on the positive side of plane 2 and p₂ on that of plane 1 (q and r change places where they must):
//! the intervals overlap exactly where
//!
//! ```text
//! [p₁, q₁, p₂, q₂] ≤ 0   and   [p₁, r₁, r₂, p₂] ≤ 0
//! ```
//!
//! (Guigue and Devillers 2003). Triangles that only touch, or lie in one plane, do not cross: both signs are taken strictly.
//! They are those of exact arithmetic (Shewchuk 1997).

use nalgebra::Point3;
use robust::{Coord3D, orient3d};

type Triangle = [Point3<f64>; 3];

/// Whether the triangles cross: each has corners strictly on both sides of the other's plane, and they share more than a
/// point.
pub(crate) fn cross(one: &Triangle, other: &Triangle) -> bool {
    let Some(([p1, q1, r1], flip_other)) = alone_first(one, other) else { return false };
    let Some(([p2, q2, r2], flip_one)) = alone_first(other, one) else { return false };
    let (q1, r1) = if flip_one { (r1, q1) } else { (q1, r1) };
    let (q2, r2) = if flip_other { (r2, q2) } else { (q2, r2) };
    side(&p1, &q1, &p2, &q2) < 0.0 && side(&p1, &r1, &r2, &p2) < 0.0
}

/// The corners in their order, from the one that is alone on its side of the plane of `other`, and whether that side is the
/// negative one; `None` when they are not on both sides.
fn alone_first(corners: &Triangle, [a, b, c]: &Triangle) -> Option<(Triangle, bool)> {
    let sides = corners.map(|p| side(a, b, c, &p));
    let over = sides.iter().filter(|s| **s > 0.0).count();
    let under = sides.iter().filter(|s| **s < 0.0).count();
    if over == 0 || under == 0 {
        return None;
    }
    let negative = under == 1 && over > 1;
    let first = sides.iter().position(|s| if negative { *s < 0.0 } else { *s > 0.0 })?;
    Some(([0, 1, 2].map(|k| corners[(first + k) % 3]), negative))
}

fn side(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>, d: &Point3<f64>) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn triangle() -> impl Strategy<Value = Triangle> {
        let point = || [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(Point3::from);
        [point(), point(), point()]
    }

    /// Whether the open segment from `p` to `q` goes through the inside of the triangle.
    fn pierces(p: &Point3<f64>, q: &Point3<f64>, [a, b, c]: &Triangle) -> bool {
        let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
        side(a, b, c, p) * side(a, b, c, q) < 0.0
            && (around.iter().all(|s| *s > 0.0) || around.iter().all(|s| *s < 0.0))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4096))]

        #[test]
        fn crossing_is_an_edge_through_the_other(one in triangle(), other in triangle()) {
            let edges = |t: &Triangle| [0, 1, 2].map(|k| (t[k], t[(k + 1) % 3]));
            let through = edges(&one).iter().any(|(p, q)| pierces(p, q, &other))
                || edges(&other).iter().any(|(p, q)| pierces(p, q, &one));
            prop_assert_eq!(cross(&one, &other), through);
            prop_assert_eq!(cross(&other, &one), through);
            let turned = [other[0], other[2], other[1]];
            prop_assert_eq!(cross(&one, &turned), through);
            prop_assert_eq!(cross(&turned, &[one[2], one[0], one[1]]), through);
        }
    }

    #[test]
    fn touching_is_not_crossing() {
        let floor = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]].map(Point3::from);
        let on = |z: f64| [[1., 1., z], [1., 1., z + 1.0], [2., 1., z + 1.0]].map(Point3::from);
        assert!(!cross(&floor, &on(0.0)));
        assert!(cross(&floor, &on(-f64::MIN_POSITIVE)) && cross(&floor, &on(-0.5)));
        assert!(!cross(&floor, &floor) && !cross(&floor, &floor.map(|p| p * 0.5)));
        let point = [floor[0]; 3];
        assert!(!cross(&floor, &point) && !cross(&point, &floor));
        // Beside it, though on both sides of its plane.
        assert!(!cross(&floor, &on(-0.5).map(|p| p + nalgebra::Vector3::new(2.0, 2.0, 0.0))));
    }
}
