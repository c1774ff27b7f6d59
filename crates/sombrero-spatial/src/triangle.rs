//! The point of one triangle closest to a query.
//!
//! With corners a, b, c seen from the query p (A = a - p and so on) and n = (b - a) × (c - a), the
//! inward edge normal n × (b - a) gives the unnormalised barycentric coordinate of the opposite corner,
//!
//! ```text
//! w_c = (n × (b - a)) · (p - a),   likewise w_a, w_b,   w_a + w_b + w_c = |n|².
//! ```
//!
//! All three are positive exactly over the face. Outside, the closest point lies on an edge whose
//! coordinate is negative: one edge beside it, two beyond a corner. Each edge is a segment with
//!
//! ```text
//! s = (b - a) · (p - a),   t = (b - a) · (b - p),   foot = (t a + s b) / (s + t),   clamped where s or t ≤ 0.
//! ```
//!
//! Ericson (Real-Time Collision Detection, 5.1.5) takes the w from products of dot products; that is
//! the same by Lagrange's identity, but loses (length / height)² digits on slivers where the cross
//! products lose length / height. The segment formula gives bit for bit the same when a and b are
//! exchanged, so that the two faces at an edge tie exactly. The distance is measured to a
//! convex combination of the corners, so it is never smaller than the truth, whatever the weights lost.

use nalgebra::{Point3, Vector3};

/// A triangle lower than this fraction of its length is treated as its three edges too.
const SLIVER: f64 = 1e-6;

/// Rounding of a weight is within this multiple of the squared size: so close to an edge the edge is tried too,
/// and a query on an edge or corner gets exactly what the neighbouring faces get.
const MARGIN: f64 = 4e-15;

/// Squared normals up to this size may be made of products that underflowed.
const UNDERFLOW: f64 = 1e-280;

/// The closest point of a triangle as weights of its corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    pub(crate) squared_distance: f64,
    pub(crate) barycentric: [f64; 3],
}

/// The point of the triangle `abc` closest to `p`. Zero-area triangles are their edges.
#[inline]
pub(crate) fn closest(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> Foot {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let seen = [a - p, b - p, c - p];
    let normal = ca.cross(&ab);
    let w = [
        -normal.cross(&bc).dot(&seen[1]),
        -normal.cross(&ca).dot(&seen[2]),
        -normal.cross(&ab).dot(&seen[0]),
    ];
    let size = ab.norm_squared() + ca.norm_squared();
    let sliver = normal.norm_squared() <= (SLIVER * size) * (SLIVER * size) + UNDERFLOW;
    let margin = MARGIN * size * size;
    let [beyond_bc, beyond_ca, beyond_ab] = w.map(|w| sliver || w <= margin);
    if !(beyond_bc || beyond_ca || beyond_ab) {
        return inside(&seen, w);
    }
    let mut best = Foot { squared_distance: f64::INFINITY, barycentric: [1.0, 0.0, 0.0] };
    if beyond_ab {
        let (d, s, t) = segment(&seen[0], &seen[1], &ab);
        best = nearer(best, d, [s, t, 0.0]);
    }
    if beyond_bc {
        let (d, s, t) = segment(&seen[1], &seen[2], &bc);
        best = nearer(best, d, [0.0, s, t]);
    }
    if beyond_ca {
        let (d, s, t) = segment(&seen[2], &seen[0], &ca);
        best = nearer(best, d, [t, 0.0, s]);
    }
    // Rough weights may be on the wrong side of zero, but any convex combination is a point of the face.
    if w.iter().all(|&w| w >= -margin) {
        let over = inside(&seen, w.map(|w| w.max(0.0)));
        best = nearer(best, over.squared_distance, over.barycentric);
    }
    best
}

#[inline]
fn nearer(best: Foot, squared_distance: f64, barycentric: [f64; 3]) -> Foot {
    if squared_distance < best.squared_distance { Foot { squared_distance, barycentric } } else { best }
}

#[inline]
fn inside(seen: &[Vector3<f64>; 3], w: [f64; 3]) -> Foot {
    let scale = 1.0 / (w[0] + w[1] + w[2]);
    let barycentric = w.map(|w| w * scale);
    let foot = seen[0] * barycentric[0] + seen[1] * barycentric[1] + seen[2] * barycentric[2];
    Foot { squared_distance: foot.norm_squared(), barycentric }
}

/// Squared distance from the origin to the segment from `a` to `b = a + ab`, and the weights of `a` and `b`.
#[inline]
fn segment(a: &Vector3<f64>, b: &Vector3<f64>, ab: &Vector3<f64>) -> (f64, f64, f64) {
    let s = -ab.dot(a);
    let t = ab.dot(b);
    if s <= 0.0 && (t > 0.0 || a.norm_squared() <= b.norm_squared()) {
        return (a.norm_squared(), 1.0, 0.0);
    }
    if t <= 0.0 {
        return (b.norm_squared(), 0.0, 1.0);
    }
    let sum = s + t;
    let (of_a, of_b) = (t / sum, s / sum);
    ((a * of_a + b * of_b).norm_squared(), of_a, of_b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point(range: f64) -> impl Strategy<Value = Point3<f64>> {
        [-range..range, -range..range, -range..range].prop_map(Point3::from)
    }

    fn at([a, b, c]: &[Point3<f64>; 3], w: [f64; 3]) -> Point3<f64> {
        Point3::from(a.coords * w[0] + b.coords * w[1] + c.coords * w[2])
    }

    fn check(p: &Point3<f64>, triangle: &[Point3<f64>; 3]) {
        let foot = closest(p, triangle);
        let w = foot.barycentric;
        assert!(w.iter().all(|&w| (0.0..=1.0 + 1e-12).contains(&w)), "{w:?}");
        assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let reach = triangle.iter().map(|q| (q - p).norm()).fold(0.0, f64::max);
        let distance = foot.squared_distance.sqrt();
        assert!(((at(triangle, w) - p).norm() - distance).abs() <= 1e-12 * reach);
        // No point of a fine grid over the triangle is nearer.
        for i in 0..=20 {
            for j in 0..=20 - i {
                let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let d = (at(triangle, [u, v, 1.0 - u - v]) - p).norm();
                assert!(distance <= d + 1e-12 * reach, "{distance} > {d} at {u} {v}");
            }
        }
        // First-order condition of the minimum over a convex set: (q - foot) · (p - foot) ≤ 0.
        let f = at(triangle, w);
        let size = (triangle[1] - triangle[0]).norm() + (triangle[2] - triangle[0]).norm();
        for q in triangle {
            assert!((q - f).dot(&(p - f)) <= 1e-5 * size * reach);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn is_the_minimum(p in point(2.0), a in point(1.0), b in point(1.0), c in point(1.0)) {
            check(&p, &[a, b, c]);
        }

        #[test]
        fn is_the_minimum_on_slivers(
            p in point(2.0), a in point(1.0), b in point(1.0), t in -0.5..1.5, offset in point(1.0), thin in 0i32..18
        ) {
            let c = a + (b - a) * t + offset.coords * 10f64.powi(-thin);
            check(&p, &[a, b, c]);
            check(&p, &[b, c, a]);
            check(&p, &[c, a, b]);
        }

        #[test]
        fn collapsed_triangles_are_segments_and_points(p in point(2.0), a in point(1.0), b in point(1.0)) {
            let ab = b - a;
            let t = ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0);
            let expected = (a + ab * t - p).norm();
            for triangle in [[a, a, b], [a, b, a], [b, a, a], [a, b, b], [a, b, nalgebra::center(&a, &b)]] {
                prop_assert!((closest(&p, &triangle).squared_distance.sqrt() - expected).abs() < 1e-12);
            }
            prop_assert!((closest(&p, &[a; 3]).squared_distance - (a - p).norm_squared()).abs() < 1e-12);
        }

        #[test]
        fn two_faces_tie_on_their_edge(p in point(2.0), a in point(1.0), b in point(1.0), c in point(1.0)) {
            let on_edge = |foot: Foot, opposite: usize| foot.barycentric[opposite] == 0.0;
            let (one, two) = (closest(&p, &[a, b, c]), closest(&p, &[b, a, a + (a - c)]));
            if on_edge(one, 2) && on_edge(two, 2) {
                prop_assert_eq!(one.squared_distance.to_bits(), two.squared_distance.to_bits());
            }
        }

        #[test]
        fn any_size_is_fine(p in point(1.0), a in point(1.0), b in point(1.0), c in point(1.0), e in -320i32..70) {
            let scale = if e < -300 { 10f64.powi(-300) * 10f64.powi(e + 300) } else { 10f64.powi(e) };
            let foot = closest(&(p * scale), &[a * scale, b * scale, c * scale]);
            prop_assert!(foot.squared_distance.is_finite());
            prop_assert!((foot.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        }
    }
}
