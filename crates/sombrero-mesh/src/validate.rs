//! Checks every invariant of [`Mesh`] that its module lists.

use crate::{EdgeId, HalfedgeId, Mesh, VertexId};
use thiserror::Error;

/// An invariant of [`Mesh`] that does not hold.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Violation {
    /// `next` and `prev` are not inverse to each other, or lead to a removed edge, at this halfedge.
    #[error("next and prev do not agree at {halfedge:?}")]
    Links {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
    /// The halfedge's cycle is not a triangle of its face, or joins different faces or vertices.
    #[error("the cycle of {halfedge:?} is not that of one face or boundary loop")]
    Cycle {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
    /// Both sides of an edge are boundary, or it joins a vertex with itself.
    #[error("edge {edge:?} has no face or only one end")]
    Edge {
        /// The edge.
        edge: EdgeId,
    },
    /// The stored outgoing halfedge does not leave the vertex, or does not start its fan.
    #[error("the outgoing halfedge of {vertex:?} is not the first of its fan")]
    Fan {
        /// The vertex.
        vertex: VertexId,
    },
    /// The fan misses halfedges that leave the vertex, or it has the same neighbour twice.
    #[error("the fan of {vertex:?} is incomplete or has a neighbour twice")]
    Neighbours {
        /// The vertex.
        vertex: VertexId,
    },
    /// The numbers of vertices, edges and faces do not match their incidences.
    #[error("the element counts do not match")]
    Counts,
}

impl Mesh {
    /// Checks all invariants; meant for tests, costs about as much as building the mesh.
    ///
    /// # Errors
    /// The first [`Violation`] in index order.
    pub fn validate(&self) -> Result<(), Violation> {
        self.halfedges().try_for_each(|h| self.validate_halfedge(h))?;
        self.edges().try_for_each(|e| self.validate_edge(e))?;
        self.validate_fans()?;
        let sides = self.halfedges().filter(|&h| self.face(h).is_some()).count();
        let faces = self.faces().filter(|&f| self.face(self.face_halfedge(f)) == Some(f)).count();
        let counted = (self.vertices().count(), self.edges().count(), self.faces().count());
        let stored = (self.vertex_count(), self.edge_count(), self.face_count());
        let agree = sides == 3 * faces && faces == self.face_count() && counted == stored;
        if agree { Ok(()) } else { Err(Violation::Counts) }
    }

    fn validate_halfedge(&self, h: HalfedgeId) -> Result<(), Violation> {
        let (next, prev) = (self.next(h), self.prev(h));
        let live = |h: HalfedgeId| !self.removed.edges.contains(h.edge().index());
        if !live(next) || !live(prev) || self.prev(next) != h || self.next(prev) != h {
            return Err(Violation::Links { halfedge: h });
        }
        let one_face = self.face(next) == self.face(h);
        let joined = self.tail(next) == self.tip(h);
        let triangle = self.face(h).is_none() || self.next(self.next(next)) == h;
        let kept = self.face(h).is_none_or(|f| !self.removed.faces.contains(f.index()));
        if one_face && joined && triangle && kept { Ok(()) } else { Err(Violation::Cycle { halfedge: h }) }
    }

    fn validate_edge(&self, edge: EdgeId) -> Result<(), Violation> {
        let h = edge.halfedge();
        let dangling = self.face(h).is_none() && self.face(h.twin()).is_none();
        if dangling || self.tip(h) == self.tail(h) { Err(Violation::Edge { edge }) } else { Ok(()) }
    }

    fn validate_fans(&self) -> Result<(), Violation> {
        let mut leaving = vec![0usize; self.vertex_bound()];
        let mut open = vec![false; self.vertex_bound()];
        for h in self.halfedges() {
            let tail = self.tail(h).index();
            leaving[tail] += 1;
            open[tail] |= self.face(h.twin()).is_none();
        }
        for vertex in self.vertices() {
            let first = self.outgoing(vertex);
            if self.tail(first) != vertex || open[vertex.index()] != self.is_boundary_vertex(vertex) {
                return Err(Violation::Fan { vertex });
            }
            let mut ring: Vec<_> =
                self.vertices_around_vertex(vertex).take(leaving[vertex.index()] + 1).collect();
            ring.sort_unstable();
            ring.dedup();
            if ring.len() != leaving[vertex.index()] {
                return Err(Violation::Neighbours { vertex });
            }
        }
        Ok(())
    }
}
