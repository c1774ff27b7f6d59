//! Converts a mesh to a progressive mesh: greedy restricted edge collapses (the paper, section 3).
//!
//! A collapse u → v costs Q_u(v) + Q_v(v) + λ A_u |u - v|², where Q gathers the area-weighted planes of
//! the faces that a vertex has swallowed (and, along boundaries, planes that stand on the boundary edges),
//! A_u is their area and λ is small: it decides in flat regions, where all errors are zero, and makes
//! them shrink evenly. The cheapest collapse that is allowed goes first; ties go to the smaller index.
//!
//! Allowed is what keeps the topology (the link condition), leaves boundary vertices on their boundary
//! and turns no face by more than 45 degrees. When nothing more is allowed, the last condition is dropped,
//! so that the base is the smallest mesh that the topology permits; the level where this happens is kept,
//! because below it the mesh no longer has the shape of the original.
//!
//! Cost: O(n log n) for meshes of bounded valence.

use crate::quadric::{Quadric, vertex_quadrics};
use crate::queue::Queue;
use nalgebra::Point3;
use rayon::prelude::*;
use sombrero_mesh::geometry::{area_vector, face_area};
use sombrero_mesh::{BoundingBox, Collapse, HalfedgeId, Mesh, VertexId};
use std::cmp::Ordering;

/// λ: weight of the edge length against the quadric error.
const EVENNESS: f64 = 1e-6;
/// Smallest cosine between the normals of a face before and after a collapse.
const LEAST_COSINE: f64 = 0.7;

/// Collapses `mesh` to its base and returns the collapses in order, and how many of them kept the shape.
pub(crate) fn collapse_all(mesh: &mut Mesh, points: &[Point3<f64>]) -> (Vec<Collapse>, usize) {
    let mut run = Run::new(mesh, points);
    while run.sweep() {}
    let faithful = run.collapses.len();
    run.allow_turns = true;
    while run.sweep() {}
    (run.collapses, faithful)
}

/// Vertices that are worth a thread.
const SHARE: usize = 1024;

struct Run<'a> {
    mesh: &'a mut Mesh,
    vertices: Vec<Vertex>,
    /// Vertices by the cost of their best collapse.
    queue: Queue,
    /// The best collapse of each vertex in the queue.
    best: Vec<HalfedgeId>,
    /// Whether a vertex has a cheaper collapse that was not allowed.
    passed_over: Vec<bool>,
    allow_turns: bool,
    collapses: Vec<Collapse>,
    around: Vec<HalfedgeId>,
    ranked: Vec<(f64, HalfedgeId)>,
}

/// A collapse that is waiting for its turn.
#[derive(Clone, Copy)]
struct Candidate {
    cost: f64,
    halfedge: HalfedgeId,
    /// Whether a cheaper one was not allowed.
    passed_over: bool,
}

/// All that costs need of a vertex, in two cache lines that are fetched together: a large conversion waits for memory
/// most of the time.
#[derive(Clone, Copy)]
#[repr(align(128))]
struct Vertex {
    /// Its position, centred and scaled so that the largest side of the bounding box is 1.
    point: Point3<f64>,
    /// What it has swallowed.
    quadric: Quadric,
    area: f64,
}

impl<'a> Run<'a> {
    fn new(mesh: &'a mut Mesh, points: &[Point3<f64>]) -> Self {
        let bound = mesh.vertex_bound();
        Self {
            vertices: vertices(mesh, &normalized(points)),
            queue: Queue::new(bound),
            best: vec![HalfedgeId::new(0); bound],
            passed_over: vec![false; bound],
            allow_turns: false,
            collapses: Vec::with_capacity(bound),
            around: Vec::new(),
            ranked: Vec::new(),
            mesh,
        }
    }

    /// Queues every vertex and collapses until the queue is empty; whether anything collapsed.
    ///
    /// A collapse can make another one possible two edges away, where nothing is requeued, so sweeps are
    /// repeated until one does nothing.
    fn sweep(&mut self) -> bool {
        let before = self.collapses.len();
        let vertices: Vec<VertexId> = self.mesh.vertices().collect();
        // A third of the work, and the part that can be shared: nothing changes yet.
        let candidates: Vec<Option<Candidate>> = vertices
            .par_iter()
            .with_min_len(SHARE)
            .map_init(Vec::new, |ranked, &v| self.candidate(v, ranked))
            .collect();
        for (v, candidate) in vertices.into_iter().zip(candidates) {
            self.put(v, candidate);
        }
        while let Some(v) = self.queue.pop() {
            let best = self.best[v];
            // What is around may have changed since; then look for the next best.
            match self.may_turn(best).then(|| self.mesh.collapse(best)) {
                Some(Ok(collapse)) => self.after_collapse(collapse),
                _ => self.enqueue(VertexId::new(v)),
            }
        }
        self.collapses.len() > before
    }

    fn after_collapse(&mut self, collapse: Collapse) {
        let Collapse { removed: gone, kept, .. } = collapse;
        let Vertex { quadric, area, .. } = self.vertices[gone.index()];
        let swallower = &mut self.vertices[kept.index()];
        swallower.quadric += quadric;
        swallower.area += area;
        self.collapses.push(collapse);

        self.enqueue(kept);
        let mut around = std::mem::take(&mut self.around);
        around.clear();
        around.extend(self.mesh.outgoing_halfedges(kept));
        for &h in &around {
            self.reconsider(h.twin());
        }
        self.around = around;
    }

    /// The candidate of the tail of `h` after the tip of `h` has swallowed another vertex.
    ///
    /// Of the tail's collapses only those into the tip have another cost now. So the candidate stays, unless it
    /// was one of them, `h` is cheaper, or something cheaper was not allowed before and may be now. Whether it is
    /// still allowed is asked when its turn comes.
    fn reconsider(&mut self, h: HalfedgeId) {
        let (u, kept) = (self.mesh.tail(h), self.mesh.tip(h));
        let best = self.best[u.index()];
        let stays = self.queue.cost(u.index()).is_some_and(|cost| {
            self.mesh.tip(best) != kept
                && !self.passed_over[u.index()]
                && (cost, best) < (self.cost(u, kept), h)
        });
        if !stays {
            self.enqueue(u);
        }
    }

    fn may_turn(&self, h: HalfedgeId) -> bool {
        self.allow_turns || self.keeps_normals(h)
    }

    /// Puts the cheapest allowed collapse of `u` into the queue, if there is one.
    fn enqueue(&mut self, u: VertexId) {
        let mut ranked = std::mem::take(&mut self.ranked);
        let candidate = self.candidate(u, &mut ranked);
        self.ranked = ranked;
        self.put(u, candidate);
    }

    fn put(&mut self, u: VertexId, candidate: Option<Candidate>) {
        match candidate {
            Some(Candidate { cost, halfedge, passed_over }) => {
                self.queue.set(u.index(), cost);
                self.best[u.index()] = halfedge;
                self.passed_over[u.index()] = passed_over;
            }
            None => self.queue.remove(u.index()),
        }
    }

    /// The cheapest allowed collapse of `u`; `ranked` is scratch space.
    fn candidate(&self, u: VertexId, ranked: &mut Vec<(f64, HalfedgeId)>) -> Option<Candidate> {
        let on_boundary = self.mesh.is_boundary_vertex(u);
        let along = |h: &HalfedgeId| !on_boundary || self.mesh.is_boundary_edge(h.edge());
        let collapses = self.mesh.outgoing_halfedges(u).filter(along);
        ranked.clear();
        ranked.extend(collapses.map(|h| (self.cost(u, self.mesh.tip(h)), h)));
        let mut passed_over = false;
        // Mostly the first is allowed. If not, the rest is sorted once, dearest first: with thousands of neighbours
        // looking for the least again and again would take forever.
        while let Some(best) = if passed_over { ranked.len().checked_sub(1) } else { cheapest(ranked) } {
            let (cost, halfedge) = ranked.swap_remove(best);
            if self.may_turn(halfedge) && self.mesh.check_collapse(halfedge).is_ok() {
                return Some(Candidate { cost, halfedge, passed_over });
            }
            if !passed_over {
                ranked.sort_unstable_by(|a, b| rank(b, a));
                passed_over = true;
            }
        }
        None
    }

    fn cost(&self, u: VertexId, v: VertexId) -> f64 {
        let (from, to) = (&self.vertices[u.index()], &self.vertices[v.index()]);
        let error = from.quadric.at(&to.point) + to.quadric.at(&to.point);
        error.max(0.0) + EVENNESS * from.area * (from.point - to.point).norm_squared()
    }

    /// Whether moving the tail of `h` into its tip turns no face too far.
    fn keeps_normals(&self, h: HalfedgeId) -> bool {
        let at = |v: VertexId| &self.vertices[v.index()].point;
        let (u, v) = (self.mesh.tail(h), self.mesh.tip(h));
        self.mesh.outgoing_halfedges(u).filter(|&g| self.mesh.face(g).is_some()).all(|g| {
            let (a, b) = (self.mesh.tip(g), self.mesh.tip(self.mesh.next(g)));
            if a == v || b == v {
                return true;
            }
            let before = area_vector(at(u), at(a), at(b));
            let after = area_vector(at(v), at(a), at(b));
            let dot = before.dot(&after);
            dot > 0.0
                && dot * dot >= LEAST_COSINE * LEAST_COSINE * before.norm_squared() * after.norm_squared()
        })
    }
}

/// By cost, then by halfedge.
fn rank(a: &(f64, HalfedgeId), b: &(f64, HalfedgeId)) -> Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

fn cheapest(ranked: &[(f64, HalfedgeId)]) -> Option<usize> {
    (0..ranked.len()).min_by(|&i, &j| rank(&ranked[i], &ranked[j]))
}

/// Quadrics of large coordinates lose their digits, so costs are computed in a unit box at the origin.
fn normalized(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let Some(bounds) = BoundingBox::of(points) else { return Vec::new() };
    let scale = bounds.largest_side();
    let scale = if scale > 0.0 { 1.0 / scale } else { 1.0 };
    let centre = nalgebra::center(&bounds.min, &bounds.max);
    points.iter().map(|p| Point3::from((p - centre) * scale)).collect()
}

fn vertices(mesh: &Mesh, points: &[Point3<f64>]) -> Vec<Vertex> {
    let quadrics = vertex_quadrics(mesh, points).into_iter().zip(points);
    let mut vertices: Vec<Vertex> =
        quadrics.map(|(quadric, &point)| Vertex { point, quadric, area: 0.0 }).collect();
    for f in mesh.faces() {
        let third = face_area(mesh, points, f) / 3.0;
        mesh.vertices_of_face(f).into_iter().for_each(|v| vertices[v.index()].area += third);
    }
    vertices
}
