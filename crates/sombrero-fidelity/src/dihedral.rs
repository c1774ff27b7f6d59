//! The bend of edges that were flat.
//!
//! The dihedral angle of an edge with unit direction t between faces of unit normals n and m is
//!
//! ```text
//! θ = atan2((n × m) · t, n · m),
//! ```
//!
//! positive where the surface is convex. DAME (Váša and Rus 2012) compares all of them, masked; here only edges that were
//! flat count, on which the eye sees most and nothing hides a bend. Slivers that are no higher than rounding have no side that
//! anybody sees, and turn over with the last digit: their edges do not count.

use crate::Change;
use nalgebra::{Point3, Vector3};
use sombrero_mesh::{Hinge, geometry};

/// An edge of a smaller angle is flat, in degrees.
pub const FLAT_EDGE: f64 = 2.0;

/// A face of a height that is at most this share of the diagonal is a sliver.
const SLIVER: f64 = 1e-6;

/// Change of the dihedral angle of the edges that were flat, root mean square by length, in degrees; `None` when no edge
/// was. O(n).
pub fn flat_dihedral(change: &Change<'_>) -> Option<f64> {
    let flat = FLAT_EDGE.to_radians();
    let [before, after] = &change.angles;
    let (mut squares, mut total) = (0.0, 0.0);
    let slivers = slivers(change);
    let counts = |hinge: &Hinge| hinge.faces.iter().all(|face| !slivers[*face as usize]);
    let hinges = change.hinges.iter().zip(before.iter().zip(after));
    for (hinge, (was, is)) in hinges.filter(|(hinge, _)| counts(hinge)) {
        if let Some((was, is)) = was.filter(|angle| angle.abs() < flat).zip(*is) {
            let [a, b] = hinge.ends.map(|v| change.before[v as usize]);
            squares += (b - a).norm() * (is - was) * (is - was);
            total += (b - a).norm();
        }
    }
    (total > 0.0).then(|| (squares / total).sqrt().to_degrees())
}

/// Whether each face is a sliver, before or after.
fn slivers(change: &Change<'_>) -> Vec<bool> {
    let least = SLIVER * change.bounds.diagonal();
    let is_sliver = |face: u32| {
        (0..2).any(|side| {
            let longest = geometry::longest_side(&change.corners(side, face));
            2.0 * change.facets[side].areas[face as usize] <= least * longest
        })
    };
    (0..change.triangles.len() as u32).map(is_sliver).collect()
}

/// The dihedral angle at a hinge, in radians; `None` beside a face without area.
pub(crate) fn angle(points: &[Point3<f64>], normals: &[Vector3<f64>], hinge: &Hinge) -> Option<f64> {
    let [n, m] = hinge.faces.map(|f| normals[f as usize]);
    let [a, b] = hinge.ends.map(|v| points[v as usize]);
    let along = (b - a).try_normalize(0.0)?;
    (n != Vector3::zeros() && m != Vector3::zeros()).then(|| libm::atan2(n.cross(&m).dot(&along), n.dot(&m)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    /// A strip of two squares of side 1 that share the edge from (1, 0, 0) to (1, 1, 0); the second is bent up.
    fn strip(angle: f64) -> [Point3<f64>; 6] {
        let (x, z) = (1.0 + angle.cos(), angle.sin());
        [[0., 0., 0.], [1., 0., 0.], [x, 0., z], [0., 1., 0.], [1., 1., 0.], [x, 1., z]].map(Point3::from)
    }

    const STRIP: [[u32; 3]; 4] = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]];

    #[test]
    fn a_bent_strip() {
        // Three flat edges: two diagonals of length √2, which stay, and the fold of length 1.
        let (before, after) = (strip(0.0), strip(0.02));
        let expected = 0.02_f64.to_degrees() * (1.0 / (1.0 + 2.0 * 2.0_f64.sqrt())).sqrt();
        let bent = flat_dihedral(&Change::new(&before, &after, &STRIP)).unwrap();
        assert!((bent - expected).abs() < 1e-12, "{bent} {expected}");
        // Bent the other way by as much.
        let other = strip(-0.02);
        let down = flat_dihedral(&Change::new(&before, &other, &STRIP)).unwrap();
        assert!((bent - down).abs() < 1e-12);
        // From one way to the other it is twice as much.
        let twice = flat_dihedral(&Change::new(&other, &after, &STRIP)).unwrap();
        assert!((twice - 2.0 * expected).abs() < 1e-10);
    }

    #[test]
    fn creases_do_not_count() {
        let (before, after) = (strip(0.1), strip(0.5));
        assert!(flat_dihedral(&Change::new(&before, &after, &STRIP)).unwrap() < 1e-12);
        let solid = shapes::icosahedron();
        assert_eq!(flat_dihedral(&Change::new(&solid.points, &solid.points, &solid.triangles)), None);
    }

    #[test]
    fn slivers_that_turn_over_do_not_count() {
        // A square whose diagonal has a third point on it but for rounding, which changes sides.
        let square = |off: f64| {
            let points = [[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0.5 + off, 0.5 - off]];
            points.map(|[x, y]| Point3::new(x, y, 0.0))
        };
        let triangles = [[0, 4, 2], [0, 1, 4], [1, 2, 4], [0, 2, 3]];
        let bent =
            |was: f64, is: f64| flat_dihedral(&Change::new(&square(was), &square(is), &triangles)).unwrap();
        assert!(bent(1e-9, -1e-9) < 1e-9);
        assert!(bent(1e-3, -1e-3) > 100.0);
    }

    #[test]
    fn convex_is_positive() {
        let cube = shapes::cube();
        let change = Change::new(&cube.points, &cube.points, &cube.triangles);
        let angles = change.hinges.iter().map(|h| angle(&cube.points, &change.facets[0].normals, h).unwrap());
        let quarter = std::f64::consts::FRAC_PI_2;
        assert_eq!(angles.filter(|angle| (angle - quarter).abs() < 1e-12).count(), 12);
    }
}
