//! What is seen of fields whose coefficients are standard Gaussian: expectations, to first order, known before there is a mark.

use crate::fields::FieldsOptions;
use crate::planes::is_machined;
use crate::surface::{Hinge, Surface};
use crate::together::Here;
use crate::turning::Strewn;
use crate::visibility::bend;
use nalgebra::Point3;
use rayon::prelude::*;
use sombrero_mesh::{BoundingBox, PlanarRegions};

/// How far normals turn and flat edges bend, in radians for coefficients of deviation 1.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Sight {
    /// How far normals turn: root mean square by area.
    pub normals_rms: f64,
    /// How far the surface moves along its normals, in diagonals of the bounding box: root mean square by area.
    pub moved_rms: f64,
    /// What the normals of a hundredth of the area turn by at least.
    pub normals_tail: f64,
    /// How far edges bend that were flat: root mean square by length. `None` without flat edges, and where planar regions are
    /// less than a quarter of the surface: on free forms edges are flat where triangles are small, and nobody sees it.
    pub flat_edges: Option<f64>,
}

/// What a hundredth of the area may turn by, in what all normals are to turn by: 0.75 degrees of 0.22, in expectation.
const TAIL: f64 = 3.4;
/// What flat edges may bend by: 0.057 degrees of 0.22, in expectation.
const FLAT: f64 = 0.26;
/// The cosine of the angle from which an edge is not flat: 2 degrees.
const FLAT_COSINE: f64 = 0.999_390_827_019_095_8;

impl Sight {
    /// Of fields on a surface, given A |dn|² of each face and the planar region of each.
    pub(crate) fn on(
        surface: &Surface,
        fields: &Strewn<impl AsRef<Here> + Sync, impl Fn(u32, u32) -> f64 + Sync>,
        turned: &[f64],
        regions: &[Option<u32>],
    ) -> Self {
        Self {
            normals_rms: (turned.iter().sum::<f64>() / surface.area).sqrt(),
            moved_rms: moved(surface, fields),
            normals_tail: tail(surface, turned),
            flat_edges: is_machined(surface, regions).then(|| flat_edges(surface, fields)).flatten(),
        }
    }

    /// How much stronger fields may become until too much is seen, where all normals are to turn by 1 and the surface to move
    /// in proportion; below 1 where it is already.
    pub fn room(&self, options: &FieldsOptions) -> f64 {
        let reach = options.reach / options.turn;
        let flat = self.flat_edges.map_or(f64::INFINITY, |flat| FLAT / flat);
        (1.0 / self.normals_rms).min(TAIL / self.normals_tail).min(reach / self.moved_rms).min(flat)
    }
}

/// A surface that is looked at, with any number of fields on it.
#[derive(Debug, Clone)]
pub struct Onlooker {
    surface: Surface,
    /// The planar region of each face.
    regions: Vec<Option<u32>>,
}

impl Onlooker {
    /// Finds the surface's planar regions.
    ///
    /// # Panics
    /// When a corner is not below the number of points.
    pub fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let surface = Surface::new(points.to_vec(), triangles.to_vec());
        let regions = surface.planar(surface.side).of_face;
        Self { surface, regions }
    }

    /// The surface's planar regions, where `side` is the largest side of its bounding box.
    pub fn planar(&self, side: f64) -> PlanarRegions {
        self.surface.planar(side)
    }

    /// What is seen of fields. `at` has for each point what each field does there; `factor` tells for a field and a point what
    /// that is to be multiplied by. O(n).
    ///
    /// # Panics
    /// When `at` is shorter than the points.
    pub fn sight<H: AsRef<Here> + Sync>(&self, at: &[H], factor: impl Fn(u32, u32) -> f64 + Sync) -> Sight {
        let fields = Strewn { at, factor };
        Sight::on(&self.surface, &fields, &fields.turned(&self.surface), &self.regions)
    }
}

/// √(Σ_v A_v E(n · d)² / A) in diagonals.
fn moved(
    surface: &Surface,
    fields: &Strewn<impl AsRef<Here> + Sync, impl Fn(u32, u32) -> f64 + Sync>,
) -> f64 {
    let diagonal = BoundingBox::of(&surface.points).map_or(0.0, |b| b.diagonal());
    let (normals, areas) = (surface.vertex_normals(), surface.vertex_areas());
    let square = |v: usize| areas[v] * fields.squared(v as u32, &normals[v]);
    let squares: Vec<f64> = (0..areas.len()).into_par_iter().map(square).collect();
    // In order, whatever the number of threads.
    (squares.iter().sum::<f64>() / surface.area).sqrt() / diagonal
}

/// Faces whose exponentials are taken at once.
const CHUNK: usize = 1 << 16;

/// |dn| of a face, Gaussian in two directions, exceeds q with probability exp(-q² / E|dn|²).
fn tail(surface: &Surface, turned: &[f64]) -> f64 {
    let faces = turned.iter().zip(&surface.facets.areas).filter(|(t, a)| **t > 0.0 && **a > 0.0);
    let faces: Vec<(f64, f64)> = faces.map(|(t, a)| (*t, *a)).collect();
    let is_beyond = |q: f64| {
        let mut sum = 0.0;
        // As soon as the first faces are too much, all are.
        faces.chunks(CHUNK).any(|faces| {
            let parts = faces.par_iter().map(|(t, a)| a * libm::exp(-q * q * a / t));
            parts.collect::<Vec<f64>>().iter().for_each(|part| sum += part);
            sum / surface.area > 0.01
        })
    };
    const HALVINGS: usize = 30;
    let most = faces.iter().map(|(t, a)| t / a).fold(0.0, f64::max);
    let (mut low, mut high) = (0.0, 3.0 * most.sqrt());
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        if is_beyond(middle) { low = middle } else { high = middle }
    }
    high
}

/// √(Σ l E|dθ|² / Σ l) over the edges that are flat.
fn flat_edges(
    surface: &Surface,
    fields: &Strewn<impl AsRef<Here> + Sync, impl Fn(u32, u32) -> f64 + Sync>,
) -> Option<f64> {
    let bent = |hinge: &Hinge| {
        let [n, m] = hinge.faces.map(|f| surface.facets.normals[f as usize]);
        let [a, b] = hinge.ends.map(|v| surface.points[v as usize]);
        let term = bend(surface, hinge, 1.0).filter(|_| n.dot(&m) > FLAT_COSINE)?;
        Some([(b - a).norm(), (b - a).norm() * fields.expectation([&term])])
    };
    let terms: Vec<[f64; 2]> = surface.hinges.par_iter().filter_map(bent).collect();
    let (length, squares) =
        terms.iter().fold((0.0, 0.0), |(l, s), [length, square]| (l + length, s + square));
    (length > 0.0 && squares > 0.0).then(|| (squares / length).sqrt())
}
