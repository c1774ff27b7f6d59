//! The shape of an original: all that is known of it before its basis is, which takes longer than all else.

use crate::error::{OriginalError, SearchError};
use crate::glance::{Glance, glance};
use crate::model::Model;
use crate::options::SearchOptions;
use crate::parts::has_parts;
use crate::stages::Stages;
use crate::suspect::Suspect;
use sombrero_mesh::{Scene, Soup};
use sombrero_registration::{Reference, RegistrationError};
use std::sync::OnceLock;

/// A model and what suspects are registered to. It knows no basis, so that suspects which are other shapes can be told without one.
#[derive(Debug)]
pub struct Outline {
    model: Model,
    /// As the file has them.
    triangles: Vec<[u32; 3]>,
    /// Computed when the first suspect asks for it.
    reference: OnceLock<Reference>,
}

impl Outline {
    /// The vertices and triangles that a file stores, and what it tells of them besides.
    ///
    /// # Errors
    /// [`OriginalError::NoFaces`] when there is no face.
    pub fn new(stored: &Soup, scene: &Scene) -> Result<Self, OriginalError> {
        // Timed for those who listen to the events; the caller times the whole.
        let mut seconds = Stages::default();
        let model = seconds.time("weld", || Model::of_scene(stored, scene));
        if seconds.time("repair", || model.repaired()).mesh.face_count() == 0 {
            return Err(OriginalError::NoFaces);
        }
        Ok(Self { model, triangles: stored.triangles.clone(), reference: OnceLock::new() })
    }

    /// A file's vertices and triangles as a suspect of this original.
    pub fn suspect(&self, stored: &Soup) -> Suspect {
        Suspect::new(stored, &self.model, &self.triangles)
    }

    /// The triangles as the file has them.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The original as the method sees it.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What suspects are registered to, computed when first asked for.
    ///
    /// # Errors
    /// [`RegistrationError`] when the surface is none that can be registered to.
    pub fn reference(&self) -> Result<&Reference, RegistrationError> {
        if let Some(made) = self.reference.get() {
            return Ok(made);
        }
        let made = Reference::new(&self.model.soup().points, &self.model.soup().triangles)?;
        Ok(self.reference.get_or_init(|| made))
    }

    /// A first look at a suspect: whether it is another shape.
    ///
    /// # Errors
    /// [`SearchError::Registration`] when registration was insisted on and cannot be done.
    pub fn glance(&self, suspect: &Suspect, options: &SearchOptions) -> Result<Glance, SearchError> {
        glance(self, suspect, options)
    }

    /// Whether it has several parts.
    pub(crate) fn has_parts(&self) -> bool {
        has_parts(self.model.soup())
    }

    /// Lets go of what only the basis needs.
    pub(crate) fn forget_repaired(&mut self) {
        self.model.forget_repaired();
    }
}
