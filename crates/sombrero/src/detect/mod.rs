//! Looks for a mark in a suspect file.

mod paper;
mod robust;
mod search;
mod trace;

pub use robust::FLOORS;
pub use trace::{Named, Rejected, Trace, Tracer};

use crate::original::Original;
use crate::timing::Stages;
use crate::{Model, PreparedBasis, Suspect, prepared_basis};
use nalgebra::{Matrix4, Point3};
use serde::Serialize;
use sombrero_basis::{Basis, BasisError};
use sombrero_extraction::{EstimateError, ExtractError};
use sombrero_io::Document;
use sombrero_registration::RegistrationError;
use sombrero_resampling::ResampleError;
use sombrero_stats::{EllipsoidError, WatermarkTestError};
use sombrero_watermark::{Key, Mismatch, OriginalDigest};
use std::sync::Arc;
use thiserror::Error;

/// How the coefficients are read and compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// What else was done to the shape is solved for too, with robust weights and standard errors; suspects of
    /// another connectivity are compared surface to surface; several tests. The default.
    #[default]
    Robust,
    /// The paper's: resampling, least squares, correlation and t test.
    Paper,
}

impl Method {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Robust => "robust",
            Self::Paper => "paper",
        }
    }
}

/// When a step of detection is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum When {
    /// The robust method takes it as the suspect asks for; the paper's tries with and without, and the better one counts.
    #[default]
    Auto,
    /// Only with it.
    Always,
    /// Only without it.
    Never,
}

/// How to look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectOptions {
    /// The method.
    pub method: Method,
    /// Whether the suspect is aligned to the original first.
    pub registration: When,
    /// Whether the suspect is resampled to the original's connectivity. The robust method does not resample, but
    /// compares surfaces; `Never` forbids that, and `Always` forbids it to use vertices that correspond.
    pub resampling: When,
    /// The mark counts as found when the probability of a chance match is at most this. Default 1e-6.
    pub threshold: f64,
    /// Seed of the points that resampling draws on the suspect. Default 0. Whoever tries several seeds and keeps
    /// the best must count them: p times the number of seeds.
    pub seed: u64,
}

impl Default for DetectOptions {
    fn default() -> Self {
        Self {
            method: Method::Robust,
            registration: When::Auto,
            resampling: When::Auto,
            threshold: 1e-6,
            seed: 0,
        }
    }
}

impl DetectOptions {
    /// Whether the question makes sense.
    fn check(&self, suspect: &Suspect) -> Result<(), DetectError> {
        if !(self.threshold > 0.0 && self.threshold <= 1.0) {
            return Err(DetectError::Threshold { threshold: self.threshold });
        }
        if suspect.soup.triangles.is_empty() {
            return Err(DetectError::NoFaces { which: "suspect" });
        }
        Ok(())
    }
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Detection {
    /// Whether the corrected p is at most the threshold.
    pub detected: bool,
    /// The probability that an unmarked mesh would match as well by chance, corrected for the number of
    /// variants; 0 when it underflows.
    pub p_value: f64,
    /// Its decimal logarithm; always finite.
    pub log10_p: f64,
    /// The threshold for p.
    pub threshold: f64,
    /// Correlation of inserted and extracted coefficients; 0 when there are too few.
    pub correlation: f64,
    /// How many coefficients the test used.
    pub coefficients_used: usize,
    /// Share of the original's area that was found on the suspect.
    pub coverage: f64,
    /// The method.
    pub method: Method,
    /// The variant that won.
    pub variant: Variant,
    /// All variants that were tried.
    pub variants: Vec<Variant>,
    /// How many variants p was corrected for: those tried, and those left out because one was certain.
    pub variants_counted: usize,
    /// How the suspect was moved onto the original; `None` when it was taken as it is.
    pub registration: Option<Alignment>,
    /// The extracted coefficients of the winning variant. For a marked copy they are nearly the secret w:
    /// keep them as carefully as the key.
    pub extracted: Vec<Option<f64>>,
    /// Where the winning variant found each point of the original, in the original's coordinates.
    #[serde(skip)]
    pub found: Vec<Option<Point3<f64>>>,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the user should know, in sentences.
    pub warnings: Vec<String>,
}

/// One way of looking.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Variant {
    /// Whether the suspect was aligned.
    pub registration: bool,
    /// Whether it was resampled; with the robust method, whether surfaces were compared instead of vertices.
    pub resampling: bool,
    /// What was solved for beside the coefficients.
    pub nuisance: &'static str,
    /// The test.
    pub test: Test,
    /// The least standard error that the ellipsoid test took, in standard deviations of the watermark; 0 for none.
    pub floor: f64,
    /// log10 p of this variant alone, uncorrected.
    pub log10_p: f64,
    /// Its correlation.
    pub correlation: f64,
}

/// How inserted and extracted coefficients are compared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Test {
    /// Correlation and t test, all coefficients alike.
    Correlation,
    /// Distance in units of standard errors.
    Ellipsoid,
}

/// A registration's result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alignment {
    /// Suspect to original, 4 × 4, row by row.
    pub matrix: [[f64; 4]; 4],
    /// Root mean square distance after it, in model units.
    pub rms: f64,
    /// Share of the original's area that has a counterpart in the suspect.
    pub overlap: f64,
    /// Iterations of the winning start.
    pub iterations: usize,
    /// Whether it came to rest.
    pub converged: bool,
}

/// Why a question cannot be answered.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DetectError {
    /// A file holds no surface.
    #[error("the {which} has no usable face; give a mesh with triangles or polygons")]
    NoFaces {
        /// Original or suspect.
        which: &'static str,
    },
    /// The threshold is no probability.
    #[error(
        "the threshold {threshold} is not a probability; give a number above 0 and at most 1, such as 1e-6"
    )]
    Threshold {
        /// What was given.
        threshold: f64,
    },
    /// The key does not belong to the original, or was edited.
    #[error(transparent)]
    Key(#[from] Mismatch),
    /// The original does not carry so many coefficients, so the key cannot be its.
    #[error("the key does not fit the original: {0}")]
    Basis(#[from] BasisError),
    /// Resampling was forbidden but is needed.
    #[error(
        "the suspect's vertices and triangles are not those of the original, so it has to be resampled; \
         leave resampling at auto"
    )]
    NeedsResampling,
    /// Registration was insisted on and cannot be done.
    #[error("the suspect cannot be registered: {0}")]
    Registration(#[from] RegistrationError),
    /// Resampling cannot be done.
    #[error("the suspect cannot be resampled: {0}")]
    Resampling(#[from] ResampleError),
    /// No variant could be tried.
    #[error("nothing could be compared: {reasons}")]
    NothingWorked {
        /// Why, in sentences.
        reasons: String,
    },
    /// The positions cannot be compared.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The surfaces cannot be compared.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// The coefficients cannot be compared.
    #[error(transparent)]
    Test(#[from] WatermarkTestError),
    /// The coefficients cannot be compared.
    #[error(transparent)]
    Ellipsoid(#[from] EllipsoidError),
}

/// An original that is ready for any number of suspects.
#[derive(Debug, Clone)]
pub struct Detector {
    original: Arc<Original>,
    key: Key,
}

impl Detector {
    /// Checks that `key` is genuine and belongs to `original`, and computes the basis.
    ///
    /// # Errors
    /// [`DetectError::Key`] or [`DetectError::Basis`] when they do not belong together.
    pub fn new(original: &Document, key: Key) -> Result<Self, DetectError> {
        Self::with_basis(original, key, None)
    }

    /// The same with a basis that was stored, which takes a fraction of the time. What is found is the same, to the
    /// bit; but see [`Detector::confirm`].
    ///
    /// # Errors
    /// [`DetectError::Key`] when key, original and basis do not belong together.
    pub fn with_prepared_basis(
        original: &Document,
        key: Key,
        stored: PreparedBasis,
    ) -> Result<Self, DetectError> {
        Self::with_basis(original, key, Some(stored))
    }

    fn with_basis(original: &Document, key: Key, stored: Option<PreparedBasis>) -> Result<Self, DetectError> {
        let digest = OriginalDigest::of(&original.content());
        key.check_watermark(&digest)?;
        let original = Original::new(original, key.parameters, stored)?;
        key.check_basis(&original.basis_digest)?;
        if original.basis.vertex_count() != original.model.soup().points.len() {
            return Err(Mismatch::Basis.into());
        }
        Ok(Self { original: Arc::new(original), key })
    }

    /// The file that [`PreparedBasis::parse`] reads. It holds the basis, which follows from the original: it is as
    /// private as that.
    pub fn to_prepared(&self) -> Vec<u8> {
        prepared_basis::write(self.basis(), &self.key)
    }

    /// Derives the basis anew and compares. After [`Detector::new`] there is nothing to confirm.
    ///
    /// Whoever wants to deceive can make up a key, and a prepared file with a basis in whose coefficients any suspect
    /// carries the key's mark. So what is found with somebody else's prepared file is worth nothing until this has
    /// been asked.
    ///
    /// # Errors
    /// [`DetectError::Key`] when the basis is not that of the original, [`DetectError::Basis`] when the original has
    /// none like it.
    pub fn confirm(&self) -> Result<(), DetectError> {
        let basis = self.original.model.basis(&self.key.parameters.basis)?;
        Ok(self.key.check_basis(&basis.digest())?)
    }

    /// The same original with another key. Costs no more than checking the key when its parameters are the same.
    ///
    /// # Errors
    /// As [`Detector::new`].
    pub fn for_key(&self, original: &Document, key: Key) -> Result<Self, DetectError> {
        if key.parameters != self.key.parameters {
            return Self::new(original, key);
        }
        key.check_watermark(&OriginalDigest::of(&original.content()))?;
        key.check_basis(&self.original.basis_digest)?;
        Ok(Self { original: Arc::clone(&self.original), key })
    }

    /// A file as a suspect of this original.
    pub fn suspect(&self, file: &Document) -> Suspect {
        self.original.suspect(file)
    }

    /// Looks for the mark in `suspect` in several ways, as far as options and suspect permit, and the best counts. Its
    /// p is multiplied by the number of ways. Further ones are left out once one is certain, but are still
    /// counted.
    ///
    /// # Errors
    /// [`DetectError`] when the question makes no sense.
    pub fn detect(&self, suspect: &Suspect, options: &DetectOptions) -> Result<Detection, DetectError> {
        options.check(suspect)?;
        match options.method {
            Method::Robust => robust::detect(self, suspect, options),
            Method::Paper => paper::detect(self, suspect, options),
        }
    }

    /// The original as the method sees it.
    pub fn model(&self) -> &Model {
        &self.original.model
    }

    /// The basis that the mark uses.
    pub fn basis(&self) -> &Basis {
        &self.original.basis
    }

    /// The key.
    pub fn key(&self) -> &Key {
        &self.key
    }
}

/// What to say of a test that rests on next to nothing.
fn few(used: usize) -> Option<String> {
    (used < 8).then(|| format!("Fewer than 8 coefficients could be compared ({used}), which proves little."))
}

/// Row by row, as people write matrices.
fn rows(matrix: &Matrix4<f64>) -> [[f64; 4]; 4] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

/// Looks for the mark of `key` in `suspect`, given the `original` that was marked.
///
/// For many suspects of one original make a [`Detector`] once.
///
/// # Errors
/// [`DetectError`] when the three do not belong together or the question cannot be answered.
pub fn detect(
    suspect: &Document,
    original: &Document,
    key: &Key,
    options: &DetectOptions,
) -> Result<Detection, DetectError> {
    let mut seconds = Stages::default();
    let detector = seconds.time("preparation", || Detector::new(original, key.clone()))?;
    let mut detection = detector.detect(&detector.suspect(suspect), options)?;
    seconds.0.append(&mut detection.seconds.0);
    detection.seconds = seconds;
    Ok(detection)
}
