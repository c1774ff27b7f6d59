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

use crate::magnitude::magnitude;
use crate::quadric::{Quadric, vertex_quadrics};
use crate::queue::Queue;
use nalgebra::Point3;
use rayon::prelude::*;
use sombrero_mesh::geometry::{area_vector, face_area};
use sombrero_mesh::{BoundingBox, Collapse, HalfedgeId, Mesh, VertexId};
use sombrero_progress::Progress;
use std::cmp::Ordering;

/// λ: weight of the edge length against the quadric error.
const EVENNESS: f64 = 1e-6;
/// Smallest cosine between the normals of a face before and after a collapse.
const LEAST_COSINE: f64 = 0.7;

/// All collapses on the way to the base.
#[derive(Debug, PartialEq)]
pub(crate) struct Collapses {
    /// In order.
    pub(crate) all: Vec<Collapse>,
    /// How far each removed vertex stood out from its neighbours.
    pub(crate) heights: Vec<f64>,
    /// How many kept the shape.
    pub(crate) faithful: usize,
}

/// Collapses `mesh` to its base.
pub(crate) fn collapse_all(mesh: &mut Mesh, points: &[Point3<f64>]) -> Collapses {
    let mut run = Run::new(mesh, points);
    while run.sweep() {}
    let faithful = run.collapses.len();
    run.allow_turns = true;
    while run.sweep() {}
    Collapses { all: run.collapses, heights: run.heights, faithful }
}

/// Vertices that are worth a thread.
const SHARE: usize = 1024;

struct Run<'a> {
    mesh: &'a mut Mesh,
    /// As they are.
    points: &'a [Point3<f64>],
    /// Apart from the rest, because most looks at a vertex are for its place only, and a large conversion waits for memory.
    places: Vec<Place>,
    vertices: Vec<Vertex>,
    /// Vertices by the cost of their best collapse, or something below it.
    queue: Queue,
    allow_turns: bool,
    collapses: Vec<Collapse>,
    heights: Vec<f64>,
    /// Of as many collapses as there are vertices; no mesh has more.
    progress: Progress,
    around: Vec<HalfedgeId>,
    ranked: Vec<(f64, HalfedgeId)>,
}

/// What is known of a vertex that waits for its turn.
///
/// It is enough to know something below the cost of its best collapse, and to look for that when its turn seems to have
/// come: most candidates would change several times before.
#[derive(Clone, Copy)]
enum Waiting {
    /// Its best collapse costs at least so much.
    Bound(f64),
    /// Its best collapse.
    Best(Candidate),
}

/// The best collapse of a vertex.
#[derive(Clone, Copy)]
struct Candidate {
    cost: f64,
    halfedge: HalfedgeId,
    /// What the cheapest one costs, if that was not allowed.
    passed_over: Option<f64>,
}

/// Where a vertex stands, and what that costs by itself: all that its neighbours ask, in half a cache line.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Place {
    /// Centred and scaled so that the largest side of the bounding box is 1.
    point: Point3<f64>,
    /// The vertex's own quadric there.
    error: f64,
}

const _: () = assert!(size_of::<Place>() == 32, "half a cache line");

/// What else is looked at together of a vertex, in two cache lines.
#[derive(Clone, Copy)]
#[repr(align(128))]
struct Vertex {
    /// What it has swallowed.
    quadric: Quadric,
    area: f64,
    /// `None` when it has no collapse that is allowed, or is gone.
    waiting: Option<Waiting>,
}

const _: () = assert!(size_of::<Vertex>() == 128, "two cache lines");

impl<'a> Run<'a> {
    fn new(mesh: &'a mut Mesh, points: &'a [Point3<f64>]) -> Self {
        let bound = mesh.vertex_bound();
        let unit = normalized(points);
        let vertices = vertices(mesh, &unit);
        let place =
            |(&point, vertex): (&Point3<f64>, &Vertex)| Place { point, error: vertex.quadric.at(&point) };
        Self {
            places: unit.iter().zip(&vertices).map(place).collect(),
            vertices,
            points,
            queue: Queue::new(bound),
            allow_turns: false,
            collapses: Vec::with_capacity(bound),
            heights: Vec::with_capacity(bound),
            progress: Progress::new("conversion", mesh.vertex_count()),
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
        // The part of the work that can be shared: nothing changes yet.
        let bounds: Vec<f64> = vertices.par_iter().with_min_len(SHARE).map(|&v| self.least_cost(v)).collect();
        for (v, bound) in vertices.into_iter().zip(bounds) {
            self.put(v, Waiting::Bound(bound));
        }
        while let Some(v) = self.queue.pop() {
            let waiting = self.vertices[v].waiting.take();
            self.turn(VertexId::new(v), waiting);
        }
        self.collapses.len() > before
    }

    /// The turn of `v` has come, or seems to.
    fn turn(&mut self, v: VertexId, waiting: Option<Waiting>) {
        // What is around may have changed since the candidate was found.
        let still_allowed =
            |c: &Candidate| self.may_turn(c.halfedge) && self.mesh.check_collapse(c.halfedge).is_ok();
        let known = match waiting {
            Some(Waiting::Best(candidate)) => Some(candidate).filter(still_allowed),
            _ => None,
        };
        if let Some(Candidate { halfedge, .. }) = known {
            self.collapse(halfedge);
        } else if let Some(candidate) = self.candidate(v) {
            if self.queue.would_be_next(v.index(), candidate.cost) {
                self.collapse(candidate.halfedge);
            } else {
                self.put(v, Waiting::Best(candidate));
            }
        }
    }

    /// Collapses `h`, which is allowed, and sees to the vertices around.
    fn collapse(&mut self, h: HalfedgeId) {
        // Here, where the ring is at hand anyway: another way through all levels takes longer.
        self.heights.push(magnitude(self.mesh, self.points, self.mesh.tail(h)).height);
        let collapse = self.mesh.collapse_allowed(h);
        let Collapse { removed: gone, kept, .. } = collapse;
        let Vertex { quadric, area, .. } = self.vertices[gone.index()];
        let swallower = &mut self.vertices[kept.index()];
        swallower.quadric += quadric;
        swallower.area += area;
        let place = &mut self.places[kept.index()];
        place.error = swallower.quadric.at(&place.point);
        self.collapses.push(collapse);
        self.progress.advance(1);

        self.put(kept, Waiting::Bound(self.least_cost(kept)));
        let mut around = std::mem::take(&mut self.around);
        around.clear();
        around.extend(self.mesh.outgoing_halfedges(kept));
        for &h in &around {
            self.reconsider(h.twin());
        }
        self.around = around;
    }

    /// The tail of `h` after the tip of `h` has swallowed another vertex.
    ///
    /// Of the tail's collapses only that along `h` has another cost now. So its candidate stays, unless it was that,
    /// `h` is cheaper, or something cheaper was not allowed before and may be now. Whether it is still allowed is
    /// asked when its turn comes.
    fn reconsider(&mut self, h: HalfedgeId) {
        let (u, kept) = (self.mesh.tail(h), self.mesh.tip(h));
        let cost = self.cost(u, kept);
        let bound = match self.vertices[u.index()].waiting {
            None => self.least_cost(u),
            Some(Waiting::Bound(bound)) if bound <= cost => return,
            Some(Waiting::Best(Candidate { passed_over: Some(least), .. })) => cost.min(least),
            Some(Waiting::Best(best)) if self.mesh.tip(best.halfedge) == kept => cost.min(best.cost),
            Some(Waiting::Best(best)) if (best.cost, best.halfedge) < (cost, h) => return,
            Some(_) => cost,
        };
        self.put(u, Waiting::Bound(bound));
    }

    fn may_turn(&self, h: HalfedgeId) -> bool {
        self.allow_turns || self.keeps_normals(h)
    }

    fn put(&mut self, u: VertexId, waiting: Waiting) {
        let (Waiting::Bound(cost) | Waiting::Best(Candidate { cost, .. })) = waiting;
        self.queue.set(u.index(), cost);
        self.vertices[u.index()].waiting = Some(waiting);
    }

    /// The collapses of `u` that may be allowed: boundary vertices stay on their boundary.
    fn collapses_of(&self, u: VertexId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let on_boundary = self.mesh.is_boundary_vertex(u);
        let along = move |h: &HalfedgeId| !on_boundary || self.mesh.is_boundary_edge(h.edge());
        self.mesh.outgoing_halfedges(u).filter(along)
    }

    /// No collapse of `u`, allowed or not, costs less.
    fn least_cost(&self, u: VertexId) -> f64 {
        self.collapses_of(u).map(|h| self.cost(u, self.mesh.tip(h))).fold(f64::INFINITY, f64::min)
    }

    /// The cheapest allowed collapse of `u`.
    fn candidate(&mut self, u: VertexId) -> Option<Candidate> {
        let mut ranked = std::mem::take(&mut self.ranked);
        ranked.clear();
        ranked.extend(self.collapses_of(u).map(|h| (self.cost(u, self.mesh.tip(h)), h)));
        let found = self.first_allowed(&mut ranked);
        self.ranked = ranked;
        found
    }

    fn first_allowed(&self, ranked: &mut Vec<(f64, HalfedgeId)>) -> Option<Candidate> {
        let mut passed_over = None;
        // Mostly the first is allowed. If not, the rest is sorted once, dearest first: with thousands of neighbours
        // looking for the least again and again would take forever.
        while let Some(best) =
            if passed_over.is_some() { ranked.len().checked_sub(1) } else { cheapest(ranked) }
        {
            let (cost, halfedge) = ranked.swap_remove(best);
            if self.may_turn(halfedge) && self.mesh.check_collapse(halfedge).is_ok() {
                return Some(Candidate { cost, halfedge, passed_over });
            }
            if passed_over.is_none() {
                ranked.sort_unstable_by(|a, b| rank(b, a));
                passed_over = Some(cost);
            }
        }
        None
    }

    fn cost(&self, u: VertexId, v: VertexId) -> f64 {
        let [start, end] = [u, v].map(|v| &self.places[v.index()]);
        let from = &self.vertices[u.index()];
        let error = from.quadric.at(&end.point) + end.error;
        error.max(0.0) + EVENNESS * from.area * (start.point - end.point).norm_squared()
    }

    /// Whether moving the tail of `h` into its tip turns no face too far.
    fn keeps_normals(&self, h: HalfedgeId) -> bool {
        let at = |v: VertexId| &self.places[v.index()].point;
        let (u, v) = (self.mesh.tail(h), self.mesh.tip(h));
        self.mesh.outgoing_halfedges(u).filter(|&g| self.mesh.face(g).is_some()).all(|g| {
            // By way of the halfedge before, whose twin is looked at next anyway: memory is what this waits for.
            let (a, b) = (self.mesh.tip(g), self.mesh.tail(self.mesh.prev(g)));
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
    let quadrics = vertex_quadrics(mesh, points).into_iter();
    let new = |quadric| Vertex { quadric, area: 0.0, waiting: None };
    let mut vertices: Vec<Vertex> = quadrics.map(new).collect();
    for f in mesh.faces() {
        let third = face_area(mesh, points, f) / 3.0;
        mesh.vertices_of_face(f).into_iter().for_each(|v| vertices[v.index()].area += third);
    }
    vertices
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::repair;
    use sombrero_progress::heard;
    use sombrero_shapes as shapes;

    #[test]
    fn a_conversion_says_how_far_it_is() {
        let made = repair(&shapes::bumpy_sphere(3000));
        let convert = || collapse_all(&mut made.mesh.clone(), &made.points);
        let (result, heard) = heard(convert);
        assert!((90..=102).contains(&heard.len()), "{}", heard.len());
        assert_eq!(result, convert(), "and does the same when nobody listens");
    }
}
