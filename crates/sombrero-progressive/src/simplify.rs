//! Simplification by full edge collapses, the merged vertex at the quadric optimum (Garland and Heckbert 1997).
//!
//! With Q = Q_u + Q_v (area-weighted planes of the swallowed faces, and planes that hold boundaries), the
//! merged vertex x minimises Q(x) + λ tr(A)/3 |x - midpoint|², where a small λ decides in flat regions:
//!
//!   (A + λ tr(A)/3 I) (x - midpoint) = -(A midpoint + b).
//!
//! Cheapest edge first; collapses that break the link condition or turn a face are passed over.

use crate::quadric::{Quadric, vertex_quadrics};
use nalgebra::{Matrix3, Point3, Vector3};
use sombrero_mesh::geometry::area_vector;
use sombrero_mesh::{BoundingBox, EdgeId, HalfedgeId, Mesh, Soup, VertexId, repair};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// λ: how strongly an undetermined optimum is drawn to the midpoint.
const TOWARDS_MIDPOINT: f64 = 1e-4;

/// Collapses edges until at most `ratio` times the faces are left, or no more edge can be collapsed.
///
/// The vertices of the result are new: none needs to stand where one stood before. `ratio` is a fraction of the faces that
/// [`repair`](sombrero_mesh::repair()) finds usable.
pub fn simplify(soup: &Soup, ratio: f64) -> Soup {
    let made = repair(soup);
    // Quadrics of coordinates far from the origin lose their digits.
    let origin =
        BoundingBox::of(&made.points).map_or_else(Point3::origin, |b| nalgebra::center(&b.min, &b.max));
    let points = made.points.iter().map(|p| Point3::from(p - origin)).collect();
    let target = (ratio * made.mesh.face_count() as f64).floor() as usize;
    let mut run = Run::new(made.mesh, points);
    run.until(target);
    let moved_back = run.points.iter().map(|p| p + origin.coords).collect();
    Soup::new(moved_back, run.mesh.triangles()).compacted().0
}

struct Run {
    mesh: Mesh,
    points: Vec<Point3<f64>>,
    quadrics: Vec<Quadric>,
    queue: BinaryHeap<Reverse<Candidate>>,
    /// Raised whenever a vertex moves: older entries of the queue are void.
    version: Vec<u32>,
}

/// An edge to collapse; ordered by cost, then by index.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    /// Bits of a non-negative number, which order as the numbers do.
    cost: u64,
    edge: EdgeId,
    versions: [u32; 2],
}

impl Run {
    fn new(mesh: Mesh, points: Vec<Point3<f64>>) -> Self {
        let quadrics = vertex_quadrics(&mesh, &points);
        let version = vec![0; mesh.vertex_bound()];
        let mut run = Self { mesh, points, quadrics, queue: BinaryHeap::new(), version };
        let edges: Vec<EdgeId> = run.mesh.edges().collect();
        edges.into_iter().for_each(|e| run.enqueue(e));
        run
    }

    fn until(&mut self, target: usize) {
        while self.mesh.face_count() > target
            && let Some(Reverse(candidate)) = self.queue.pop()
        {
            let h = candidate.edge.halfedge();
            if self.is_current(&candidate) {
                self.collapse(self.inwards(h));
            }
        }
    }

    /// An edge that is still there and whose ends have not moved since it was queued.
    fn is_current(&self, candidate: &Candidate) -> bool {
        let h = candidate.edge.halfedge();
        let gone = self.mesh.check_collapse(h).is_err();
        !gone && candidate.versions == self.versions(h)
    }

    fn versions(&self, h: HalfedgeId) -> [u32; 2] {
        [self.mesh.tail(h), self.mesh.tip(h)].map(|v| self.version[v.index()])
    }

    /// The direction in which a boundary vertex stays.
    fn inwards(&self, h: HalfedgeId) -> HalfedgeId {
        if self.mesh.is_boundary_vertex(self.mesh.tail(h)) { h.twin() } else { h }
    }

    fn collapse(&mut self, h: HalfedgeId) {
        let (u, v) = (self.mesh.tail(h), self.mesh.tip(h));
        let (place, _) = self.optimum(u, v);
        let turns = |a, b| !self.keeps_normals(a, b, &place);
        if turns(u, v) || turns(v, u) || self.mesh.collapse(h).is_err() {
            return;
        }
        let swallowed = self.quadrics[u.index()];
        self.quadrics[v.index()] += swallowed;
        self.points[v.index()] = place;
        self.version[v.index()] += 1;
        let edges: Vec<EdgeId> = self.mesh.outgoing_halfedges(v).map(HalfedgeId::edge).collect();
        edges.into_iter().for_each(|e| self.enqueue(e));
    }

    fn enqueue(&mut self, edge: EdgeId) {
        let h = edge.halfedge();
        let (_, cost) = self.optimum(self.mesh.tail(h), self.mesh.tip(h));
        let versions = self.versions(h);
        self.queue.push(Reverse(Candidate { cost: cost.max(0.0).to_bits(), edge, versions }));
    }

    /// Where the merged vertex goes, and its error there.
    fn optimum(&self, u: VertexId, v: VertexId) -> (Point3<f64>, f64) {
        let mut quadric = self.quadrics[u.index()];
        quadric += self.quadrics[v.index()];
        let midpoint = nalgebra::center(&self.points[u.index()], &self.points[v.index()]);
        let (a, b) = quadric.normal_equations();
        let pull = Matrix3::from_diagonal_element(TOWARDS_MIDPOINT * a.trace() / 3.0);
        let solved = (a + pull).cholesky().map(|c| c.solve(&-(a * midpoint.coords + b)));
        let place =
            midpoint + solved.filter(|x| x.iter().all(|x| x.is_finite())).unwrap_or_else(Vector3::zeros);
        (place, quadric.at(&place))
    }

    /// Whether moving `u` to `place` turns no face around it, those with `other` left out.
    fn keeps_normals(&self, u: VertexId, other: VertexId, place: &Point3<f64>) -> bool {
        let at = |v: VertexId| &self.points[v.index()];
        self.mesh.faces_around_vertex(u).all(|f| {
            let corners = self.mesh.vertices_of_face(f);
            if corners.contains(&other) {
                return true;
            }
            let [a, b, c] = corners.map(at);
            let [x, y, z] = corners.map(|v| if v == u { place } else { at(v) });
            area_vector(a, b, c).dot(&area_vector(x, y, z)) > 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::topology;
    use sombrero_shapes as shapes;

    #[test]
    fn a_sphere_stays_a_sphere() {
        let sphere = shapes::sphere(4);
        let half = simplify(&sphere, 0.125);
        assert_eq!(half.triangles.len(), sphere.triangles.len() / 8);
        let made = repair(&half);
        assert!(made.report.is_clean());
        assert_eq!(topology::genus(&made.mesh), Some(0));
        assert!(half.points.iter().all(|p| (p.coords.norm() - 1.0).abs() < 0.02));
    }

    #[test]
    fn flat_faces_of_a_part_lose_their_vertices_and_not_their_shape() {
        let part = shapes::part(6);
        let made = repair(&part);
        let volume = |soup: &Soup| {
            let made = repair(soup);
            sombrero_mesh::geometry::volume(&made.mesh, &made.points)
        };
        let less = simplify(&part, 0.5);
        assert!((volume(&less) / volume(&part) - 1.0).abs() < 2e-3);
        assert_eq!(topology::genus(&repair(&less).mesh), topology::genus(&made.mesh));
    }

    #[test]
    fn the_rim_of_a_sheet_stays() {
        let sheet = shapes::open_sheet(12, 12);
        let less = simplify(&sheet, 0.2);
        let (before, after) = (sheet.bounding_box().unwrap(), less.bounding_box().unwrap());
        assert!((before.sides() - after.sides()).amax() < 0.02 * before.largest_side());
        assert_eq!(topology::boundary_loops(&repair(&less).mesh).len(), 1);
    }

    #[test]
    fn nothing_smaller_than_the_smallest_surface() {
        assert_eq!(simplify(&shapes::sphere(1), 0.0).triangles.len(), 4);
    }
}
