//! An original that is ready for any number of suspects. It holds no key (Law 1): what is computed here cannot depend
//! on a watermark.

use crate::error::OriginalError;
use crate::model::Model;
use crate::outline::Outline;
use crate::parts::{Part, parts};
use crate::stages::Stages;
use crate::suspect::Suspect;
use nalgebra::Point3;
use sombrero_basis::{Basis, BasisOptions};
use sombrero_extraction::{EstimateError, Extractor};
use sombrero_mesh::{Scene, Soup};
use sombrero_registration::{Reference, RegistrationError};
use std::sync::OnceLock;

/// A model, the basis over its points, and what is computed from them once for all suspects.
#[derive(Debug)]
pub struct Original {
    outline: Outline,
    basis: Basis,
    /// [`Basis::digest`].
    basis_digest: [u8; 32],
    epsilon: f64,
    /// Computed when the first suspect asks for them.
    extractor: OnceLock<Extractor>,
    parts: OnceLock<Vec<Part>>,
}

impl Original {
    /// The vertices and triangles that a file stores, with the basis computed. Coefficient 1 moves the centre of its
    /// function by `epsilon` times the function's amplitude.
    ///
    /// # Errors
    /// [`OriginalError`] when there is no face or the mesh cannot carry the basis.
    pub fn new(stored: &Soup, options: &BasisOptions, epsilon: f64) -> Result<Self, OriginalError> {
        Self::of_scene(stored, &Scene::default(), options, epsilon)
    }

    /// [`Original::new`] with what a file tells of its vertices besides.
    ///
    /// # Errors
    /// As [`Original::new`].
    pub fn of_scene(
        stored: &Soup,
        scene: &Scene,
        options: &BasisOptions,
        epsilon: f64,
    ) -> Result<Self, OriginalError> {
        Self::of_outline(Outline::new(stored, scene)?, options, epsilon)
    }

    /// [`Original::of_scene`] of what is known already.
    ///
    /// # Errors
    /// [`OriginalError::Basis`] when the mesh cannot carry the basis.
    pub fn of_outline(outline: Outline, options: &BasisOptions, epsilon: f64) -> Result<Self, OriginalError> {
        // Timed for those who listen to the events; the caller times the whole.
        let mut seconds = Stages::default();
        let progressive = seconds.time("conversion", || outline.model().converted());
        let basis = seconds.time("basis", || outline.model().basis_for(progressive, options, epsilon))?;
        Self::with_basis(outline, basis, epsilon)
    }

    /// [`Original::of_outline`] with a basis that was computed before, which is taken at its word.
    ///
    /// # Errors
    /// [`OriginalError::OtherBasis`] when the basis has another number of points.
    pub fn with_basis(mut outline: Outline, basis: Basis, epsilon: f64) -> Result<Self, OriginalError> {
        let (rows, points) = (basis.vertex_count(), outline.model().soup().points.len());
        if rows != points {
            return Err(OriginalError::OtherBasis { rows, points });
        }
        outline.forget_repaired();
        let (extractor, parts) = (OnceLock::new(), OnceLock::new());
        Ok(Self { outline, basis_digest: basis.digest(), basis, epsilon, extractor, parts })
    }

    /// What is known of it without the basis.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// A file's vertices and triangles as a suspect of this original.
    pub fn suspect(&self, stored: &Soup) -> Suspect {
        self.outline.suspect(stored)
    }

    /// The triangles as the file has them.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.outline.triangles()
    }

    /// The original as the method sees it.
    pub fn model(&self) -> &Model {
        self.outline.model()
    }

    /// The basis, over the model's points.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// [`Basis::digest`] of the basis.
    pub fn basis_digest(&self) -> &[u8; 32] {
        &self.basis_digest
    }

    /// ε, the strength in units of which coefficients are estimated.
    pub fn epsilon(&self) -> f64 {
        self.epsilon
    }

    /// What estimates coefficients, computed when first asked for.
    ///
    /// # Errors
    /// [`EstimateError`] when basis, ε and points do not permit it.
    pub fn extractor(&self) -> Result<&Extractor, EstimateError> {
        if let Some(made) = self.extractor.get() {
            return Ok(made);
        }
        let made = Extractor::new(&self.basis, self.epsilon, self.model().soup())?;
        Ok(self.extractor.get_or_init(|| made))
    }

    /// What suspects are registered to, computed when first asked for.
    ///
    /// # Errors
    /// [`RegistrationError`] when the surface is none that can be registered to.
    pub fn reference(&self) -> Result<&Reference, RegistrationError> {
        self.outline.reference()
    }

    /// Whether it has several parts.
    pub(crate) fn has_parts(&self) -> bool {
        self.outline.has_parts()
    }

    /// The parts that carry something, computed when first asked for.
    pub(crate) fn parts(&self) -> &[Part] {
        if let Some(made) = self.parts.get() {
            return made;
        }
        let made = parts(self.model().soup(), &self.basis, self.epsilon);
        self.parts.get_or_init(|| made)
    }

    /// Share of the area, 0 to 1, whose three corners were found. `found` has an entry for each of the model's points.
    ///
    /// # Panics
    /// When `found` is shorter.
    pub fn coverage(&self, found: &[Option<Point3<f64>>]) -> f64 {
        let soup = self.model().soup();
        let area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| &soup.points[v as usize]);
            sombrero_mesh::geometry::area_vector(a, b, c).norm()
        };
        let present = |corners: &&[u32; 3]| corners.iter().all(|&v| found[v as usize].is_some());
        let total: f64 = soup.triangles.iter().map(area).sum();
        // An empty sum is -0, which nobody wants to read.
        let covered: f64 = 0.0 + soup.triangles.iter().filter(present).map(area).sum::<f64>();
        if total > 0.0 { covered / total } else { 0.0 }
    }
}
