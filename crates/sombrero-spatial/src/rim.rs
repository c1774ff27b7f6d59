//! The rim of an open surface: edges with a single face, and their ends.
//!
//! Where the closest point of a surface lies on its rim, the distance says little: the query may belong to what the
//! surface does not show. Weights of corners tell whether it does, up to a tolerance that the caller states: a weight
//! of at most that counts as none.

use sombrero_mesh::lone_sides;

use crate::surface::Closest;

/// Which edges and corners of each face lie on the rim.
///
/// Vertices are told apart by index: a surface whose corners are not joined is all rim.
#[derive(Debug, Clone)]
pub struct Rim {
    /// `edges[f][k]`: whether the edge opposite corner k of face f has no other face.
    edges: Vec<[bool; 3]>,
    /// `corners[f][k]`: whether corner k of face f is the end of such an edge.
    corners: Vec<[bool; 3]>,
}

impl Rim {
    /// Finds the rim of `triangles`: O(n log n).
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let mut edges = vec![[false; 3]; triangles.len()];
        let mut ends: Vec<u32> = Vec::new();
        for side in lone_sides(triangles) {
            let (face, k) = (side / 3, side % 3);
            edges[face][(k + 2) % 3] = true;
            ends.extend([triangles[face][k], triangles[face][(k + 1) % 3]]);
        }
        ends.sort_unstable();
        ends.dedup();
        let is_end = |v: u32| ends.binary_search(&v).is_ok();
        let corners = triangles.iter().map(|t| if ends.is_empty() { [false; 3] } else { t.map(is_end) });
        Self { corners: corners.collect(), edges }
    }

    /// Whether a closest point of the surface lies on the rim: on an edge of it, or at a corner, which may be one of a
    /// face that has no edge there.
    ///
    /// # Panics
    /// When the surface has no such face.
    pub fn holds(&self, closest: &Closest, tolerance: f64) -> bool {
        let corners = &self.corners[closest.face as usize];
        let none = |k: usize| closest.barycentric[k] <= tolerance;
        let at_corner = |k: usize| corners[k] && none((k + 1) % 3) && none((k + 2) % 3);
        self.holds_edge(closest, tolerance) || (0..3).any(at_corner)
    }

    /// Whether a closest point of the surface lies on an edge of its face that belongs to the rim.
    ///
    /// # Panics
    /// When the surface has no such face.
    pub fn holds_edge(&self, closest: &Closest, tolerance: f64) -> bool {
        let edges = &self.edges[closest.face as usize];
        (0..3).any(|k| edges[k] && closest.barycentric[k] <= tolerance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Surface;
    use nalgebra::{Point3, Vector3};
    use sombrero_shapes as shapes;

    #[test]
    fn only_the_outline_of_a_sheet_is_rim() {
        let sheet = shapes::open_sheet(6, 4);
        let rim = Rim::new(&sheet.triangles);
        assert_eq!(rim.edges.iter().flatten().filter(|edge| **edge).count(), 2 * (6 + 4));
        let corners = sheet.triangles.iter().flatten().zip(rim.corners.iter().flatten());
        let mut ends: Vec<u32> = corners.filter(|(_, at)| **at).map(|(v, _)| *v).collect();
        ends.sort_unstable();
        ends.dedup();
        assert_eq!(ends.len(), 2 * (6 + 4));
        let closed = Rim::new(&shapes::torus(12, 8, 2.0, 1.0).triangles);
        assert!(closed.edges.iter().chain(&closed.corners).flatten().all(|on_rim| !on_rim));
    }

    #[test]
    fn points_beyond_the_rim_are_told_from_points_above() {
        let sheet = shapes::open_sheet(6, 4);
        let (surface, rim) = (Surface::new(&sheet.points, &sheet.triangles), Rim::new(&sheet.triangles));
        let bounds = sheet.bounding_box().unwrap();
        let middle = nalgebra::center(&bounds.min, &bounds.max);
        for beyond in [Vector3::x(), Vector3::y(), Vector3::new(1.0, 1.0, 0.0), Vector3::new(-1.0, 1.0, 0.0)]
        {
            let closest = surface.closest(&(middle + beyond * bounds.largest_side())).unwrap();
            assert!(rim.holds(&closest, 0.0));
        }
        let above = surface.closest(&(middle + Vector3::new(0.013, 0.007, 0.0))).unwrap();
        assert!(!rim.holds(&above, 0.0) && !rim.holds_edge(&above, 0.0));
    }

    #[test]
    fn a_corner_counts_on_faces_without_an_edge_there() {
        // A fan about vertex 0, open between 1 and 4: the middle face has no edge on the rim at vertex 0.
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4]];
        let rim = Rim::new(&triangles);
        let at =
            |barycentric| Closest { point: Point3::origin(), face: 1, barycentric, squared_distance: 1.0 };
        assert!(rim.holds(&at([1.0, 0.0, 0.0]), 0.0) && !rim.holds_edge(&at([1.0, 0.0, 0.0]), 0.0));
        assert!(!rim.holds(&at([1.0 - 2e-10, 1e-10, 1e-10]), 0.0));
        assert!(rim.holds(&at([1.0 - 2e-10, 1e-10, 1e-10]), 1e-9));
    }
}
