//! Fields of a coarse level on the full mesh.
//!
//! A vertex that a split introduces gets a mean of its neighbours' displacements; whenever the number of vertices has
//! grown four times, and in the end, every vertex moves half way towards the mean around it. As in subdivision (an average of neighbours after
//! every refinement makes limits smooth), this takes away the kinks along the coarse level's edges. A vertex in a
//! planar region takes means over the neighbours that lie in the same regions, so that creases do not feel the surface
//! beside them, and has its part along the normals replaced by the regions' offsets: planes stay planes.

use crate::Field;
use crate::planes::Planes;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::VertexId;
use sombrero_progressive::ProgressiveMesh;

/// Fields, and the offset that each gives to the planes: (free offset, value).
#[derive(Debug, Clone, Default)]
pub(crate) struct Shifts {
    pub(crate) moves: Field,
    pub(crate) offsets: Vec<(u32, f64)>,
}

/// What each field does at one vertex: (field, displacement), in order of fields.
pub(crate) type Here = Vec<(u32, Vector3<f64>)>;

/// Displacements below this share of a field's largest count as none.
const NOTHING: f64 = 1e-4;
/// Growth of the number of vertices after which they are smoothed.
const GROWTH: f64 = 4.0;

/// The fields at each vertex of the full mesh. `progressive` is at the level whose vertices, by the full mesh's index, the
/// fields move; it is left at the full mesh.
pub(crate) fn carry(
    progressive: &mut ProgressiveMesh,
    points: &[Point3<f64>],
    planes: &Planes,
    fields: &[Shifts],
) -> Vec<Here> {
    let mut at: Vec<Here> = vec![Vec::new(); points.len()];
    for (i, field) in (0_u32..).zip(fields) {
        field.moves.iter().for_each(|(v, d)| at[*v as usize].push((i, *d)));
    }
    let rules = Rules::new(points, planes, fields);
    let mut scratch = Scratch::new(fields.len());
    let mut smoothed = progressive.mesh().vertex_count() as f64;
    while let Some(split) = progressive.refine() {
        let v = split.vertex.to_u32();
        let ring: Vec<u32> =
            progressive.mesh().vertices_around_vertex(split.vertex).map(VertexId::to_u32).collect();
        at[v as usize] = rules.mean(&at, v, &ring, 0.0, &mut scratch);
        if progressive.mesh().vertex_count() as f64 >= GROWTH * smoothed {
            smoothed = progressive.mesh().vertex_count() as f64;
            at = rules.smoothed(progressive, &at);
        }
    }
    if (progressive.mesh().vertex_count() as f64) > smoothed {
        at = rules.smoothed(progressive, &at);
    }
    at
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

    fn take(&mut self) -> Here {
        self.touched.sort_unstable();
        let taken = self.touched.iter().map(|&i| (i, self.sums[i as usize])).collect();
        self.touched.drain(..).for_each(|i| self.seen[i as usize] = false);
        taken
    }
}

struct Rules<'a> {
    points: &'a [Point3<f64>],
    planes: &'a Planes,
    /// For each free offset what each field gives to it.
    offsets: Vec<Vec<(u32, f64)>>,
    /// For each field what counts as nothing, squared.
    nothing: Vec<f64>,
}

impl<'a> Rules<'a> {
    fn new(points: &'a [Point3<f64>], planes: &'a Planes, fields: &[Shifts]) -> Self {
        let mut offsets = vec![Vec::new(); planes.free_offsets()];
        for (i, field) in (0_u32..).zip(fields) {
            field.offsets.iter().for_each(|(free, c)| offsets[*free as usize].push((i, *c)));
        }
        let largest = |f: &Shifts| f.moves.iter().map(|(_, d)| d.norm_squared()).fold(0.0, f64::max);
        let nothing = fields.iter().map(|f| largest(f) * NOTHING * NOTHING).collect();
        Self { points, planes, offsets, nothing }
    }

    /// The mean of what is at the neighbours, with a weight for what is at `v` itself.
    fn mean(&self, at: &[Here], v: u32, ring: &[u32], own: f64, scratch: &mut Scratch) -> Here {
        let regions = self.planes.regions(v);
        let along = |w: &u32| regions.iter().all(|r| self.planes.regions(*w).contains(r));
        let alike = ring.iter().filter(|w| along(w)).count();
        let counts = |w: &u32| alike < 2 || along(w);
        let place = self.points[v as usize];
        let weight = |w: u32| {
            let length = (self.points[w as usize] - place).norm();
            if length > 0.0 { 1.0 / length } else { 0.0 }
        };
        let total: f64 = ring.iter().filter(|w| counts(w)).map(|&w| weight(w)).sum();
        if total > 0.0 {
            for &w in ring.iter().filter(|w| counts(w)) {
                scratch.add(&at[w as usize], (1.0 - own) * weight(w) / total);
            }
        }
        if own > 0.0 {
            scratch.add(&at[v as usize], own);
        }
        self.kept(v, scratch.take())
    }

    /// On the planes, and without what counts as nothing.
    fn kept(&self, v: u32, mut here: Here) -> Here {
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

    /// Every vertex of the present level half way towards the mean around it.
    fn smoothed(&self, progressive: &ProgressiveMesh, at: &[Here]) -> Vec<Here> {
        let mesh = progressive.mesh();
        let fields = self.nothing.len();
        let step = |scratch: &mut Scratch, v: usize| {
            let vertex = VertexId::new(v);
            if mesh.is_removed(vertex) {
                return Vec::new();
            }
            let ring: Vec<u32> = mesh.vertices_around_vertex(vertex).map(VertexId::to_u32).collect();
            self.mean(at, v as u32, &ring, 0.5, scratch)
        };
        (0..at.len()).into_par_iter().map_init(|| Scratch::new(fields), step).collect()
    }
}
