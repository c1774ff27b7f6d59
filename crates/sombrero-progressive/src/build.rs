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
use sombrero_mesh::geometry::{area_vector, face_area};
use sombrero_mesh::{BoundingBox, Collapse, HalfedgeId, Mesh, VertexId};

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

struct Run<'a> {
    mesh: &'a mut Mesh,
    /// Positions, centred and scaled so that the largest side of the bounding box is 1.
    points: Vec<Point3<f64>>,
    errors: Vec<Error>,
    /// Vertices by the cost of their best collapse.
    queue: Queue,
    /// The best collapse of each vertex in the queue.
    best: Vec<HalfedgeId>,
    allow_turns: bool,
    collapses: Vec<Collapse>,
    touched: Vec<VertexId>,
    ranked: Vec<(f64, HalfedgeId)>,
}

/// What a vertex has swallowed.
#[derive(Clone, Copy, Default)]
struct Error {
    quadric: Quadric,
    area: f64,
}

impl<'a> Run<'a> {
    fn new(mesh: &'a mut Mesh, points: &[Point3<f64>]) -> Self {
        let points = normalized(points);
        let errors = initial_errors(mesh, &points);
        let bound = mesh.vertex_bound();
        Self {
            errors,
            points,
            queue: Queue::new(bound),
            best: vec![HalfedgeId::new(0); bound],
            allow_turns: false,
            collapses: Vec::with_capacity(bound),
            touched: Vec::new(),
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
        for v in vertices {
            self.enqueue(v);
        }
        while let Some(v) = self.queue.pop() {
            match self.mesh.collapse(self.best[v]) {
                Ok(collapse) => self.after_collapse(collapse),
                // The link condition may have changed since; look for the next best.
                Err(_) => self.enqueue(VertexId::new(v)),
            }
        }
        self.collapses.len() > before
    }

    fn after_collapse(&mut self, collapse: Collapse) {
        let Collapse { removed: gone, kept, .. } = collapse;
        let Error { quadric, area } = self.errors[gone.index()];
        let error = &mut self.errors[kept.index()];
        error.quadric += quadric;
        error.area += area;
        self.collapses.push(collapse);

        let mut touched = std::mem::take(&mut self.touched);
        touched.clear();
        touched.push(kept);
        touched.extend(self.mesh.vertices_around_vertex(kept));
        for &v in &touched {
            self.enqueue(v);
        }
        self.touched = touched;
    }

    /// Puts the cheapest allowed collapse of `u` into the queue, if there is one.
    fn enqueue(&mut self, u: VertexId) {
        let mut ranked = std::mem::take(&mut self.ranked);
        ranked.clear();
        let on_boundary = self.mesh.is_boundary_vertex(u);
        ranked.extend(
            self.mesh
                .outgoing_halfedges(u)
                .filter(|h| !on_boundary || self.mesh.is_boundary_edge(h.edge()))
                .map(|h| (self.cost(u, self.mesh.tip(h)), h)),
        );
        while let Some(best) = cheapest(&ranked) {
            let (cost, halfedge) = ranked.swap_remove(best);
            if (self.allow_turns || self.keeps_normals(halfedge))
                && self.mesh.check_collapse(halfedge).is_ok()
            {
                self.queue.set(u.index(), cost);
                self.best[u.index()] = halfedge;
                self.ranked = ranked;
                return;
            }
        }
        self.queue.remove(u.index());
        self.ranked = ranked;
    }

    fn cost(&self, u: VertexId, v: VertexId) -> f64 {
        let (from, to) = (&self.errors[u.index()], &self.errors[v.index()]);
        let (p, q) = (&self.points[u.index()], &self.points[v.index()]);
        let error = from.quadric.at(q) + to.quadric.at(q);
        error.max(0.0) + EVENNESS * from.area * (p - q).norm_squared()
    }

    /// Whether moving the tail of `h` into its tip turns no face too far.
    fn keeps_normals(&self, h: HalfedgeId) -> bool {
        let at = |v: VertexId| &self.points[v.index()];
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

/// Position of the smallest cost, the smaller halfedge among equals.
fn cheapest(ranked: &[(f64, HalfedgeId)]) -> Option<usize> {
    let order = |a: &(f64, HalfedgeId), b: &(f64, HalfedgeId)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    (0..ranked.len()).min_by(|&i, &j| order(&ranked[i], &ranked[j]))
}

/// Quadrics of large coordinates lose their digits, so costs are computed in a unit box at the origin.
fn normalized(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let Some(bounds) = BoundingBox::of(points) else { return Vec::new() };
    let scale = bounds.largest_side();
    let scale = if scale > 0.0 { 1.0 / scale } else { 1.0 };
    let centre = nalgebra::center(&bounds.min, &bounds.max);
    points.iter().map(|p| Point3::from((p - centre) * scale)).collect()
}

fn initial_errors(mesh: &Mesh, points: &[Point3<f64>]) -> Vec<Error> {
    let quadrics = vertex_quadrics(mesh, points).into_iter();
    let mut errors: Vec<Error> = quadrics.map(|quadric| Error { quadric, area: 0.0 }).collect();
    for f in mesh.faces() {
        let third = face_area(mesh, points, f) / 3.0;
        mesh.vertices_of_face(f).into_iter().for_each(|v| errors[v.index()].area += third);
    }
    errors
}
