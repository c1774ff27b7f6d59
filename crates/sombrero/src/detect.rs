//! Looks for a mark in a suspect file.

use crate::Model;
use crate::timing::Stages;
use nalgebra::Point3;
use serde::Serialize;
use sombrero_basis::{Basis, BasisError};
use sombrero_extraction::{ExtractError, extract};
use sombrero_io::Document;
use sombrero_stats::{
    LogProbability, WatermarkTest, WatermarkTestError, WatermarkTestOptions, select, watermark_test,
};
use sombrero_watermark::{Key, Mismatch};
use thiserror::Error;

/// When a step of detection is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Step {
    /// With and without, and the better one counts.
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
    /// Whether the suspect is aligned to the original first. This version cannot; `Always` is an error.
    pub registration: Step,
    /// Whether the suspect is resampled to the original's connectivity. This version cannot; `Always` is an
    /// error.
    pub resampling: Step,
    /// The mark counts as found when the probability of a chance match is at most this. Default 1e-6.
    pub threshold: f64,
}

impl Default for DetectOptions {
    fn default() -> Self {
        Self { registration: Step::Auto, resampling: Step::Auto, threshold: 1e-6 }
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
    pub method: &'static str,
    /// The variant that won.
    pub variant: Variant,
    /// All variants that were tried.
    pub variants: Vec<Variant>,
    /// How the suspect was moved onto the original; `None` when it was taken as it is.
    pub registration: Option<Alignment>,
    /// The extracted coefficients of the winning variant.
    pub extracted: Vec<Option<f64>>,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the user should know, in sentences.
    pub warnings: Vec<String>,
}

/// One way of looking.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Variant {
    /// Whether the suspect was aligned.
    pub registration: bool,
    /// Whether it was resampled.
    pub resampling: bool,
    /// log10 p of this variant alone, uncorrected.
    pub log10_p: f64,
    /// Its correlation.
    pub correlation: f64,
}

/// A registration's result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alignment {
    /// Suspect to original, 4 × 4, row by row.
    pub matrix: [[f64; 4]; 4],
    /// Root mean square distance after it, in model units.
    pub rms: f64,
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
    /// The suspect was reordered, cropped, simplified or remeshed.
    #[error(
        "the suspect has {suspect_vertices} vertices and {suspect_faces} triangles, the original \
         {original_vertices} and {original_faces}, or they are connected differently: it would have to be \
         resampled, which this version cannot do yet"
    )]
    NeedsResampling {
        /// Stored vertices of the suspect.
        suspect_vertices: usize,
        /// Its triangles.
        suspect_faces: usize,
        /// Stored vertices of the original.
        original_vertices: usize,
        /// Its triangles.
        original_faces: usize,
    },
    /// A step was asked for that does not exist.
    #[error("{step} was asked for, which this version cannot do yet; leave it at auto or never")]
    NotAvailable {
        /// The step.
        step: &'static str,
    },
    /// The positions cannot be compared.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The coefficients cannot be compared.
    #[error(transparent)]
    Test(#[from] WatermarkTestError),
}

/// An original that is ready for any number of suspects.
#[derive(Debug, Clone)]
pub struct Prepared {
    model: Model,
    basis: Basis,
    key: Key,
    vertices: usize,
    triangles: Vec<[u32; 3]>,
}

impl Prepared {
    /// Checks that `key` is genuine and belongs to `original`, and computes the basis.
    ///
    /// # Errors
    /// [`DetectError::Key`] or [`DetectError::Basis`] when they do not belong together.
    pub fn new(original: &Document, key: Key) -> Result<Self, DetectError> {
        key.check_original(original.bytes())?;
        let model = Model::new(&original.soup());
        if model.repaired().mesh.face_count() == 0 {
            return Err(DetectError::NoFaces { which: "original" });
        }
        let basis = model.basis(&key.parameters.basis)?;
        key.check(original.bytes(), &basis)?;
        let triangles = original.triangles().to_vec();
        Ok(Self { model, basis, key, vertices: original.points().len(), triangles })
    }

    /// Looks for the mark in `suspect`.
    ///
    /// # Errors
    /// [`DetectError`] when the question makes no sense or needs what this version cannot do.
    pub fn detect(&self, suspect: &Document, options: &DetectOptions) -> Result<Detection, DetectError> {
        check_options(options)?;
        if suspect.triangles().is_empty() {
            return Err(DetectError::NoFaces { which: "suspect" });
        }
        if suspect.points().len() != self.vertices || suspect.triangles() != self.triangles {
            return Err(DetectError::NeedsResampling {
                suspect_vertices: suspect.points().len(),
                suspect_faces: suspect.triangles().len(),
                original_vertices: self.vertices,
                original_faces: self.triangles.len(),
            });
        }
        let positions = self.model.points_from_stored(suspect.points());
        self.detect_points(&positions.into_iter().map(Some).collect::<Vec<_>>(), options)
    }

    /// Looks for the mark in positions whose correspondence is known: `found[j]` is where point j of
    /// [`model`](Self::model) is on the suspect, or `None` when it is missing.
    ///
    /// # Errors
    /// [`DetectError`] when lengths differ, a position is not finite or an option makes no sense.
    pub fn detect_points(
        &self,
        found: &[Option<Point3<f64>>],
        options: &DetectOptions,
    ) -> Result<Detection, DetectError> {
        check_options(options)?;
        let mut seconds = Stages::default();
        let points = &self.model.soup().points;
        let epsilon = self.key.parameters.epsilon;
        let extraction = seconds.time("extraction", || extract(&self.basis, epsilon, points, found))?;
        let test = seconds.time("test", || {
            watermark_test(&self.key.watermark, &extraction.coefficients, &WatermarkTestOptions::default())
        })?;
        let variant = Variant {
            registration: false,
            resampling: false,
            log10_p: test.log10_p(),
            correlation: test.rho(),
        };
        let p = select(&[test.p]).map_or(LogProbability::ONE, |selection| selection.p);
        let detected = p.log10() <= options.threshold.log10();
        Ok(Detection {
            detected,
            p_value: p.p(),
            log10_p: p.log10(),
            threshold: options.threshold,
            correlation: variant.correlation,
            coefficients_used: test.used,
            coverage: self.coverage(found),
            method: "paper",
            variant,
            variants: vec![variant],
            registration: None,
            warnings: self.warnings(found, &test, detected),
            extracted: extraction.coefficients,
            seconds,
        })
    }

    /// The original as the method sees it.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The basis that the mark uses.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// The key.
    pub fn key(&self) -> &Key {
        &self.key
    }

    /// Share of the original's area whose three corners were found.
    fn coverage(&self, found: &[Option<Point3<f64>>]) -> f64 {
        let soup = self.model.soup();
        let area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| &soup.points[v as usize]);
            sombrero_mesh::geometry::area_vector(a, b, c).norm()
        };
        let present = |corners: &&[u32; 3]| corners.iter().all(|&v| found[v as usize].is_some());
        let total: f64 = soup.triangles.iter().map(area).sum();
        let covered: f64 = soup.triangles.iter().filter(present).map(area).sum();
        if total > 0.0 { covered / total } else { 0.0 }
    }

    fn warnings(&self, found: &[Option<Point3<f64>>], test: &WatermarkTest, detected: bool) -> Vec<String> {
        let mut warnings = Vec::new();
        let relative = self.rms_distance(found) / self.model.largest_side();
        if !detected && relative > 0.01 {
            warnings.push(format!(
                "The suspect's vertices are {:.1} % of the model's size away from the original's (root mean \
                 square): it was probably moved, turned or scaled and would have to be registered, which this \
                 version cannot do yet.",
                100.0 * relative
            ));
        }
        if test.used < 8 {
            warnings.push(format!("Only {} coefficients could be compared, which proves little.", test.used));
        }
        warnings
    }

    fn rms_distance(&self, found: &[Option<Point3<f64>>]) -> f64 {
        let pairs = || found.iter().zip(&self.model.soup().points).filter_map(|(f, p)| f.map(|f| f - p));
        (pairs().map(|d| d.norm_squared()).sum::<f64>() / pairs().count().max(1) as f64).sqrt()
    }
}

fn check_options(options: &DetectOptions) -> Result<(), DetectError> {
    if !(options.threshold > 0.0 && options.threshold <= 1.0) {
        return Err(DetectError::Threshold { threshold: options.threshold });
    }
    for (step, when) in [("registration", options.registration), ("resampling", options.resampling)] {
        if when == Step::Always {
            return Err(DetectError::NotAvailable { step });
        }
    }
    Ok(())
}

/// Looks for the mark of `key` in `suspect`, given the `original` that was marked.
///
/// For many suspects of one original make a [`Prepared`] once.
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
    let prepared = seconds.time("preparation", || Prepared::new(original, key.clone()))?;
    let mut detection = prepared.detect(suspect, options)?;
    seconds.0.append(&mut detection.seconds.0);
    detection.seconds = seconds;
    Ok(detection)
}
