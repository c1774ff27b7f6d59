//! The robust extraction: coefficients, standard errors, and everything else that was done to the shape, solved for
//! together and with robust weights.

use crate::answer::Answer;
use crate::deformation::Deformation;
use crate::fields::Fields;
use crate::nuisance::{Modes, Nuisance};
use crate::system::{MarkMatrix, Solution};
use crate::warp::Warp;
use nalgebra::{DMatrix, Point3, Vector3};
use rayon::prelude::*;
use sombrero_basis::Basis;
use sombrero_mesh::Soup;
use sombrero_spatial::{Rim, Surface};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use thiserror::Error;

/// An original that is ready for extraction from any number of suspects.
#[derive(Debug)]
pub struct Extractor {
    pub(crate) original: Soup,
    pub(crate) mark_matrix: MarkMatrix,
    /// The largest side of the bounding box.
    pub(crate) side: f64,
    pub(crate) rim: Rim,
    /// The original's surface, as often as suspects were looked at side by side: each deforms one.
    surfaces: Mutex<Vec<Surface>>,
    /// The fields of each of [`Modes::ALL`], prepared when the first suspect asks for them.
    modes: [OnceLock<Vec<Vec<Vector3<f64>>>>; Modes::ALL.len()],
    /// The kernels of [`Deformation::Warp`], likewise.
    warp: OnceLock<Warp>,
}

/// The estimate of w* that one suspect gives.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Estimate {
    /// w*, one entry for each basis function, in units of the watermark's standard deviation; 0 where the suspect
    /// says nothing.
    pub coefficients: Vec<f64>,
    /// The standard error of each, if residuals were independent; infinite where the suspect says nothing.
    pub standard_errors: Vec<f64>,
    /// P, m × m: the inverse of the covariance of the errors of w*, 0 in directions that the suspect does not show.
    pub precision: DMatrix<f64>,
    /// Where each vertex of the original is, by this estimate, in the frame of the suspect as it was given: model
    /// units. Also for vertices that the suspect does not have.
    pub positions: Vec<Point3<f64>>,
    /// Which vertices the suspect has.
    pub present: Vec<bool>,
    /// Root mean square of what the estimate leaves unexplained, outliers left out, in model units.
    pub residual_rms: f64,
    /// Share of the observations that were used with some weight, 0 to 1.
    pub used: f64,
    /// How many solves it took.
    pub iterations: usize,
    /// Whether the last one changed hardly anything.
    pub converged: bool,
}

/// A question that an [`Extractor`] cannot answer.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// The basis belongs to another mesh.
    #[error("the basis has {basis} vertices and the original {original}; both must be of the same mesh")]
    Basis {
        /// Rows of the basis.
        basis: usize,
        /// Points of the original.
        original: usize,
    },
    /// Not one entry for each vertex of the original.
    #[error(
        "{found} vertices of the suspect were given for the original's {original}; give an entry for each"
    )]
    Lengths {
        /// Entries given.
        found: usize,
        /// Points of the original.
        original: usize,
    },
    /// A corner of a face, or a position, is not usable.
    #[error(
        "vertex {vertex} of the {which} is missing or has a coordinate that is not finite; repair the mesh"
    )]
    Vertex {
        /// Original or suspect.
        which: &'static str,
        /// Its index.
        vertex: usize,
    },
    /// There is no surface to look at.
    #[error("the {which} has no face with an area; extraction needs a surface")]
    NoArea {
        /// Original or suspect.
        which: &'static str,
    },
}

impl Extractor {
    /// An extractor for marks of strength `epsilon` in `original`, the points and triangles that `basis` was built on.
    ///
    /// # Errors
    /// [`EstimateError`] when they do not belong together or the original has no surface.
    pub fn new(basis: &Basis, epsilon: f64, original: &Soup) -> Result<Self, EstimateError> {
        if basis.vertex_count() != original.points.len() {
            let (basis, original) = (basis.vertex_count(), original.points.len());
            return Err(EstimateError::Basis { basis, original });
        }
        check(&original.points, &original.triangles, "original")?;
        let side = original.bounding_box().map_or(0.0, |b| b.largest_side());
        if side <= 0.0 {
            return Err(EstimateError::NoArea { which: "original" });
        }
        Ok(Self {
            mark_matrix: MarkMatrix::new(basis, epsilon),
            side,
            rim: Rim::new(&original.triangles),
            original: original.clone(),
            surfaces: Mutex::default(),
            modes: Default::default(),
            warp: OnceLock::new(),
        })
    }

    pub(crate) fn fields(&self, nuisance: Nuisance) -> Fields<'_> {
        let prepared =
            |modes: &Modes| self.modes[*modes as usize].get_or_init(|| modes.fields(&self.original));
        let warp = (nuisance.deformation == Deformation::Warp)
            .then(|| self.warp.get_or_init(|| Warp::new(&self.original, self.side)));
        let modes = nuisance.modes.iter().flat_map(prepared).collect();
        Fields::new(&self.original, nuisance.deformation, modes, warp)
    }

    /// A surface in the shape of the original, to be deformed.
    pub(crate) fn surface(&self) -> Surface {
        let Soup { points, triangles } = &self.original;
        // Not in the match, which would hold the lock while other threads are asked to help.
        let idle = self.idle().pop();
        match idle {
            Some(mut surface) => {
                surface.refit(points);
                surface
            }
            None => Surface::new(points, triangles),
        }
    }

    /// For the next suspect: deforming a surface back is several times faster than making one.
    pub(crate) fn give_back(&self, surface: Surface) {
        self.idle().push(surface);
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Surface>> {
        // Whatever happened to who held the lock, each surface in the list is whole.
        self.surfaces.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// v + B w + N β.
    pub(crate) fn positions(&self, fields: &Fields, solution: &Solution) -> Vec<Point3<f64>> {
        let moved = |(v, p): (u32, &Point3<f64>)| {
            p + self.mark_matrix.displacement(v, &solution.w)
                + fields.displacement(v, solution.beta.as_slice())
        };
        (0..self.original.points.len() as u32).into_par_iter().zip(&self.original.points).map(moved).collect()
    }
}

/// All corners exist and are finite.
pub(crate) fn check(
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    which: &'static str,
) -> Result<(), EstimateError> {
    let usable = |v: u32| points.get(v as usize).is_some_and(|p| p.coords.iter().all(|x| x.is_finite()));
    match triangles.iter().flatten().find(|&&v| !usable(v)) {
        Some(&vertex) => Err(EstimateError::Vertex { which, vertex: vertex as usize }),
        None => Ok(()),
    }
}

impl Estimate {
    /// w*, `None` where the suspect says nothing: as a test that weighs all coefficients alike wants it.
    pub fn known(&self) -> Vec<Option<f64>> {
        let pairs = self.coefficients.iter().zip(&self.standard_errors);
        pairs.map(|(w, error)| error.is_finite().then_some(*w)).collect()
    }

    pub(crate) fn new(
        solution: &Solution,
        weights: &[f64],
        variance: f64,
        positions: Vec<Point3<f64>>,
        present: Vec<bool>,
        (iterations, converged): (usize, bool),
    ) -> Self {
        let answer = Answer::new(solution);
        let used = weights.iter().filter(|w| **w > 0.0).count();
        Self {
            coefficients: answer.coefficients,
            standard_errors: answer.errors.iter().map(|e| e * variance.sqrt()).collect(),
            precision: answer.precision / variance,
            positions,
            present,
            residual_rms: variance.sqrt(),
            used: used as f64 / weights.len().max(1) as f64,
            iterations,
            converged,
        }
    }
}
