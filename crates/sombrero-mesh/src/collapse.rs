//! Edge collapse and its exact undo.
//!
//! Collapsing h: u → v moves u into v; the edges u-a and u-b merge into v-a and v-b.
//!
//! ```text
//!            a                          a
//!          / | \                        |
//!         /  |  \                       |
//!        / hp|hn \        collapse      |
//!      ..  u─h→v  ..     ─────────→    v
//!        \ gn|gp /         undo         |
//!         \  |  /        ←─────────     |
//!          \ | /                        |
//!            b                          b
//! ```
//!
//! (hn: v → a and hp: a → u follow h around the left face; gn: u → b and gp: b → v follow its twin g
//! around the right one.) hn and gp stay and take over the places of the twins of hp and gn; u, both
//! faces and the edges of h, hp and gn are marked as removed but keep their links, which is what makes
//! the undo exact. A vertex split of a progressive mesh is this undo.

use crate::mesh::Halfedge;
use crate::{HalfedgeId, Mesh, VertexId};
use thiserror::Error;

/// What a collapse did, for [`Mesh::undo_collapse`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Collapse {
    /// The collapsed halfedge, from the removed vertex to the kept one.
    pub halfedge: HalfedgeId,
    /// The vertex that the collapse removed: the tail of `halfedge` before.
    pub removed: VertexId,
    /// The vertex that it was moved into: the tip of `halfedge`.
    pub kept: VertexId,
    kept_outgoing: HalfedgeId,
    left_moved: bool,
    right_moved: bool,
}

/// Hardly a vertex has more neighbours.
const RING: usize = 16;

/// Why an edge cannot be collapsed without leaving the manifold or changing its topology.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CollapseError {
    /// An earlier collapse removed the halfedge.
    #[error("halfedge {halfedge:?} was removed by an earlier collapse")]
    Removed {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
    /// The ends share a neighbour that is not opposite to the edge, so the collapse would pinch the surface.
    #[error("collapsing {halfedge:?} would pinch the surface at {vertex:?} (link condition)")]
    Link {
        /// The halfedge.
        halfedge: HalfedgeId,
        /// The shared neighbour.
        vertex: VertexId,
    },
    /// Both ends lie on the boundary but the edge does not.
    #[error("collapsing {halfedge:?} would join two boundary vertices through the inside")]
    Boundary {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
    /// The component is a single triangle or a tetrahedron and cannot get smaller.
    #[error("collapsing {halfedge:?} would flatten a component that has no smaller form")]
    Smallest {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
}

/// The two edges that become one where a face vanishes.
struct Merge {
    /// The collapsed halfedge, or its twin, in the vanishing face.
    inner: HalfedgeId,
    /// The side of that face on the edge that vanishes with it.
    gone: HalfedgeId,
    /// The side that stays.
    kept: HalfedgeId,
    /// The halfedge on the vanishing edge that leaves the opposite vertex.
    leaving: HalfedgeId,
    /// The halfedge on the staying edge that leaves the opposite vertex.
    stays: HalfedgeId,
}

impl Merge {
    fn left(mesh: &Mesh, h: HalfedgeId) -> Self {
        let (gone, kept) = (mesh.prev(h), mesh.next(h));
        Self { inner: h, gone, kept, leaving: gone, stays: kept.twin() }
    }

    fn right(mesh: &Mesh, g: HalfedgeId) -> Self {
        let (gone, kept) = (mesh.next(g), mesh.prev(g));
        Self { inner: g, gone, kept, leaving: gone.twin(), stays: kept }
    }
}

impl Mesh {
    /// Whether `h` may be collapsed: the link condition, for closed and open meshes.
    ///
    /// # Errors
    /// The [`CollapseError`] that [`Mesh::collapse`] would return.
    pub fn check_collapse(&self, h: HalfedgeId) -> Result<(), CollapseError> {
        let halfedge = h;
        if self.removed.edges.contains(h.edge().index()) {
            return Err(CollapseError::Removed { halfedge });
        }
        let (u, v) = (self.tail(h), self.tip(h));
        let opposite = [h, h.twin()].map(|s| self.face(s).map(|_| self.tail(self.prev(s))));
        let interior_edge = opposite.iter().all(Option::is_some);
        if interior_edge && self.is_boundary_vertex(u) && self.is_boundary_vertex(v) {
            return Err(CollapseError::Boundary { halfedge });
        }
        let lone = |s: HalfedgeId| {
            self.face(s).is_some()
                && [self.prev(s), self.next(s)].iter().all(|t| self.face(t.twin()).is_none())
        };
        let tetrahedron = || interior_edge && self.has_three_faces(u) && self.has_three_faces(v);
        if lone(h) || lone(h.twin()) || tetrahedron() {
            return Err(CollapseError::Smallest { halfedge });
        }
        // The neighbours of v, side by side as far as there is room: each neighbour of u is compared with all of them.
        let (mut ring, mut count) = ([v; RING], 0);
        for (place, y) in ring.iter_mut().zip(self.vertices_around_vertex(v)) {
            *place = y;
            count += 1;
        }
        let beyond = |x: &VertexId| self.vertices_around_vertex(v).skip(RING).any(|y| y == *x);
        let shared = |x: &VertexId| ring[..count].contains(x) || count == RING && beyond(x);
        let pinch =
            self.vertices_around_vertex(u).find(|x| *x != v && !opposite.contains(&Some(*x)) && shared(x));
        pinch.map_or(Ok(()), |vertex| Err(CollapseError::Link { halfedge, vertex }))
    }

    fn has_three_faces(&self, v: VertexId) -> bool {
        !self.is_boundary_vertex(v) && self.valence(v) == 3
    }

    /// Moves the tail of `h` into its tip. Positions are the caller's to change.
    ///
    /// # Errors
    /// [`CollapseError`] when the result would not be a manifold of the same topology; the mesh is then
    /// unchanged.
    pub fn collapse(&mut self, h: HalfedgeId) -> Result<Collapse, CollapseError> {
        self.check_collapse(h)?;
        Ok(self.collapse_allowed(h))
    }

    /// [`collapse`](Self::collapse) without asking again, for a halfedge that [`check_collapse`](Self::check_collapse)
    /// allows. On any other the mesh may break (never memory safety); [`validate`](Mesh::validate) tells.
    pub fn collapse_allowed(&mut self, h: HalfedgeId) -> Collapse {
        let g = h.twin();
        let (u, v) = (self.tail(h), self.tip(h));
        let (left, right) = (self.face(h), self.face(g));
        let open = self.is_boundary_vertex(u) || self.is_boundary_vertex(v);
        let kept_outgoing = self.outgoing(v);

        self.point_incoming(u, v);
        let left_moved = match left {
            Some(_) => self.merge(Merge::left(self, h)),
            None => self.bypass(h),
        };
        let right_moved = match right {
            Some(_) => self.merge(Merge::right(self, g)),
            None => self.bypass(g),
        };
        self.removed.vertices.insert(u.index());
        self.removed.edges.insert(h.edge().index());
        for face in [left, right].into_iter().flatten() {
            self.removed.faces.insert(face.index());
        }
        if kept_outgoing == g {
            self.outgoing[v.index()] = if left.is_some() { self.next(h) } else { self.prev(g).twin() };
        }
        if open {
            self.restart_fan(v);
        }
        Collapse { halfedge: h, removed: u, kept: v, kept_outgoing, left_moved, right_moved }
    }

    /// Takes back the latest collapse that has not been taken back: the vertex split.
    ///
    /// Collapses must be undone in reverse order. Any other order leaves a broken mesh (never unsound
    /// memory); [`validate`](Mesh::validate) tells.
    pub fn undo_collapse(&mut self, collapse: &Collapse) {
        let h = collapse.halfedge;
        let g = h.twin();
        let (u, v) = (collapse.removed, collapse.kept);
        let (left, right) = (self.face(h), self.face(g));
        for face in [left, right].into_iter().flatten() {
            self.removed.faces.take(face.index());
        }
        self.removed.edges.take(h.edge().index());
        self.removed.vertices.take(u.index());
        self.outgoing[v.index()] = collapse.kept_outgoing;
        match right {
            Some(_) => self.part(Merge::right(self, g), collapse.right_moved),
            None => self.rejoin(g),
        }
        match left {
            Some(_) => self.part(Merge::left(self, h), collapse.left_moved),
            None => self.rejoin(h),
        }
        self.point_incoming(u, u);
    }

    /// Lets every halfedge that enters `v` point to `to`.
    fn point_incoming(&mut self, v: VertexId, to: VertexId) {
        let first = self.outgoing(v);
        let mut h = first;
        loop {
            self.halfedges[h.twin().index()].tip = to;
            h = self.prev(h).twin();
            if h == first {
                break;
            }
        }
    }

    /// Lets `kept` take over the place of `gone`'s twin, and removes the edge of `gone`. Tells whether the
    /// opposite vertex had its outgoing halfedge on the removed edge.
    fn merge(&mut self, Merge { gone, kept, leaving, stays, .. }: Merge) -> bool {
        let outer = gone.twin();
        let place = self.halfedges[outer.index()];
        self.halfedges[kept.index()].next = place.next;
        self.halfedges[kept.index()].prev = place.prev;
        self.halfedges[kept.index()].face = place.face;
        self.halfedges[place.next.index()].prev = kept;
        self.halfedges[place.prev.index()].next = kept;
        if let Some(face) = place.face.face().filter(|f| self.first[f.index()] == outer) {
            self.first[face.index()] = kept;
        }
        self.removed.edges.insert(gone.edge().index());
        let opposite = self.tail(stays);
        let moved = self.outgoing(opposite) == leaving;
        if moved {
            self.outgoing[opposite.index()] = stays;
        }
        moved
    }

    /// Inverse of [`merge`](Self::merge).
    fn part(&mut self, Merge { inner, gone, kept, leaving, stays, .. }: Merge, moved: bool) {
        let outer = gone.twin();
        let place = self.halfedges[outer.index()];
        if moved {
            let opposite = self.tail(stays);
            self.outgoing[opposite.index()] = leaving;
        }
        if let Some(face) = place.face.face().filter(|f| self.first[f.index()] == kept) {
            self.first[face.index()] = outer;
        }
        self.halfedges[place.next.index()].prev = outer;
        self.halfedges[place.prev.index()].next = outer;
        let Halfedge { next, face, .. } = self.halfedges[inner.index()];
        let (next, prev) = if next == kept { (gone, inner) } else { (inner, gone) };
        self.halfedges[kept.index()].next = next;
        self.halfedges[kept.index()].prev = prev;
        self.halfedges[kept.index()].face = face;
        self.removed.edges.take(gone.edge().index());
    }

    /// Takes a boundary halfedge out of its loop.
    fn bypass(&mut self, h: HalfedgeId) -> bool {
        let (prev, next) = (self.prev(h), self.next(h));
        self.halfedges[prev.index()].next = next;
        self.halfedges[next.index()].prev = prev;
        false
    }

    /// Puts a boundary halfedge back into its loop.
    fn rejoin(&mut self, h: HalfedgeId) {
        let (prev, next) = (self.prev(h), self.next(h));
        self.halfedges[prev.index()].next = h;
        self.halfedges[next.index()].prev = h;
    }

    /// Makes the fan of a boundary vertex start at the boundary (invariant 4).
    fn restart_fan(&mut self, v: VertexId) {
        let start = self.outgoing_halfedges(v).find(|h| self.face(h.twin()).is_none());
        if let Some(h) = start {
            self.outgoing[v.index()] = h;
        }
    }
}
