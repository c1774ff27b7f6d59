//! Planar regions, and the displacements that keep them planar.
//!
//! A planar region moves only along its normal, all of it by one offset c_r. At a vertex where the regions with normals
//! N = [n_1 … n_q]ᵀ meet,
//!
//! ```text
//! d_v = N⁺ c + T y_v,      T an orthonormal basis of what is perpendicular to all of N,
//! ```
//!
//! so that N d_v = c exactly, provided that (1 - N N⁺) c = 0: where more planes meet than space has room for, or planes
//! that are nearly the same, their offsets depend on each other. The free offsets are what elimination leaves.

use crate::jacobi::eigen;
use crate::surface::Surface;
use nalgebra::{Matrix3, Point3, Vector3};
use sombrero_coupling::{meeting, reach};
use sombrero_mesh::PlanarRegions;
use std::collections::BTreeMap;

/// Singular values of N below this share of the largest give no direction of their own to the offsets.
const RANK: f64 = 0.15;
/// And below this share they leave a direction free.
const FREE: f64 = 1e-7;

/// The share of planar regions from which a surface is that of a machined part.
const MACHINED: f64 = 0.25;

/// Whether a surface is that of a machined part, given the planar region of each face.
pub(crate) fn is_machined(surface: &Surface, regions: &[Option<u32>]) -> bool {
    let planar = surface.facets.areas.iter().zip(regions).filter(|(_, region)| region.is_some());
    planar.map(|(area, _)| area).sum::<f64>() >= MACHINED * surface.area
}

/// The planar regions of a surface and how vertices hang on them.
#[derive(Debug, Clone)]
pub(crate) struct Planes {
    /// Regions, each by its normal.
    normals: Vec<Vector3<f64>>,
    /// The region of each face.
    of_face: Vec<Option<u32>>,
    /// Which of `junctions` each vertex is at; `None` off all planes.
    at: Vec<Option<u32>>,
    junctions: Vec<Junction>,
    /// Each region's offset as a combination of the free offsets.
    offsets: Vec<Vec<(u32, f64)>>,
    /// How many offsets are free.
    free: usize,
}

/// A set of regions that meet at some vertices.
#[derive(Debug, Clone)]
struct Junction {
    regions: Vec<u32>,
    /// N⁺, a column for each free offset that matters here.
    columns: Vec<(u32, Vector3<f64>)>,
    /// T.
    tangents: Vec<Vector3<f64>>,
}

impl Planes {
    /// The region of each face.
    pub(crate) fn of_face(&self) -> &[Option<u32>] {
        &self.of_face
    }

    /// Finds them.
    pub(crate) fn find(surface: &Surface) -> Self {
        let PlanarRegions { normals, of_face, .. } = surface.planar(surface.side);
        let (at, junctions, offsets) = (Vec::new(), Vec::new(), Vec::new());
        let mut planes = Self { normals, of_face, at, junctions, offsets, free: 0 };
        let sets = vertex_sets(surface, &planes.of_face);
        let mut known: BTreeMap<Vec<u32>, u32> = BTreeMap::new();
        let mut pseudo: Vec<(Vec<u32>, Inverse)> = Vec::new();
        planes.at = sets
            .into_iter()
            .map(|set| {
                (!set.is_empty()).then(|| {
                    *known.entry(set.clone()).or_insert_with(|| {
                        let normals: Vec<_> = set.iter().map(|&r| planes.normals[r as usize]).collect();
                        pseudo.push((set, Inverse::new(&normals)));
                        (pseudo.len() - 1) as u32
                    })
                })
            })
            .collect();
        planes.eliminate(&pseudo);
        let junction = |(regions, inverse): &(Vec<u32>, Inverse)| {
            let mut columns: BTreeMap<u32, Vector3<f64>> = BTreeMap::new();
            for (&r, column) in regions.iter().zip(&inverse.columns) {
                for &(free, factor) in &planes.offsets[r as usize] {
                    *columns.entry(free).or_insert_with(Vector3::zeros) += column * factor;
                }
            }
            Junction {
                regions: regions.clone(),
                columns: columns.into_iter().collect(),
                tangents: inverse.tangents.clone(),
            }
        };
        planes.junctions = pseudo.iter().map(junction).collect();
        planes
    }

    /// Expresses dependent offsets by free ones, so that (1 - N N⁺) c = 0 wherever planes meet.
    fn eliminate(&mut self, pseudo: &[(Vec<u32>, Inverse)]) {
        /// Relations with all factors below this are rounding errors.
        const NOTHING: f64 = 1e-6;
        let mut solved: BTreeMap<u32, BTreeMap<u32, f64>> = BTreeMap::new();
        for (regions, inverse) in pseudo {
            let normals: Vec<Vector3<f64>> = regions.iter().map(|&r| self.normals[r as usize]).collect();
            for (i, n) in normals.iter().enumerate() {
                // Row i of 1 - N N⁺.
                let mut row: BTreeMap<u32, f64> = BTreeMap::new();
                for (j, (&r, column)) in regions.iter().zip(&inverse.columns).enumerate() {
                    let entry = f64::from(u8::from(i == j)) - n.dot(column);
                    if entry.abs() > NOTHING {
                        row.insert(r, entry);
                    }
                }
                substitute(&mut row, &solved);
                let pivot = row.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
                let Some((&pivot, &factor)) = pivot.filter(|(_, x)| x.abs() > 1e3 * NOTHING) else {
                    continue;
                };
                row.remove(&pivot);
                row.values_mut().for_each(|x| *x /= -factor);
                let own: BTreeMap<u32, BTreeMap<u32, f64>> = [(pivot, row.clone())].into();
                solved.values_mut().for_each(|other| substitute(other, &own));
                solved.insert(pivot, row);
            }
        }
        let mut index = BTreeMap::new();
        for r in (0..self.normals.len() as u32).filter(|r| !solved.contains_key(r)) {
            index.insert(r, index.len() as u32);
        }
        self.free = index.len();
        let expressed = |r: u32| match solved.get(&r) {
            Some(row) => row.iter().map(|(r, x)| (index[r], *x)).collect(),
            None => vec![(index[&r], 1.0)],
        };
        self.offsets = (0..self.normals.len() as u32).map(expressed).collect();
    }

    /// The largest difference between two offsets of one region's vertices along its normal, in largest sides.
    pub(crate) fn bent(&self, surface: &Surface, moved: &[Point3<f64>]) -> f64 {
        let mut bounds = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.normals.len()];
        for (corners, region) in surface.triangles.iter().zip(&self.of_face) {
            if let Some(r) = region {
                for &v in corners {
                    let offset =
                        self.normals[*r as usize].dot(&(moved[v as usize] - surface.points[v as usize]));
                    let [low, high] = &mut bounds[*r as usize];
                    (*low, *high) = (low.min(offset), high.max(offset));
                }
            }
        }
        bounds.into_iter().map(|[low, high]| high - low).fold(0.0, f64::max) / surface.side
    }

    /// How many offsets are free.
    pub(crate) fn free_offsets(&self) -> usize {
        self.free
    }

    /// How many planar regions there are.
    pub(crate) fn count(&self) -> usize {
        self.normals.len()
    }

    /// The regions that a vertex lies in.
    pub(crate) fn regions(&self, vertex: u32) -> &[u32] {
        self.at[vertex as usize].map_or(&[], |j| &self.junctions[j as usize].regions)
    }

    /// What each free offset does to a vertex: N⁺.
    pub(crate) fn columns(&self, vertex: u32) -> &[(u32, Vector3<f64>)] {
        self.at[vertex as usize].map_or(&[], |j| &self.junctions[j as usize].columns)
    }

    /// T: the directions in which a vertex is free.
    pub(crate) fn tangents(&self, vertex: u32) -> &[Vector3<f64>] {
        static ALL: [Vector3<f64>; 3] =
            [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.0, 0.0, 1.0)];
        self.at[vertex as usize].map_or(&ALL, |j| &self.junctions[j as usize].tangents)
    }

    /// The regions whose offsets depend on a free one.
    pub(crate) fn moved_by(&self) -> Vec<Vec<u32>> {
        let mut moved = vec![Vec::new(); self.free];
        for (r, row) in (0..).zip(&self.offsets) {
            row.iter().for_each(|&(free, _)| moved[free as usize].push(r));
        }
        moved
    }
}

fn substitute(row: &mut BTreeMap<u32, f64>, solved: &BTreeMap<u32, BTreeMap<u32, f64>>) {
    let known: Vec<(u32, f64)> =
        row.iter().filter(|(r, _)| solved.contains_key(r)).map(|(&r, &x)| (r, x)).collect();
    for (r, factor) in known {
        row.remove(&r);
        for (&other, x) in &solved[&r] {
            *row.entry(other).or_insert(0.0) += factor * x;
        }
    }
}

/// N⁺ of the directions that are well apart, and what is perpendicular to all.
#[derive(Debug, Clone)]
struct Inverse {
    columns: Vec<Vector3<f64>>,
    tangents: Vec<Vector3<f64>>,
}

impl Inverse {
    fn new(normals: &[Vector3<f64>]) -> Self {
        let gram: Matrix3<f64> = normals.iter().map(|n| n * n.transpose()).sum();
        let mut inverse = Matrix3::zeros();
        let pairs = eigen((0..9).map(|k| gram[(k / 3, k % 3)]).collect(), 3);
        let axes = pairs.into_iter().map(|(value, axis)| (value, Vector3::new(axis[0], axis[1], axis[2])));
        let axes: Vec<(f64, Vector3<f64>)> = axes.collect();
        let largest = axes[0].0;
        let mut tangents = Vec::new();
        for (value, axis) in axes {
            if value > RANK * RANK * largest {
                inverse += axis * axis.transpose() / value;
            } else if value <= FREE * FREE * largest + 1e-14 {
                tangents.push(axis);
            }
        }
        Self { columns: normals.iter().map(|n| inverse * n).collect(), tangents }
    }
}

/// The regions of the faces around each vertex, and around those that it meets and will move with, each once, in order.
fn vertex_sets(surface: &Surface, of_face: &[Option<u32>]) -> Vec<Vec<u32>> {
    let mut sets = vec![Vec::new(); surface.points.len()];
    for (corners, region) in surface.triangles.iter().zip(of_face) {
        if let Some(r) = region {
            for &v in corners {
                let set: &mut Vec<u32> = &mut sets[v as usize];
                if let Err(place) = set.binary_search(r) {
                    set.insert(place, *r);
                }
            }
        }
    }
    for group in meeting(&surface.points, &reach(&surface.points, &surface.triangles, &[])) {
        let mut all: Vec<u32> = group.iter().flat_map(|&v| sets[v as usize].iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        group.iter().for_each(|&v| sets[v as usize].clone_from(&all));
    }
    sets
}
