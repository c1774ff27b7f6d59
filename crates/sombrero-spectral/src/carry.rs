//! Fields of a coarse level on the full mesh.
//!
//! A vertex that a split introduces gets a mean of its neighbours' displacements, weighed by mean value coordinates (Floater
//! 2003),
//!
//! ```text
//! λ_w = (tan(α/2) + tan(β/2)) / |w - v|,      α and β the angles at v beside the edge to w,
//! ```
//!
//! which give back what is linear: a corner of a thin face moves as the edge does that it nearly lies on. Whenever the number
//! of vertices has grown four times, and in the end, every vertex moves half way towards the mean around it. As in subdivision
//! (an average of neighbours after every refinement makes limits smooth), this takes away the kinks along the coarse level's
//! edges. Corners of thin faces stay where their means are: a little more here than there would turn such a face over. A
//! vertex in a planar region takes means over the neighbours that lie in the same regions, so that creases do not feel the
//! surface beside them, and has its part along the normals replaced by the regions' offsets: planes stay planes.

use crate::Field;
use crate::lists::{Lists, Piece};
use crate::planes::Planes;
use crate::together::Here;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::{Mesh, VertexId};
use sombrero_progressive::ProgressiveMesh;

/// Fields, and the offset that each gives to the planes: (free offset, value).
#[derive(Debug, Clone, Default)]
pub(crate) struct Shifts {
    pub(crate) moves: Field,
    pub(crate) offsets: Vec<(u32, f64)>,
}

/// Displacements below this share of a field's largest count as none.
const NOTHING: f64 = 1e-4;
/// Growth of the number of vertices after which they are smoothed.
const GROWTH: f64 = 4.0;

/// Vertices that one task takes.
const CHUNK: usize = 256;

/// Vertices whose lists are made before they are put behind the others: no more memory is needed for both.
const AT_ONCE: usize = 64 * CHUNK;

/// The fields at each vertex of the full mesh, up a ladder from the level whose vertices, by the full mesh's index, they move.
pub(crate) fn carry(
    ladder: Ladder,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    planes: &Planes,
    fields: &[Shifts],
) -> Lists {
    let mut lists = Lists::of_fields(points.len(), fields.iter().map(|field| &field.moves));
    let rules = Rules::new(points, triangles, planes, fields);
    for rung in ladder.rungs {
        for splits in rung.together().flat_map(|splits| splits.chunks(AT_ONCE)) {
            let mean = |split: &u32, scratch: &mut Scratch| {
                let ring = rung.new.at(*split as usize);
                (ring.centre, rules.mean(&lists, &ring, 0.0, scratch))
            };
            let pieces = rules.pieces(splits, mean);
            pieces.iter().for_each(|piece| lists.add(piece));
        }
        lists = rules.smoothed(&rung.all, &lists, points.len());
    }
    lists
}

/// The way from a level up to the full mesh, in steps after which vertices are smoothed.
#[derive(Debug)]
pub(crate) struct Ladder {
    rungs: Vec<Rung>,
}

#[derive(Debug)]
struct Rung {
    /// The vertices that are introduced, with their neighbours then.
    new: RingsInOrder,
    /// More than that of any neighbour that was introduced along with it; those of equal depth do not depend on each other.
    depths: Vec<u32>,
    /// Which vertex comes when: by depth, and then near those that are near it.
    order: Vec<u32>,
    /// All vertices there are in the end.
    all: RingsInOrder,
}

impl Ladder {
    /// From the present level of `progressive` to the full mesh with so many `vertices`.
    pub(crate) fn climb(mut progressive: ProgressiveMesh, vertices: usize) -> Self {
        let rank = nested(&progressive, vertices);
        let rung = || Rung::climb(&mut progressive, &rank);
        Self { rungs: std::iter::from_fn(rung).collect() }
    }
}

impl Rung {
    /// The next splits, until there are [`GROWTH`] times as many vertices; `None` at the full mesh.
    fn climb(progressive: &mut ProgressiveMesh, rank: &[u32]) -> Option<Self> {
        let most = GROWTH * progressive.mesh().vertex_count() as f64;
        let mut depth_of = vec![0; rank.len()];
        let (mut new, mut depths) = (RingsInOrder::default(), Vec::new());
        while (progressive.mesh().vertex_count() as f64) < most
            && let Some(split) = progressive.refine()
        {
            new.push(progressive.mesh(), split.vertex);
            let around = new.at(depths.len()).vertices;
            let depth = 1 + around.iter().map(|w| depth_of[*w as usize]).max().unwrap_or(0);
            depth_of[split.vertex.index()] = depth;
            depths.push(depth);
        }
        if depths.is_empty() {
            return None;
        }
        let mut order: Vec<u32> = (0..depths.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (depths[i as usize], rank[new.centres[i as usize] as usize]));
        let mut vertices: Vec<VertexId> = progressive.mesh().vertices().collect();
        vertices.sort_unstable_by_key(|v| rank[v.index()]);
        let mut all = RingsInOrder::default();
        vertices.into_iter().for_each(|v| all.push(progressive.mesh(), v));
        Some(Self { new, depths, order, all })
    }

    /// The new vertices whose turn comes together.
    fn together(&self) -> impl Iterator<Item = &[u32]> {
        self.order.chunk_by(|a, b| self.depths[*a as usize] == self.depths[*b as usize])
    }
}

/// Ranks of vertices in an order in which what a vertex is split into follows it: what is near in space is near in memory, for
/// which large meshes wait otherwise.
fn nested(progressive: &ProgressiveMesh, vertices: usize) -> Vec<u32> {
    let splits = || (0..progressive.split_count()).map_while(|i| progressive.split(i));
    let mut sizes = vec![1_u32; vertices];
    let all: Vec<[usize; 2]> = splits().map(|split| [split.vertex.index(), split.parent.index()]).collect();
    all.iter().rev().for_each(|&[vertex, parent]| sizes[parent] += sizes[vertex]);
    let mut ranks = vec![0; vertices];
    let mut next = vec![0; vertices];
    let mut first = 0;
    for base in progressive.base_vertices() {
        (ranks[base.index()], next[base.index()]) = (first, first + 1);
        first += sizes[base.index()];
    }
    for [vertex, parent] in all {
        (ranks[vertex], next[vertex]) = (next[parent], next[parent] + 1);
        next[parent] += sizes[vertex];
    }
    ranks
}

/// Sums of displacements by field.
struct Scratch {
    sums: Vec<Vector3<f64>>,
    seen: Vec<bool>,
    touched: Vec<u32>,
}

impl Scratch {
    fn new(fields: usize) -> Self {
        Self { sums: vec![Vector3::zeros(); fields], seen: vec![false; fields], touched: Vec::new() }
    }

    fn add(&mut self, here: &Here, weight: f64) {
        for (i, d) in here {
            let index = *i as usize;
            if !std::mem::replace(&mut self.seen[index], true) {
                self.touched.push(*i);
                self.sums[index] = Vector3::zeros();
            }
            self.sums[index] += d * weight;
        }
    }

    fn take(&mut self) -> Vec<(u32, Vector3<f64>)> {
        self.touched.sort_unstable();
        let taken = self.touched.iter().map(|&i| (i, self.sums[i as usize])).collect();
        self.touched.drain(..).for_each(|i| self.seen[i as usize] = false);
        taken
    }
}

/// Vertices with their neighbours, one behind the other.
#[derive(Debug, Default)]
struct RingsInOrder {
    centres: Vec<u32>,
    closed: Vec<bool>,
    /// Where the neighbours of each end.
    ends: Vec<usize>,
    vertices: Vec<u32>,
}

impl RingsInOrder {
    fn push(&mut self, mesh: &Mesh, v: VertexId) {
        self.centres.push(v.to_u32());
        self.closed.push(!mesh.is_boundary_vertex(v));
        self.vertices.extend(mesh.vertices_around_vertex(v).map(VertexId::to_u32));
        self.ends.push(self.vertices.len());
    }

    fn at(&self, i: usize) -> Ring<'_> {
        let start = i.checked_sub(1).map_or(0, |before| self.ends[before]);
        let vertices = &self.vertices[start..self.ends[i]];
        Ring { centre: self.centres[i], vertices, closed: self.closed[i] }
    }
}

/// The neighbours of a vertex in order; those of an inner vertex go around.
struct Ring<'a> {
    centre: u32,
    vertices: &'a [u32],
    closed: bool,
}

/// A face of a smaller sine at its corner counts as one with this sine, so that weights stay finite.
const LEAST_SINE: f64 = 1e-9;

impl Ring<'_> {
    /// λ of each neighbour, seen from `place`.
    fn mean_values(&self, place: &Point3<f64>, points: &[Point3<f64>]) -> Vec<(u32, f64)> {
        let ways: Vec<Vector3<f64>> = self.vertices.iter().map(|&w| points[w as usize] - place).collect();
        // tan(α/2) = (1 - cos α) / sin α of the face between neighbour k and the next.
        let half = |k: usize| {
            let (a, b) = (ways[k], ways[(k + 1) % ways.len()]);
            let lengths = a.norm() * b.norm();
            let sine = a.cross(&b).norm().max(LEAST_SINE * lengths);
            if sine > 0.0 { (lengths - a.dot(&b)).max(0.0) / sine } else { 0.0 }
        };
        let faces = if self.closed { ways.len() } else { ways.len().saturating_sub(1) };
        let halves: Vec<f64> = (0..faces).map(half).collect();
        let around = |k: usize| {
            let before = (k + ways.len() - 1) % ways.len();
            halves.get(k).unwrap_or(&0.0) + halves.get(before).unwrap_or(&0.0)
        };
        let weight = |k: usize| {
            let length = ways[k].norm();
            if length > 0.0 { around(k) / length } else { 0.0 }
        };
        self.vertices.iter().enumerate().map(|(k, &w)| (w, weight(k))).collect()
    }
}

struct Rules<'a> {
    points: &'a [Point3<f64>],
    /// Whether a vertex is a corner of a thin face of the full mesh.
    thin: Vec<bool>,
    planes: &'a Planes,
    /// For each free offset what each field gives to it.
    offsets: Vec<Vec<(u32, f64)>>,
    /// For each field what counts as nothing, squared.
    nothing: Vec<f64>,
}

/// A face whose height is a smaller share of its longest edge is thin.
const THIN: f64 = 0.1;

/// The corners of thin faces.
fn thin(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut thin = vec![false; points.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|v| points[v as usize]);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        // Twice the area is height times longest edge.
        if (b - a).cross(&(c - a)).norm() < THIN * longest {
            corners.iter().for_each(|&v| thin[v as usize] = true);
        }
    }
    thin
}

impl<'a> Rules<'a> {
    fn new(points: &'a [Point3<f64>], triangles: &[[u32; 3]], planes: &'a Planes, fields: &[Shifts]) -> Self {
        let mut offsets = vec![Vec::new(); planes.free_offsets()];
        for (i, field) in (0_u32..).zip(fields) {
            field.offsets.iter().for_each(|(free, c)| offsets[*free as usize].push((i, *c)));
        }
        let largest = |f: &Shifts| f.moves.iter().map(|(_, d)| d.norm_squared()).fold(0.0, f64::max);
        let nothing = fields.iter().map(|f| largest(f) * NOTHING * NOTHING).collect();
        Self { points, thin: thin(points, triangles), planes, offsets, nothing }
    }

    /// The mean of what is at the neighbours, with a weight for what is at the vertex itself.
    fn mean(
        &self,
        lists: &Lists,
        ring: &Ring<'_>,
        own: f64,
        scratch: &mut Scratch,
    ) -> Vec<(u32, Vector3<f64>)> {
        let v = ring.centre;
        let regions = self.planes.regions(v);
        let along = |w: &u32| regions.iter().all(|r| self.planes.regions(*w).contains(r));
        let alike: Vec<u32> = ring.vertices.iter().copied().filter(along).collect();
        let place = self.points[v as usize];
        let weights = if alike.len() < 2 || alike.len() == ring.vertices.len() {
            ring.mean_values(&place, self.points)
        } else {
            let length = |w: u32| (self.points[w as usize] - place).norm();
            alike
                .into_iter()
                .map(|w| (w, length(w)))
                .filter(|(_, l)| *l > 0.0)
                .map(|(w, l)| (w, 1.0 / l))
                .collect()
        };
        let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
        if total > 0.0 {
            for (w, weight) in weights {
                scratch.add(lists.at(w), (1.0 - own) * weight / total);
            }
        }
        if own > 0.0 {
            scratch.add(lists.at(v), own);
        }
        self.kept(v, scratch.take())
    }

    /// On the planes, and without what counts as nothing.
    fn kept(&self, v: u32, mut here: Vec<(u32, Vector3<f64>)>) -> Vec<(u32, Vector3<f64>)> {
        if !self.planes.regions(v).is_empty() {
            let tangents = self.planes.tangents(v);
            here.iter_mut().for_each(|(_, d)| *d = tangents.iter().map(|t| t * t.dot(d)).sum());
            for (free, column) in self.planes.columns(v) {
                for (i, c) in &self.offsets[*free as usize] {
                    match here.binary_search_by_key(i, |e| e.0) {
                        Ok(place) => here[place].1 += column * *c,
                        Err(place) => here.insert(place, (*i, column * *c)),
                    }
                }
            }
        }
        here.retain(|(i, d)| d.norm_squared() > self.nothing[*i as usize]);
        here
    }

    /// Every vertex of a level half way towards the mean around it; `vertices` are those of the full mesh.
    fn smoothed(&self, level: &RingsInOrder, lists: &Lists, vertices: usize) -> Lists {
        let step = |i: &usize, scratch: &mut Scratch| {
            let ring = level.at(*i);
            let v = ring.centre;
            if self.thin[v as usize] {
                return (v, lists.at(v).to_vec());
            }
            (v, self.mean(lists, &ring, 0.5, scratch))
        };
        let mut smoothed = Lists::new(vertices, lists.len());
        let all: Vec<usize> = (0..level.centres.len()).collect();
        for part in all.chunks(AT_ONCE) {
            self.pieces(part, step).iter().for_each(|piece| smoothed.add(piece));
        }
        smoothed
    }

    /// The vertices and lists that `make` makes of all.
    fn pieces<T: Sync>(
        &self,
        all: &[T],
        make: impl Fn(&T, &mut Scratch) -> (u32, Vec<(u32, Vector3<f64>)>) + Sync,
    ) -> Vec<Piece> {
        let piece = |chunk: &[T]| {
            let mut scratch = Scratch::new(self.nothing.len());
            let mut piece = Piece { all: Vec::new(), lengths: Vec::with_capacity(chunk.len()) };
            for (vertex, list) in chunk.iter().map(|one| make(one, &mut scratch)) {
                piece.lengths.push((vertex, list.len()));
                piece.all.extend(list);
            }
            piece
        };
        all.par_chunks(CHUNK).map(piece).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(
        ring: &Ring<'_>,
        place: &Point3<f64>,
        points: &[Point3<f64>],
        of: impl Fn(&Point3<f64>) -> f64,
    ) -> f64 {
        let weights = ring.mean_values(place, points);
        let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
        weights.iter().map(|(w, weight)| of(&points[*w as usize]) * weight).sum::<f64>() / total
    }

    #[test]
    fn mean_values_give_back_what_is_linear_in_a_flat_ring() {
        let around = [[2.0, 0.1], [0.5, 1.0], [-1.0, 0.7], [-0.3, -0.2], [0.4, -3.0]];
        let points = around.map(|[x, y]| Point3::new(x, y, 0.0));
        let ring = Ring { centre: 5, vertices: &[0, 1, 2, 3, 4], closed: true };
        let linear = |p: &Point3<f64>| 3.0 + 2.0 * p.x - 0.7 * p.y;
        for place in [Point3::origin(), Point3::new(0.4, 0.3, 0.0), Point3::new(0.9, -0.7, 0.0)] {
            assert!((mean(&ring, &place, &points, linear) - linear(&place)).abs() < 1e-12);
        }
    }

    /// A corner that is a millionth off the edge between two neighbours moves as that edge does there, wherever others go.
    #[test]
    fn beside_an_edge_the_edge_alone_counts() {
        let points = [[0.0, 0.0], [4.0, 0.0], [2.0, 3.0]].map(|[x, y]| Point3::new(x, y, 0.0));
        let ring = Ring { centre: 3, vertices: &[0, 1, 2], closed: true };
        let moved =
            mean(&ring, &Point3::new(1.0, 1e-6, 0.0), &points, |p| if p.y > 0.0 { 100.0 } else { p.x });
        assert!((moved - 1.0).abs() < 1e-4, "{moved}");
        // On it, and at the rim, where nothing is on the other side.
        let rim = Ring { centre: 3, vertices: &[1, 2, 0], closed: false };
        let weights = rim.mean_values(&Point3::new(1.0, 0.0, 0.0), &points);
        assert!(weights.iter().all(|(_, weight)| weight.is_finite() && *weight >= 0.0), "{weights:?}");
    }

    /// Each vertex has a rank of its own, and what it is split into, and what that is, follows it without a gap.
    #[test]
    fn what_a_vertex_is_split_into_follows_it() {
        let made = sombrero_mesh::repair(&sombrero_shapes::bumpy_sphere(400));
        let progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
        let ranks = nested(&progressive, made.points.len());
        let mut sorted = ranks.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..made.points.len() as u32).collect::<Vec<_>>());
        let (mut counts, mut lasts) = (vec![1; ranks.len()], ranks.clone());
        for split in (0..progressive.split_count()).rev().filter_map(|i| progressive.split(i)) {
            let [vertex, parent] = [split.vertex.index(), split.parent.index()];
            counts[parent] += counts[vertex];
            lasts[parent] = lasts[parent].max(lasts[vertex]);
        }
        assert!((0..ranks.len()).all(|v| lasts[v] - ranks[v] + 1 == counts[v]));
    }

    #[test]
    fn corners_of_thin_faces_are_known() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.09], [0.5, 1.0], [3.0, 3.0]];
        let points = points.map(|[x, y]| Point3::new(x, y, 0.0));
        assert_eq!(thin(&points, &[[0, 1, 2], [1, 3, 2], [3, 4, 1]]), [true, true, true, false, false]);
    }
}
