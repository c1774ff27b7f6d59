//! An original that is ready for any number of suspects and keys. It holds no key (Law 1): what is computed here
//! cannot depend on a watermark.

use crate::detect::DetectError;
use crate::timing::Stages;
use crate::{Model, PreparedBasis, Suspect};
use nalgebra::Point3;
use sombrero_basis::Basis;
use sombrero_extraction::{EstimateError, Extractor};
use sombrero_io::Document;
use sombrero_registration::{Reference, RegistrationError};
use sombrero_watermark::Parameters;
use std::sync::OnceLock;

/// What all keys of one original and the same parameters share.
#[derive(Debug)]
pub(crate) struct Original {
    pub(crate) parameters: Parameters,
    pub(crate) model: Model,
    pub(crate) basis: Basis,
    /// [`Basis::digest`].
    pub(crate) basis_digest: [u8; 32],
    /// As the file has them.
    triangles: Vec<[u32; 3]>,
    /// Computed when the first suspect asks for them.
    extractor: OnceLock<Extractor>,
    reference: OnceLock<Reference>,
}

impl Original {
    /// Takes the stored basis at its word; without one it is computed.
    pub(crate) fn new(
        file: &Document,
        parameters: Parameters,
        stored: Option<PreparedBasis>,
    ) -> Result<Self, DetectError> {
        // Timed for those who listen to the events; the caller times the whole.
        let mut seconds = Stages::default();
        let mut model = seconds.time("weld", || Model::new(&file.soup()));
        if seconds.time("repair", || model.repaired()).mesh.face_count() == 0 {
            return Err(DetectError::NoFaces { which: "original" });
        }
        let basis = match stored {
            Some(PreparedBasis(basis)) => basis,
            None => {
                let mut progressive = seconds.time("conversion", || model.progressive());
                seconds.time("basis", || model.basis_of(&mut progressive, &parameters.basis))?
            }
        };
        model.forget_repaired();
        let (extractor, reference) = (OnceLock::new(), OnceLock::new());
        Ok(Self {
            parameters,
            model,
            basis_digest: basis.digest(),
            basis,
            triangles: file.triangles().to_vec(),
            extractor,
            reference,
        })
    }

    /// A file as a suspect of this original.
    pub(crate) fn suspect(&self, file: &Document) -> Suspect {
        Suspect::new(file, &self.model, &self.triangles)
    }

    pub(crate) fn extractor(&self) -> Result<&Extractor, EstimateError> {
        if let Some(made) = self.extractor.get() {
            return Ok(made);
        }
        let made = Extractor::new(&self.basis, self.parameters.epsilon, self.model.soup())?;
        Ok(self.extractor.get_or_init(|| made))
    }

    pub(crate) fn reference(&self) -> Result<&Reference, RegistrationError> {
        if let Some(made) = self.reference.get() {
            return Ok(made);
        }
        let made = Reference::new(&self.model.soup().points, &self.model.soup().triangles)?;
        Ok(self.reference.get_or_init(|| made))
    }

    /// Share of the area whose three corners were found.
    pub(crate) fn coverage(&self, found: &[Option<Point3<f64>>]) -> f64 {
        let soup = self.model.soup();
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
