//! Halfedge connectivity of a manifold triangle mesh. Positions live elsewhere, in slices of points.
//!
//! ```text
//!            c
//!           / \             h    : a → b, with face abc on its left
//!          /   \            next : b → c      prev : c → a
//!         / face \          twin : b → a
//!        a ── h ─→ b        tail(h) = a       tip(h) = b
//! ```
//!
//! Invariants, each checked by [`Mesh::validate`]:
//!
//! 1. Twins differ in the lowest bit of their index; `next` and `prev` are inverse to each other.
//! 2. A halfedge with a face is one of exactly three in a `next` cycle, all of that face.
//! 3. Boundaries are real: a halfedge without a face lies in a `next` cycle around a boundary loop.
//! 4. The outgoing halfedges of a vertex form one cycle under `twin(prev(h))`, counter-clockwise. At a
//!    boundary vertex the stored one is the first of the fan: its twin has no face.
//! 5. No two edges join the same vertices, and no face has a vertex twice.
//!
//! Collapsed elements keep their place, marked as removed, so that a collapse can be undone exactly.

use crate::sides::{Sides, ends};
use crate::{EdgeId, FaceId, HalfedgeId, VertexId};
use thiserror::Error;

/// Connectivity of a manifold, oriented triangle mesh, with or without boundary.
///
/// Build one of clean triangles with [`Mesh::from_triangles`] and of anything else with
/// [`repair`](crate::repair::repair). Memory is about 140 bytes a vertex.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mesh {
    pub(crate) halfedges: Vec<Halfedge>,
    pub(crate) outgoing: Vec<HalfedgeId>,
    pub(crate) first: Vec<HalfedgeId>,
    pub(crate) removed: Removed,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Halfedge {
    pub(crate) next: HalfedgeId,
    pub(crate) prev: HalfedgeId,
    pub(crate) tip: VertexId,
    pub(crate) face: Left,
}

/// The face on a halfedge's left, if there is one. Four bytes instead of the eight of an `Option`, so that a
/// halfedge and its twin share half a cache line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Left(u32);

impl Left {
    pub(crate) const NONE: Self = Self(u32::MAX);

    pub(crate) fn of(face: FaceId) -> Self {
        Self(face.to_u32())
    }

    #[inline]
    pub(crate) fn face(self) -> Option<FaceId> {
        (self != Self::NONE).then(|| FaceId::from_u32(self.0))
    }
}

/// Which elements collapses have taken out, and how many of each kind.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Removed {
    pub(crate) vertices: Flags,
    pub(crate) edges: Flags,
    pub(crate) faces: Flags,
}

/// A set of indices with its size.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Flags {
    set: Vec<bool>,
    count: usize,
}

impl Flags {
    fn none_of(len: usize) -> Self {
        Self { set: vec![false; len], count: 0 }
    }

    pub(crate) fn contains(&self, index: usize) -> bool {
        self.set[index]
    }

    pub(crate) fn insert(&mut self, index: usize) {
        self.count += usize::from(!self.set[index]);
        self.set[index] = true;
    }

    pub(crate) fn take(&mut self, index: usize) {
        self.count -= usize::from(self.set[index]);
        self.set[index] = false;
    }

    fn left(&self) -> usize {
        self.set.len() - self.count
    }
}

/// Why triangles are not a manifold mesh. [`repair`](crate::repair::repair) mends every one of these.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TopologyError {
    /// A corner index is not below the number of vertices.
    #[error("face {face:?} refers to vertex {vertex}, but there are only {vertices} vertices")]
    IndexOutOfRange {
        /// The face.
        face: FaceId,
        /// The index that it holds.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A face has the same corner twice.
    #[error("face {face:?} has vertex {vertex:?} as a corner more than once")]
    DegenerateFace {
        /// The face.
        face: FaceId,
        /// The repeated corner.
        vertex: VertexId,
    },
    /// More than two faces meet at an edge, or two whose orientations disagree.
    #[error(
        "the edge between {tail:?} and {tip:?} has more than two faces, or two that are oriented differently"
    )]
    NonManifoldEdge {
        /// One end.
        tail: VertexId,
        /// The other end.
        tip: VertexId,
    },
    /// The faces around a vertex form more than one fan, or a fan of two doubled faces.
    #[error("the faces around {vertex:?} do not form a single fan")]
    NonManifoldVertex {
        /// The vertex.
        vertex: VertexId,
    },
    /// A vertex is in no face.
    #[error("vertex {vertex:?} belongs to no face")]
    UnusedVertex {
        /// The vertex.
        vertex: VertexId,
    },
}

const UNSET: HalfedgeId = HalfedgeId::MAX;

impl Mesh {
    /// Connects `triangles` over vertices `0..vertex_count`, corners counter-clockwise.
    ///
    /// Edges are numbered by (smaller vertex, larger vertex), faces as given.
    ///
    /// # Errors
    /// [`TopologyError`] when the triangles are not an oriented manifold in which every vertex is used.
    pub fn from_triangles(vertex_count: usize, triangles: &[[u32; 3]]) -> Result<Self, TopologyError> {
        check_corners(vertex_count, triangles)?;
        let mut mesh = Self::unlinked(vertex_count, triangles)?;
        mesh.link_boundaries()?;
        mesh.check_fans(vertex_count, triangles)?;
        Ok(mesh)
    }

    /// Halfedges with tips, and with `next` and `prev` inside faces.
    fn unlinked(vertex_count: usize, triangles: &[[u32; 3]]) -> Result<Self, TopologyError> {
        let sides = Sides::group(vertex_count, triangles);
        let mut of_side = vec![UNSET; 3 * triangles.len()];
        let blank = Halfedge { next: UNSET, prev: UNSET, tip: VertexId::new(0), face: Left::NONE };
        let mut halfedges = vec![blank; 2 * sides.edge_count()];
        for (e, group) in sides.groups().enumerate() {
            let h = EdgeId::new(e).halfedge();
            let (tail, tip) = ends(triangles, group[0] as usize);
            let manifold = match group {
                [_] => true,
                [_, other] => ends(triangles, *other as usize) == (tip, tail),
                _ => false,
            };
            if !manifold {
                let (tail, tip) = (VertexId::from_u32(tail), VertexId::from_u32(tip));
                return Err(TopologyError::NonManifoldEdge { tail, tip });
            }
            halfedges[h.index()].tip = VertexId::from_u32(tip);
            halfedges[h.twin().index()].tip = VertexId::from_u32(tail);
            for (&side, h) in group.iter().zip([h, h.twin()]) {
                of_side[side as usize] = h;
            }
        }
        let mut outgoing = vec![UNSET; vertex_count];
        for (f, corners) in triangles.iter().enumerate() {
            for k in 0..3 {
                let h = of_side[3 * f + k];
                outgoing[corners[k] as usize] = h;
                let record = &mut halfedges[h.index()];
                record.next = of_side[3 * f + (k + 1) % 3];
                record.prev = of_side[3 * f + (k + 2) % 3];
                record.face = Left::of(FaceId::new(f));
            }
        }
        let removed = Removed {
            vertices: Flags::none_of(vertex_count),
            edges: Flags::none_of(sides.edge_count()),
            faces: Flags::none_of(triangles.len()),
        };
        let first = of_side.into_iter().step_by(3).collect();
        Ok(Self { halfedges, outgoing, first, removed })
    }

    /// Joins the halfedges without a face into loops and makes fans start at the boundary.
    fn link_boundaries(&mut self) -> Result<(), TopologyError> {
        let mut leaving = vec![None; self.outgoing.len()];
        let boundary = || (0..self.halfedges.len()).map(HalfedgeId::new).filter(|&h| self.face(h).is_none());
        let loose: Vec<HalfedgeId> = boundary().collect();
        for &h in &loose {
            let tail = self.tail(h);
            if leaving[tail.index()].replace(h).is_some() {
                return Err(TopologyError::NonManifoldVertex { vertex: tail });
            }
        }
        for &h in &loose {
            let tip = self.tip(h);
            let next = leaving[tip.index()].ok_or(TopologyError::NonManifoldVertex { vertex: tip })?;
            self.halfedges[h.index()].next = next;
            self.halfedges[next.index()].prev = h;
            self.outgoing[tip.index()] = h.twin();
        }
        Ok(())
    }

    /// Every vertex is used, and its faces form one fan of at least three (closed) or one (open).
    fn check_fans(&self, vertex_count: usize, triangles: &[[u32; 3]]) -> Result<(), TopologyError> {
        let mut corners = vec![0usize; vertex_count];
        for &corner in triangles.iter().flatten() {
            corners[corner as usize] += 1;
        }
        for (v, &corners) in corners.iter().enumerate() {
            let vertex = VertexId::new(v);
            if corners == 0 {
                return Err(TopologyError::UnusedVertex { vertex });
            }
            let fan = self.outgoing_halfedges(vertex).filter(|&h| self.face(h).is_some()).count();
            let doubled = corners < 3 && !self.is_boundary_vertex(vertex);
            if fan != corners || doubled {
                return Err(TopologyError::NonManifoldVertex { vertex });
            }
        }
        Ok(())
    }

    /// The number of vertices, removed ones not counted.
    pub fn vertex_count(&self) -> usize {
        self.removed.vertices.left()
    }

    /// The number of edges, removed ones not counted.
    pub fn edge_count(&self) -> usize {
        self.removed.edges.left()
    }

    /// The number of faces, removed ones not counted.
    pub fn face_count(&self) -> usize {
        self.removed.faces.left()
    }

    /// The length of slices by vertex: one more than the largest index, removed vertices included.
    pub fn vertex_bound(&self) -> usize {
        self.outgoing.len()
    }

    /// The length of slices by halfedge: one more than the largest index, removed ones included.
    pub fn halfedge_bound(&self) -> usize {
        self.halfedges.len()
    }

    /// The length of slices by face: one more than the largest index, removed ones included.
    pub fn face_bound(&self) -> usize {
        self.first.len()
    }

    /// Vertices in index order.
    pub fn vertices(&self) -> impl Iterator<Item = VertexId> + '_ {
        (0..self.outgoing.len()).filter(|&v| !self.removed.vertices.contains(v)).map(VertexId::new)
    }

    /// Edges in index order.
    pub fn edges(&self) -> impl Iterator<Item = EdgeId> + '_ {
        (0..self.halfedges.len() / 2).filter(|&e| !self.removed.edges.contains(e)).map(EdgeId::new)
    }

    /// Halfedges in index order, boundary ones included.
    pub fn halfedges(&self) -> impl Iterator<Item = HalfedgeId> + '_ {
        self.edges().flat_map(|e| [e.halfedge(), e.halfedge().twin()])
    }

    /// Faces in index order.
    pub fn faces(&self) -> impl Iterator<Item = FaceId> + '_ {
        (0..self.first.len()).filter(|&f| !self.removed.faces.contains(f)).map(FaceId::new)
    }

    /// Whether a collapse has taken the vertex out.
    pub fn is_removed(&self, v: VertexId) -> bool {
        self.removed.vertices.contains(v.index())
    }

    /// The other halfedge of the same edge.
    #[inline]
    pub fn twin(&self, h: HalfedgeId) -> HalfedgeId {
        h.twin()
    }

    /// The following halfedge around the face, or along the boundary loop.
    #[inline]
    pub fn next(&self, h: HalfedgeId) -> HalfedgeId {
        self.halfedges[h.index()].next
    }

    /// The preceding halfedge around the face, or along the boundary loop.
    #[inline]
    pub fn prev(&self, h: HalfedgeId) -> HalfedgeId {
        self.halfedges[h.index()].prev
    }

    /// The vertex that the halfedge points to.
    #[inline]
    pub fn tip(&self, h: HalfedgeId) -> VertexId {
        self.halfedges[h.index()].tip
    }

    /// The vertex that the halfedge comes from.
    #[inline]
    pub fn tail(&self, h: HalfedgeId) -> VertexId {
        self.tip(h.twin())
    }

    /// The face on the left of the halfedge; `None` on the boundary.
    #[inline]
    pub fn face(&self, h: HalfedgeId) -> Option<FaceId> {
        self.halfedges[h.index()].face.face()
    }

    /// A halfedge that leaves `v`; at a boundary vertex the first of its fan, whose twin has no face.
    #[inline]
    pub fn outgoing(&self, v: VertexId) -> HalfedgeId {
        self.outgoing[v.index()]
    }

    /// The first halfedge of a face.
    #[inline]
    pub fn face_halfedge(&self, f: FaceId) -> HalfedgeId {
        self.first[f.index()]
    }

    /// Halfedges that leave `v`, counter-clockwise. At a boundary vertex the fan comes in order and the
    /// last one is the boundary halfedge.
    pub fn outgoing_halfedges(&self, v: VertexId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let first = self.outgoing(v);
        let mut at = Some(first);
        std::iter::from_fn(move || {
            let h = at?;
            let next = self.prev(h).twin();
            at = (next != first).then_some(next);
            Some(h)
        })
    }

    /// Halfedges from `h` on, around its face or along its boundary loop, until `h` comes again.
    pub fn halfedges_along(&self, h: HalfedgeId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let mut at = Some(h);
        std::iter::from_fn(move || {
            let here = at?;
            let next = self.next(here);
            at = (next != h).then_some(next);
            Some(here)
        })
    }

    /// Neighbours of `v`, counter-clockwise (its link: a closed ring, or a path at the boundary).
    pub fn vertices_around_vertex(&self, v: VertexId) -> impl Iterator<Item = VertexId> + '_ {
        self.outgoing_halfedges(v).map(|h| self.tip(h))
    }

    /// Faces around `v`, counter-clockwise.
    pub fn faces_around_vertex(&self, v: VertexId) -> impl Iterator<Item = FaceId> + '_ {
        self.outgoing_halfedges(v).filter_map(|h| self.face(h))
    }

    /// Corners of a face, counter-clockwise.
    #[inline]
    pub fn vertices_of_face(&self, f: FaceId) -> [VertexId; 3] {
        let h = self.face_halfedge(f);
        [self.tail(h), self.tip(h), self.tip(self.next(h))]
    }

    /// All faces as corner indices, in face order.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.faces().map(|f| self.vertices_of_face(f).map(VertexId::to_u32)).collect()
    }

    /// Number of edges at `v`.
    pub fn valence(&self, v: VertexId) -> usize {
        self.outgoing_halfedges(v).count()
    }

    /// Whether `v` lies on a boundary loop.
    #[inline]
    pub fn is_boundary_vertex(&self, v: VertexId) -> bool {
        self.face(self.outgoing(v).twin()).is_none()
    }

    /// Whether one of the edge's sides has no face.
    #[inline]
    pub fn is_boundary_edge(&self, e: EdgeId) -> bool {
        self.face(e.halfedge()).is_none() || self.face(e.halfedge().twin()).is_none()
    }

    /// The halfedge from `tail` to `tip`, if they are neighbours.
    pub fn halfedge_between(&self, tail: VertexId, tip: VertexId) -> Option<HalfedgeId> {
        self.outgoing_halfedges(tail).find(|&h| self.tip(h) == tip)
    }
}

fn check_corners(vertex_count: usize, triangles: &[[u32; 3]]) -> Result<(), TopologyError> {
    for (f, &[a, b, c]) in triangles.iter().enumerate() {
        let face = FaceId::new(f);
        if let Some(&vertex) = [a, b, c].iter().find(|&&v| v as usize >= vertex_count) {
            return Err(TopologyError::IndexOutOfRange { face, vertex, vertices: vertex_count });
        }
        let repeated = if a == b || a == c { Some(a) } else { (b == c).then_some(b) };
        if let Some(vertex) = repeated.map(VertexId::from_u32) {
            return Err(TopologyError::DegenerateFace { face, vertex });
        }
    }
    Ok(())
}
