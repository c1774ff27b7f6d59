//! The support of a basis function: the part of the full mesh around its centre (the paper, section 3,
//! figure 2b to d).
//!
//! The centre of split i is the vertex v that it introduces, and the boundary is v's ring at that level,
//! tracked through all later splits. A halfedge keeps its identity through splits and each end of it
//! follows whichever of the two vertices it is still joined to, so there is only one thing to do: where
//! consecutive halfedges of the loop no longer meet, the edge between the two vertices joins them.
//!
//! ```text
//!       x    y              x    y                x    y
//!        \  /                \  /                 |    |
//!         a          →        a       or          u────a      (u is new)
//!      loop x-a-y             u inside or outside    loop x-u-a-y
//! ```
//!
//! At the mesh's own boundary the ring is a path between two boundary vertices, and what must hold is that
//! it still ends on the boundary.
//!
//! The support is what can be reached from the centre without crossing the loop. A vertex older than the
//! centre can end up inside the loop (when both of its loop edges follow a new vertex); it counts as
//! boundary. This makes a basis function vanish on every vertex that is older than its centre, and that
//! is what the theorem of completeness and independence rests on (see [`Basis`](crate::Basis)).

use nalgebra::Point3;
use sombrero_mesh::{HalfedgeId, Mesh, VertexId};
use sombrero_progress::Progress;
use sombrero_progressive::{Magnitude, ProgressiveMesh, magnitude};

/// The tracked boundary of one basis function, on the full mesh.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outline {
    /// The vertex that the split introduced.
    pub(crate) centre: VertexId,
    /// The split, counted in order of refinement.
    pub(crate) split: usize,
    /// How far its vertex stands out, and where to.
    pub(crate) magnitude: Magnitude,
    /// The loop's vertices in order. When `closed` is false it is a path whose ends lie on the mesh's
    /// boundary.
    pub(crate) vertices: Vec<VertexId>,
    /// Whether the last vertex is joined to the first by a mesh edge.
    pub(crate) closed: bool,
}

/// Tracks the boundaries of the given splits (in any order) to the full mesh. Leaves `progressive` there.
///
/// The result has the order of `splits`. `progress` takes a step for each level on the way up.
pub(crate) fn outlines(
    progressive: &mut ProgressiveMesh,
    points: &[Point3<f64>],
    splits: &[usize],
    progress: &Progress,
) -> Vec<Outline> {
    let mut by_age: Vec<usize> = (0..splits.len()).collect();
    by_age.sort_by_key(|&i| splits[i]);
    let first = splits.iter().min().map_or(usize::MAX, |&first| first);
    progressive.go_to(first);
    progress.advance(progressive.level());

    let mut tracker = Tracker::new(progressive.mesh().vertex_bound());
    let mut due = by_age.iter().copied().peekable();
    let mut found: Vec<Option<Loop>> = vec![None; splits.len()];
    loop {
        let level = progressive.level();
        let Some(split) = progressive.refine() else { break };
        tracker.follow(progressive.mesh(), split.vertex, split.parent, split.halfedge);
        progress.advance(1);
        while let Some(i) = due.next_if(|&i| splits[i] == level) {
            found[i] = Some(tracker.start(progressive.mesh(), points, split.vertex));
        }
    }
    let outline = |(found, &split): (Option<Loop>, &usize)| {
        found.map(|Loop { centre, magnitude, first, closed }| {
            let vertices = tracker.vertices(progressive.mesh(), first);
            Outline { centre, split, magnitude, vertices, closed }
        })
    };
    found.into_iter().zip(splits).filter_map(outline).collect()
}

/// All loops under way, as circular linked lists of halfedges.
struct Tracker {
    nodes: Vec<Node>,
    /// For each vertex the nodes that start at it: the places where a loop passes through.
    passing: Vec<Vec<u32>>,
}

/// One step of a loop.
#[derive(Clone, Copy)]
struct Node {
    /// From this node's vertex to the next node's; `None` closes a path outside the mesh.
    halfedge: Option<HalfedgeId>,
    next: u32,
    prev: u32,
}

#[derive(Clone, Copy)]
struct Loop {
    centre: VertexId,
    magnitude: Magnitude,
    first: u32,
    closed: bool,
}

impl Tracker {
    fn new(vertex_bound: usize) -> Self {
        Self { nodes: Vec::new(), passing: vec![Vec::new(); vertex_bound] }
    }

    /// Starts a loop at the ring of `centre`.
    fn start(&mut self, mesh: &Mesh, points: &[Point3<f64>], centre: VertexId) -> Loop {
        let spokes = mesh.outgoing_halfedges(centre).filter(|&h| mesh.face(h).is_some());
        let closed = !mesh.is_boundary_vertex(centre);
        let mut steps: Vec<Option<HalfedgeId>> = spokes.map(|h| Some(mesh.next(h))).collect();
        let mut starts: Vec<VertexId> = steps.iter().flatten().map(|&h| mesh.tail(h)).collect();
        if !closed {
            starts.extend(steps.last().copied().flatten().map(|h| mesh.tip(h)));
            steps.push(None);
        }
        let (first, count) = (self.nodes.len() as u32, steps.len() as u32);
        for (i, (halfedge, start)) in (0u32..).zip(steps.into_iter().zip(starts)) {
            let (next, prev) = (first + (i + 1) % count, first + (i + count - 1) % count);
            self.nodes.push(Node { halfedge, next, prev });
            self.passing[start.index()].push(first + i);
        }
        Loop { centre, magnitude: magnitude(mesh, points, centre), first, closed }
    }

    /// Mends all loops through `parent` after a split of it has introduced `new`; `h` runs new → parent.
    fn follow(&mut self, mesh: &Mesh, new: VertexId, parent: VertexId, h: HalfedgeId) {
        let passing = std::mem::take(&mut self.passing[parent.index()]);
        for node in passing {
            let prev = self.nodes[node as usize].prev;
            let arrives = self.nodes[prev as usize].halfedge.map(|h| mesh.tip(h));
            let leaves = self.nodes[node as usize].halfedge.map(|h| mesh.tail(h));
            // Where a path ends, it may end at either vertex that is on the mesh's boundary.
            let on_boundary = |v: VertexId| if mesh.is_boundary_vertex(v) { v } else { parent };
            let (arrives, leaves) = match (arrives, leaves) {
                (Some(a), Some(b)) => (a, b),
                (Some(a), None) => (a, on_boundary(a)),
                (None, Some(b)) => (on_boundary(b), b),
                (None, None) => (parent, parent),
            };
            self.passing[leaves.index()].push(node);
            if arrives != leaves {
                let bridge = if arrives == new { h } else { h.twin() };
                let inserted = self.insert_before(node, bridge);
                self.passing[arrives.index()].push(inserted);
            }
        }
    }

    fn insert_before(&mut self, node: u32, halfedge: HalfedgeId) -> u32 {
        let inserted = self.nodes.len() as u32;
        let prev = std::mem::replace(&mut self.nodes[node as usize].prev, inserted);
        self.nodes[prev as usize].next = inserted;
        self.nodes.push(Node { halfedge: Some(halfedge), next: node, prev });
        inserted
    }

    /// The vertices of a loop in order, from its first node; a path from its first end to its last.
    fn vertices(&self, mesh: &Mesh, first: u32) -> Vec<VertexId> {
        // A bridge may have been inserted before the first node of a path: start after the closing node.
        let start = self.cycle(first).find(|&i| self.nodes[i as usize].halfedge.is_none());
        let start = start.map_or(first, |closing| self.nodes[closing as usize].next);
        let steps: Vec<Option<HalfedgeId>> =
            self.cycle(start).map(|i| self.nodes[i as usize].halfedge).collect();
        let last = |i: usize| steps[i - 1].map(|h| mesh.tip(h));
        (0..steps.len()).filter_map(|i| steps[i].map(|h| mesh.tail(h)).or_else(|| last(i))).collect()
    }

    fn cycle(&self, first: u32) -> impl Iterator<Item = u32> + '_ {
        let mut at = Some(first);
        std::iter::from_fn(move || {
            let here = at?;
            let next = self.nodes[here as usize].next;
            at = (next != first).then_some(next);
            Some(here)
        })
    }
}

/// The inside and the boundary of a support, on the full mesh, and the edges between them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Support {
    /// Vertices strictly inside, the centre first, in the order in which a breadth-first search finds them.
    pub(crate) interior: Vec<VertexId>,
    /// Vertices next to the inside that bound it: loop vertices, and vertices older than the centre.
    pub(crate) boundary: Vec<VertexId>,
    /// The edges inside, both ways.
    pub(crate) edges: Edges,
    /// The shortest edge from each interior vertex to the boundary, infinite where there is none.
    pub(crate) to_boundary: Vec<f64>,
}

/// Edges that leave vertices `0..n`, with their lengths.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Edges {
    /// Where those of each vertex end.
    pub(crate) ends: Vec<usize>,
    /// Where each leads, and its length.
    pub(crate) all: Vec<(u32, f64)>,
}

/// Where each vertex of the mesh stands in the support that is being filled: its place in the interior, or one of the
/// constants below. Kept from one support to the next to spare the allocation; `NOWHERE` throughout between them.
pub(crate) struct Places(Vec<u32>);

/// Not seen yet, or not part of the support.
const NOWHERE: u32 = u32::MAX;
/// Not seen yet, and on the loop.
const ON_LOOP: u32 = u32::MAX - 1;
/// Seen, and part of the boundary.
const BOUNDARY: u32 = u32::MAX - 2;

impl Places {
    /// For meshes of up to `vertex_bound` vertices.
    pub(crate) fn new(vertex_bound: usize) -> Self {
        Self(vec![NOWHERE; vertex_bound])
    }
}

impl Support {
    /// Fills `outline` from its centre. `points` are those of the full mesh; `age[v]` is 0 for base vertices, else
    /// one more than the number of the split that introduced v.
    pub(crate) fn fill(
        mesh: &Mesh,
        points: &[Point3<f64>],
        age: &[u32],
        outline: &Outline,
        places: &mut Places,
    ) -> Self {
        let place = &mut places.0;
        outline.vertices.iter().for_each(|v| place[v.index()] = ON_LOOP);
        place[outline.centre.index()] = 0;
        let born = age[outline.centre.index()];
        let (mut interior, mut boundary) = (vec![outline.centre], Vec::new());
        let (mut edges, mut to_boundary) = (Edges::default(), Vec::new());
        while let Some(&v) = interior.get(to_boundary.len()) {
            let mut shortest = f64::INFINITY;
            for w in mesh.vertices_around_vertex(v) {
                let (at, length) = (&mut place[w.index()], (points[w.index()] - points[v.index()]).norm());
                if *at == ON_LOOP || *at == NOWHERE && age[w.index()] < born {
                    boundary.push(w);
                    *at = BOUNDARY;
                } else if *at == NOWHERE {
                    *at = interior.len() as u32;
                    interior.push(w);
                }
                if *at == BOUNDARY {
                    shortest = shortest.min(length);
                } else {
                    edges.all.push((*at, length));
                }
            }
            edges.ends.push(edges.all.len());
            to_boundary.push(shortest);
        }
        for v in interior.iter().chain(&boundary).chain(&outline.vertices) {
            place[v.index()] = NOWHERE;
        }
        Self { interior, boundary, edges, to_boundary }
    }
}
