//! The whole way from a mesh to its fields.
//!
//! 1. Planar regions of the full mesh.
//! 2. A level of the progressive mesh with a few thousand vertices, overlapping pieces of it, and the best fields of each.
//! 3. How strong each is to be, seen together.
//! 4. Up the vertex splits to the full mesh, where those of machined parts settle and their strength is measured.

use crate::amplitudes::{self, Costs};
use crate::candidates::candidates;
use crate::carry::{Ladder, Shifts, carry};
use crate::columns::Columns;
use crate::evidence::Evidence;
use crate::lists::Lists;
use crate::planes::{Planes, is_machined};
use crate::settle::settled;
use crate::sight::Sight;
use crate::surface::Surface;
use crate::turning::{Strewn, turned, unevenness};
use crate::walls::Keeping;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::{BoundingBox, Soup, smoothing_modes};
use sombrero_progress::Progress;
use sombrero_progressive::{CompactMesh, ProgressiveMesh};
use thiserror::Error;

/// Displacements of some vertices in model units, in vertex order; all others stand still.
pub type Field = Vec<(u32, Vector3<f64>)>;

/// How fields are sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldsOptions {
    /// How many overlapping pieces the curved surface is covered with; each planar region has one more. Default 40.
    pub pieces: usize,
    /// Fields of each piece. Default 5.
    pub of_each: usize,
    /// How many fields there are at most: the strongest of those that were found. Default: no limit.
    pub most: usize,
    /// The share of the curved surface that a piece covers. Default 0.12.
    pub share: f64,
    /// Vertices of the level that fields are sought on. Default 3000.
    pub vertices: usize,
    /// How far normals are to turn in the end, root mean square by area in radians. Default 0.0038, 0.22 degrees.
    pub turn: f64,
    /// How far the surface may move at that, root mean square in diagonals of the bounding box. Default 0.00038.
    pub reach: f64,
    /// The noise that fields are to withstand, in largest sides. Default 0.003.
    pub noise: f64,
}

impl Default for FieldsOptions {
    fn default() -> Self {
        Self {
            pieces: 40,
            of_each: 5,
            most: usize::MAX,
            share: 0.12,
            vertices: 3000,
            turn: 0.0038,
            reach: 0.00038,
            noise: 0.003,
        }
    }
}

/// Why there are no fields.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FieldsError {
    /// Nothing on this surface moves without being seen.
    #[error(
        "no displacement of this mesh tells anything without being seen; use a finer mesh, with some relief"
    )]
    None,
}

/// The fields of a surface, local and smooth, which keep planar regions planar.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Fields {
    /// v' = v + ε Σ w_i D_i(v). With standard Gaussian w normals turn by ε radians: root mean square by area, in
    /// expectation over w, to first order; less where the surface would move too far, or where too much would be seen ([`Sight`]).
    pub columns: Columns,
    /// How many planar regions were found and kept planar.
    pub planes: usize,
}

/// Fields whose strength is below this share of the mean carry nothing worth the name.
const WEAK: f64 = 0.02;
/// More fields than a quarter of the vertices are nearly combinations of each other.
const VERTICES_OF_A_FIELD: usize = 4;
/// How often what turns normals where much is turned already is made dearer.
const EVENINGS: usize = 4;
/// Meshes with this many times the level's vertices are far finer.
const FINER: usize = 20;
/// How much of noise an observation's normal component has once it is compared: as measured.
const OBSERVED: f64 = 0.77;

impl Fields {
    /// Finds them. `points` are those of the full mesh. Time and memory grow linearly with the mesh; `progressive` is let go of
    /// before they are needed.
    ///
    /// # Errors
    /// [`FieldsError`] when there are none.
    pub fn new(
        mut progressive: ProgressiveMesh,
        points: &[Point3<f64>],
        options: &FieldsOptions,
    ) -> Result<Self, FieldsError> {
        let progress = Progress::new("fields", 4);
        let triangles = progressive.full_triangles().to_vec();
        let splits = progressive.split_count();
        progressive.go_to(splits - splits.min(points.len().saturating_sub(options.vertices)));
        let level = progressive.compact();
        let sought = || {
            let mesh = FullMesh::new(points, triangles, options);
            progress.advance(1);
            let chosen = mesh.sought(&level, options, &progress);
            (chosen, mesh)
        };
        // Walking through the levels takes one thread.
        let (ladder, (chosen, FullMesh { full, planes, keeping, .. })) =
            rayon::join(|| Ladder::climb(progressive, points.len()), sought);
        let chosen = chosen?;

        let mut lists = carry(ladder, points, &full.triangles, &planes, &chosen);
        if let Some(keeping) = keeping.filter(|_| level.source.len() < points.len()) {
            let mut stays = vec![false; points.len()];
            level.source.iter().for_each(|v| stays[v.index()] = true);
            let fields = Columns::new(&lists.all(), chosen.len(), |_, _| 1.0);
            let fields = fields.iter().map(Iterator::collect).collect();
            lists = Lists::of_fields(points.len(), &settled(&full, &planes, &keeping, &stays, fields));
        }
        let at = lists.all();
        let fields = Strewn { at: &at, factor: |_, _| 1.0 };
        let sight = Sight::on(&full, &fields, &fields.turned(&full), planes.of_face());
        if !(sight.normals_rms > 0.0 && sight.normals_rms.is_finite()) {
            return Err(FieldsError::None);
        }
        let scale = sight.room(options);
        let planes = planes.count();
        let columns = Columns::new(&at, chosen.len(), |_, _| scale);
        progress.advance(1);
        // Coordinates close to the limits of numbers have fields beyond them.
        if !columns.are_finite() {
            return Err(FieldsError::None);
        }
        Ok(Self { columns, planes })
    }

    /// The worst that a planar region leaves its plane by when the surface's `points` have `moved`: the difference of its
    /// vertices' offsets along the normal, in largest sides. 0 without planar regions.
    pub fn flatness(points: &[Point3<f64>], moved: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
        let surface = Surface::new(points.to_vec(), triangles.to_vec());
        Planes::find(&surface).bent(&surface, moved)
    }
}

/// The full mesh as fields see it.
struct FullMesh {
    full: Surface,
    planes: Planes,
    /// What filters do to a mesh that is far finer than the level, no field of the level looks like: then there are none.
    modes: Vec<Vec<Vector3<f64>>>,
    /// What is kept of what is narrow; of free forms nothing.
    keeping: Option<Keeping>,
}

impl FullMesh {
    fn new(points: &[Point3<f64>], triangles: Vec<[u32; 3]>, options: &FieldsOptions) -> Self {
        let full = Surface::new(points.to_vec(), triangles);
        let planes = Planes::find(&full);
        let finer = points.len() > FINER.saturating_mul(options.vertices);
        let modes = if finer {
            Vec::new()
        } else {
            smoothing_modes(&Soup::new(full.points.clone(), full.triangles.clone()))
        };
        let machined = is_machined(&full, planes.of_face());
        let keeping = machined.then(|| Keeping::new(&full, options.turn, options.reach));
        Self { full, planes, modes, keeping }
    }

    /// The best fields of a level, as strong as they are to be.
    fn sought(
        &self,
        level: &CompactMesh,
        options: &FieldsOptions,
        progress: &Progress,
    ) -> Result<Vec<Shifts>, FieldsError> {
        let names: Vec<u32> = level.source.iter().map(|v| v.to_u32()).collect();
        let Soup { points, triangles } = level.soup(&self.full.points);
        let level = Surface::new(points, triangles);
        let at_names = |mode: &Vec<Vector3<f64>>| names.iter().map(|&v| mode[v as usize]).collect();
        let evidence = Evidence::new(&level, &self.modes.iter().map(at_names).collect::<Vec<_>>());
        let found = candidates(&level, &self.planes, &names, &evidence, self.keeping.as_ref(), options);
        if found.is_empty() {
            return Err(FieldsError::None);
        }
        progress.advance(1);

        let strengths = strengths(&level, &evidence, &found, options);
        let mean = strengths.iter().sum::<f64>() / strengths.len() as f64;
        let most = options.most.min(self.full.points.len() / VERTICES_OF_A_FIELD);
        let least = strongest(&strengths, most).max(WEAK * mean);
        let strong = found.into_iter().zip(strengths).filter(|(_, p)| *p > least);
        let chosen = strong.map(|(shifts, p)| shifts.scaled(p.sqrt(), &names)).collect();
        progress.advance(1);
        Ok(chosen)
    }
}

/// What the strongest so many are above; 0 when there are no more.
fn strongest(strengths: &[f64], most: usize) -> f64 {
    let mut sorted = strengths.to_vec();
    sorted.sort_by(|a, b| b.total_cmp(a));
    sorted.get(most).copied().unwrap_or(0.0)
}

/// a_i² of each candidate.
fn strengths(level: &Surface, evidence: &Evidence, found: &[Shifts], options: &FieldsOptions) -> Vec<f64> {
    let s = amplitudes::gram(found, evidence, level.points.len());
    let turns: Vec<Vec<(u32, f64)>> = found.par_iter().map(|f| turned(level, &f.moves)).collect();
    let sum =
        |turns: &Vec<(u32, f64)>| turns.iter().map(|(f, t)| t * level.facets.areas[*f as usize]).sum::<f64>();
    let moved = |f: &Shifts| f.moves.iter().map(|(v, d)| evidence.weigh(*v, d).dot(d)).sum();
    let diagonal = BoundingBox::of(&level.points).map_or(0.0, |b| b.diagonal());
    let mut costs = Costs {
        seen: vec![1.0; found.len()],
        turned: turns.iter().map(sum).collect(),
        turn: options.turn * options.turn * level.area,
        moved: found.iter().map(moved).collect(),
        reach: (options.reach * diagonal) * (options.reach * diagonal) * level.area,
    };
    let deviation = OBSERVED * options.noise * level.side;
    let variance = deviation * deviation / 3.0 * level.area / level.points.len() as f64;
    let mut p = amplitudes::filled(&s, &costs, variance);
    for _ in 0..EVENINGS {
        let dearer = unevenness(level, &turns, &costs.turned, &p);
        costs.seen.iter_mut().zip(dearer).for_each(|(c, d)| *c = (*c * d).sqrt());
        p = amplitudes::filled(&s, &costs, variance);
    }
    amplitudes::filled_within_reach(&s, &costs, variance)
}

impl Shifts {
    /// Stronger by a factor, and with the full mesh's names of vertices.
    fn scaled(mut self, factor: f64, names: &[u32]) -> Self {
        self.moves.iter_mut().for_each(|(v, d)| (*v, *d) = (names[*v as usize], *d * factor));
        self.offsets.iter_mut().for_each(|(_, c)| *c *= factor);
        self
    }
}
