//! Looks for a mark in a suspect file.

use crate::timing::Stages;
use crate::{Model, Suspect};
use nalgebra::{Point3, Similarity3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero_basis::{Basis, BasisError};
use sombrero_extraction::{ExtractError, Extraction, extract};
use sombrero_io::Document;
use sombrero_mesh::Soup;
use sombrero_registration::{Reference, RegisterOptions, Registration, RegistrationError, register};
use sombrero_resampling::{ResampleError, ResampleOptions, resample};
use sombrero_stats::{WatermarkTest, WatermarkTestError, WatermarkTestOptions, best_of, watermark_test};
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
    /// Whether the suspect is aligned to the original first.
    pub registration: Step,
    /// Whether the suspect is resampled to the original's connectivity.
    pub resampling: Step,
    /// The mark counts as found when the probability of a chance match is at most this. Default 1e-6.
    pub threshold: f64,
    /// Seed of the points that resampling draws on the suspect. Default 0. Whoever tries several seeds and keeps
    /// the best must count them: p times the number of seeds.
    pub seed: u64,
}

impl Default for DetectOptions {
    fn default() -> Self {
        Self { registration: Step::Auto, resampling: Step::Auto, threshold: 1e-6, seed: 0 }
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
        Ok(Self { model, basis, key, triangles: original.triangles().to_vec() })
    }

    /// A file as a suspect of this original.
    pub fn suspect(&self, file: &Document) -> Suspect {
        Suspect::new(file, &self.model, &self.triangles)
    }

    /// Looks for the mark in `suspect`: with and without registration, with and without resampling, as far
    /// as options and suspect permit, and the best counts (the paper, section 5). Its p is multiplied by the
    /// number of variants. Further variants are left out once one is certain, but are still counted.
    ///
    /// # Errors
    /// [`DetectError`] when the question makes no sense.
    pub fn detect(&self, suspect: &Suspect, options: &DetectOptions) -> Result<Detection, DetectError> {
        if !(options.threshold > 0.0 && options.threshold <= 1.0) {
            return Err(DetectError::Threshold { threshold: options.threshold });
        }
        if suspect.soup.triangles.is_empty() {
            return Err(DetectError::NoFaces { which: "suspect" });
        }
        let plan = plan(options, suspect.correspondence.is_some())?;
        let mut search = Search::new(self, suspect, options);
        for &(registration, resampling) in &plan {
            search.attempt(registration, resampling)?;
            if search.is_certain(plan.len()) {
                break;
            }
        }
        search.finish(plan.len())
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
        // An empty sum is -0, which nobody wants to read.
        let covered: f64 = 0.0 + soup.triangles.iter().filter(present).map(area).sum::<f64>();
        if total > 0.0 { covered / total } else { 0.0 }
    }
}

/// The variants to try as (registration, resampling), cheapest first.
fn plan(options: &DetectOptions, corresponds: bool) -> Result<Vec<(bool, bool)>, DetectError> {
    let choices = |step: Step| -> &[bool] {
        match step {
            Step::Auto => &[false, true],
            Step::Always => &[true],
            Step::Never => &[false],
        }
    };
    let resampling = choices(options.resampling).iter().copied().filter(|&yes| yes || corresponds);
    let plan: Vec<(bool, bool)> = resampling
        .flat_map(|second| choices(options.registration).iter().map(move |&first| (first, second)))
        .collect();
    if plan.is_empty() { Err(DetectError::NeedsResampling) } else { Ok(plan) }
}

/// One detection under way.
struct Search<'a> {
    prepared: &'a Prepared,
    suspect: &'a Suspect,
    options: &'a DetectOptions,
    /// Computed when the first variant asks for it.
    registration: Option<Registration>,
    outcomes: Vec<Outcome>,
    seconds: Stages,
    warnings: Vec<String>,
}

/// What one variant gave.
struct Outcome {
    variant: Variant,
    test: WatermarkTest,
    extraction: Extraction,
    found: Vec<Option<Point3<f64>>>,
}

impl<'a> Search<'a> {
    fn new(prepared: &'a Prepared, suspect: &'a Suspect, options: &'a DetectOptions) -> Self {
        let (outcomes, seconds, warnings) = (Vec::new(), Stages::default(), Vec::new());
        Self { prepared, suspect, options, registration: None, outcomes, seconds, warnings }
    }

    /// Tries one variant. A step that cannot be done is a warning, unless the user insisted on it.
    fn attempt(&mut self, registration: bool, resampling: bool) -> Result<(), DetectError> {
        let insisted = (registration && self.options.registration == Step::Always)
            || (resampling && self.options.resampling == Step::Always);
        match self.attempt_or_fail(registration, resampling) {
            Err(error @ (DetectError::Registration(_) | DetectError::Resampling(_))) if !insisted => {
                let sentence = format!("A variant was left out: {error}.");
                if !self.warnings.contains(&sentence) {
                    self.warnings.push(sentence);
                }
                Ok(())
            }
            other => other,
        }
    }

    fn attempt_or_fail(&mut self, registration: bool, resampling: bool) -> Result<(), DetectError> {
        let similarity = if registration { self.register()? } else { Similarity3::identity() };
        let found: Vec<Option<Point3<f64>>> = match &self.suspect.correspondence {
            Some(known) if !resampling => known.iter().map(|p| p.map(|p| similarity * p)).collect(),
            _ => self.resample(&similarity)?,
        };
        let Prepared { model, basis, key, .. } = self.prepared;
        let points = &model.soup().points;
        let extraction =
            self.seconds.time("extraction", || extract(basis, key.parameters.epsilon, points, &found))?;
        let test =
            watermark_test(&key.watermark, &extraction.coefficients, &WatermarkTestOptions::default())?;
        let variant = Variant { registration, resampling, log10_p: test.log10_p(), correlation: test.rho() };
        self.outcomes.push(Outcome { variant, test, extraction, found });
        Ok(())
    }

    fn register(&mut self) -> Result<Similarity3<f64>, DetectError> {
        if let Some(known) = &self.registration {
            return Ok(known.reference_from_suspect);
        }
        let (original, suspect) = (self.prepared.model.soup(), &self.suspect.soup);
        let found = self.seconds.time("registration", || {
            let reference = Reference::new(&original.points, &original.triangles)?;
            register(&reference, &suspect.points, &suspect.triangles, &RegisterOptions::default())
        })?;
        let similarity = found.reference_from_suspect;
        self.registration = Some(found);
        Ok(similarity)
    }

    fn resample(&mut self, similarity: &Similarity3<f64>) -> Result<Vec<Option<Point3<f64>>>, DetectError> {
        let moved = self.suspect.soup.points.iter().map(|p| similarity * p).collect();
        let suspect = Soup::new(moved, self.suspect.soup.triangles.clone());
        let mut rng = ChaCha8Rng::seed_from_u64(self.options.seed);
        let original = self.prepared.model.soup();
        let resampled = self
            .seconds
            .time("resampling", || resample(original, &suspect, &ResampleOptions::default(), &mut rng))?;
        Ok(resampled.positions)
    }

    /// Whether the best variant so far stays found by a wide margin whatever the others would give.
    fn is_certain(&self, planned: usize) -> bool {
        /// Orders of magnitude below the threshold.
        const MARGIN: f64 = 12.0;
        let best = self.outcomes.iter().map(|o| o.variant.log10_p).fold(0.0, f64::min);
        best + (planned as f64).log10() <= self.options.threshold.log10() - MARGIN
    }

    fn finish(mut self, planned: usize) -> Result<Detection, DetectError> {
        let variants: Vec<Variant> = self.outcomes.iter().map(|o| o.variant).collect();
        let best = (0..variants.len()).min_by(|&i, &j| variants[i].log10_p.total_cmp(&variants[j].log10_p));
        let Some(best) = best.map(|i| self.outcomes.swap_remove(i)) else {
            return Err(DetectError::NothingWorked { reasons: self.warnings.join(" ") });
        };
        let p = best_of(best.test.p, planned);
        let aligned = self.registration.filter(|_| best.variant.registration);
        if best.test.used < 8 {
            self.warnings.push(format!(
                "Fewer than 8 coefficients could be compared ({}), which proves little.",
                best.test.used
            ));
        }
        Ok(Detection {
            detected: p.log10() <= self.options.threshold.log10(),
            p_value: p.p(),
            log10_p: p.log10(),
            threshold: self.options.threshold,
            correlation: best.variant.correlation,
            coefficients_used: best.test.used,
            coverage: self.prepared.coverage(&best.found),
            method: "paper",
            variant: best.variant,
            variants,
            variants_counted: planned,
            registration: aligned.map(|r| Alignment::new(&r)),
            extracted: best.extraction.coefficients,
            found: best.found,
            seconds: self.seconds,
            warnings: self.warnings,
        })
    }
}

impl Alignment {
    fn new(registration: &Registration) -> Self {
        let m = registration.reference_from_suspect.to_homogeneous();
        let matrix = std::array::from_fn(|row| std::array::from_fn(|column| m[(row, column)]));
        let Registration { rms, overlap, iterations, converged, .. } = *registration;
        Self { matrix, rms, overlap, iterations, converged }
    }
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
    let mut detection = prepared.detect(&prepared.suspect(suspect), options)?;
    seconds.0.append(&mut detection.seconds.0);
    detection.seconds = seconds;
    Ok(detection)
}
