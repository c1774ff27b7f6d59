//! Joins vertices that stand at equal positions.
//!
//! STL stores three corners for every facet and many exporters double vertices along texture seams; for
//! the watermark such copies are one point of the surface, and they move together.

use crate::Soup;
use crate::repair::{Repaired, repair};
use nalgebra::Point3;

/// Which stored vertices are one point. Positions are compared exactly (0 and -0 are equal).
#[derive(Debug, Clone, PartialEq)]
pub struct Weld {
    /// Position of each point, in the order in which stored vertices first show it.
    pub points: Vec<Point3<f64>>,
    /// For each stored vertex the index of its point.
    pub point_of: Vec<u32>,
}

impl Weld {
    /// Groups `stored` vertices by position, in O(n log n). Vertices with a NaN stay alone.
    pub fn new(stored: &[Point3<f64>]) -> Self {
        let keys: Vec<[u64; 3]> = stored.iter().map(|p| [p.x, p.y, p.z].map(sortable)).collect();
        let mut order: Vec<u32> = (0..stored.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (keys[i as usize], i));
        // The first stored vertex of each group stands for it.
        let mut leader: Vec<u32> = (0..stored.len() as u32).collect();
        for pair in order.windows(2) {
            let (before, here) = (pair[0] as usize, pair[1] as usize);
            if keys[before] == keys[here] && stored[here].coords.iter().all(|x| !x.is_nan()) {
                leader[here] = leader[before];
            }
        }
        let mut points = Vec::new();
        let mut point_of = vec![0u32; stored.len()];
        for (i, &lead) in leader.iter().enumerate() {
            if lead as usize == i {
                point_of[i] = points.len() as u32;
                points.push(stored[i]);
            } else {
                point_of[i] = point_of[lead as usize];
            }
        }
        Self { points, point_of }
    }

    /// Corner indices of stored vertices, as corner indices of points.
    ///
    /// # Panics
    /// When a corner is not a stored vertex.
    pub fn triangles(&self, stored: &[[u32; 3]]) -> Vec<[u32; 3]> {
        stored.iter().map(|corners| corners.map(|v| self.point_of[v as usize])).collect()
    }
}

/// Joins vertices at equal positions and makes a manifold mesh of what comes: the one call for corner soup, in which every
/// triangle has three vertices of its own, and for seams. Never fails, as [`repair`](crate::repair()).
///
/// `source` of the mesh leads to the points of the [`Weld`], and its `point_of` there from the vertices of `soup`.
///
/// ```
/// use nalgebra::Point3;
/// use sombrero_mesh::{Soup, weld_and_repair};
///
/// // Two triangles as STL stores them.
/// let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
/// let soup = Soup::new(corners.map(Point3::from).to_vec(), vec![[0, 1, 2], [3, 4, 5]]);
/// let (weld, made) = weld_and_repair(&soup);
/// assert_eq!((made.mesh.vertex_count(), made.mesh.edge_count(), made.mesh.face_count()), (4, 5, 2));
/// assert_eq!(weld.point_of, [0, 1, 2, 1, 3, 2]);
/// ```
pub fn weld_and_repair(soup: &Soup) -> (Weld, Repaired) {
    let weld = Weld::new(&soup.points);
    // A corner out of range stays out of range, for repair to count.
    let point = |v: u32| weld.point_of.get(v as usize).copied().unwrap_or(u32::MAX);
    let triangles = soup.triangles.iter().map(|corners| corners.map(point)).collect();
    let repaired = repair(&Soup::new(weld.points.clone(), triangles));
    (weld, repaired)
}

/// A key that is equal for equal numbers.
fn sortable(x: f64) -> u64 {
    (x + 0.0).to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn stored_vertices_share_a_point_exactly_when_they_are_equal(
            stored in prop::collection::vec((-2i8..3, -1i8..2, 0i8..2), 0..40)
        ) {
            let points: Vec<_> =
                stored.iter().map(|&(x, y, z)| Point3::new(f64::from(x) * 0.5, -0.0 * f64::from(y), f64::from(z))).collect();
            let weld = Weld::new(&points);
            for (i, p) in points.iter().enumerate() {
                prop_assert_eq!(weld.points[weld.point_of[i] as usize], *p);
                for (j, q) in points.iter().enumerate() {
                    prop_assert_eq!(weld.point_of[i] == weld.point_of[j], p == q);
                }
            }
        }
    }

    #[test]
    fn points_keep_the_order_of_their_first_vertex() {
        let at = |x: f64| Point3::new(x, 0.0, 0.0);
        let weld = Weld::new(&[at(3.0), at(1.0), at(3.0), at(2.0), at(1.0)]);
        assert_eq!(weld.points, [at(3.0), at(1.0), at(2.0)]);
        assert_eq!(weld.point_of, [0, 1, 0, 2, 1]);
    }
}
