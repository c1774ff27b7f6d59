//! Collapses of short edges. A free vertex goes to the middle of the edge, or to the other end if that is held; one on
//! a crease goes along the crease, onto the other end; corners stay.

use super::creases::{Creases, Hold};
use super::turns;
use nalgebra::{Point3, center, distance};
use sombrero_mesh::geometry::area_vector;
use sombrero_mesh::{EdgeId, Edges, HalfedgeId, Mesh, Soup, VertexId};

/// Collapses edges shorter than `shortest` where no edge grows beyond `longest`, no face turns too far, and the
/// topology permits.
pub(super) fn collapse(soup: &mut Soup, shortest: f64, longest: f64) {
    let edges = Edges::new(soup.points.len(), &soup.triangles);
    let Creases { sharp, holds } = Creases::of(&soup.points, &soup.triangles, &edges);
    // Splits and flips leave manifolds; of anything else the faces stay.
    let Ok(mesh) = Mesh::from_triangles(soup.points.len(), &soup.triangles) else { return };
    let mut run = Run { mesh, points: std::mem::take(&mut soup.points), sharp, holds, longest };
    for edge in (0..edges.len()).map(EdgeId::new) {
        let h = edge.halfedge();
        if run.mesh.check_collapse(h).is_ok() && run.length(h) < shortest {
            let _done = run.try_collapse(h) || run.try_collapse(h.twin());
        }
    }
    *soup = Soup::new(run.points, run.mesh.triangles()).compacted().0;
}

struct Run {
    mesh: Mesh,
    points: Vec<Point3<f64>>,
    /// By edge; both number them by their ends.
    sharp: Vec<bool>,
    holds: Vec<Hold>,
    longest: f64,
}

impl Run {
    fn at(&self, v: VertexId) -> &Point3<f64> {
        &self.points[v.index()]
    }

    fn length(&self, h: HalfedgeId) -> f64 {
        distance(self.at(self.mesh.tail(h)), self.at(self.mesh.tip(h)))
    }

    fn try_collapse(&mut self, h: HalfedgeId) -> bool {
        let (u, v) = (self.mesh.tail(h), self.mesh.tip(h));
        let Some(place) = self.place(h) else { return false };
        let near = |w: VertexId| distance(self.at(w), &place) <= self.longest;
        let around = |v| self.mesh.vertices_around_vertex(v);
        let short = around(u).all(near) && around(v).all(near);
        if !short || self.turns_faces(u, v, &place) || self.turns_faces(v, u, &place) {
            return false;
        }
        let vanishing = [h, h.twin()].map(|s| [self.mesh.next(s), self.mesh.prev(s)].map(HalfedgeId::edge));
        if self.mesh.collapse(h).is_err() {
            return false;
        }
        // Two edges of a vanishing face become one, and stay a crease if one was.
        for [a, b] in vanishing {
            let either = self.sharp[a.index()] || self.sharp[b.index()];
            self.sharp[a.index()] = either;
            self.sharp[b.index()] = either;
        }
        self.points[v.index()] = place;
        true
    }

    /// Where the merged vertex goes; `None` when the tail of `h` is held.
    fn place(&self, h: HalfedgeId) -> Option<Point3<f64>> {
        let (u, v) = (self.mesh.tail(h), self.mesh.tip(h));
        match [u, v].map(|v| self.holds[v.index()]) {
            [Hold::Free, Hold::Free] => Some(center(self.at(u), self.at(v))),
            [Hold::Free, _] => Some(*self.at(v)),
            [Hold::Crease(_), Hold::Crease(_) | Hold::Corner] if self.sharp[h.edge().index()] => {
                Some(*self.at(v))
            }
            _ => None,
        }
    }

    /// Whether moving `u` to `place` turns a face around it too far, those with `other` left out.
    fn turns_faces(&self, u: VertexId, other: VertexId, place: &Point3<f64>) -> bool {
        self.mesh.faces_around_vertex(u).any(|f| {
            let corners = self.mesh.vertices_of_face(f);
            let [a, b, c] = corners.map(|v| self.at(v));
            let [x, y, z] = corners.map(|v| if v == u { place } else { self.at(v) });
            !corners.contains(&other) && turns(&area_vector(a, b, c), &area_vector(x, y, z))
        })
    }
}
