//! The paper's method: with and without registration, with and without resampling, and the best counts.

use super::detection::{Alignment, Detection, Variant, few};
use super::error::DetectError;
use super::options::{DetectOptions, Method};
use nalgebra::{Point3, Similarity3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero_extraction::{Extraction, extract};
use sombrero_mesh::Soup;
use sombrero_registration::{RegisterOptions, Registration, register};
use sombrero_resampling::{ResampleOptions, resample};
use sombrero_search::{Look, Original, SearchError, Stages, Suspect, When};
use sombrero_stats::{Statistic, WatermarkTest, WatermarkTestOptions, best_of, watermark_test};

pub(super) fn detect(
    original: &Original,
    watermark: &[f64],
    suspect: &Suspect,
    options: &DetectOptions,
) -> Result<Detection, DetectError> {
    let plan = plan(options, suspect.correspondence.is_some())?;
    let mut attempts = Attempts::new(original, watermark, suspect, options);
    for &(registration, resampling) in &plan {
        attempts.attempt(registration, resampling)?;
        if attempts.is_certain(plan.len()) {
            break;
        }
    }
    attempts.finish(plan.len())
}

/// The variants to try as (registration, resampling), cheapest first.
fn plan(options: &DetectOptions, corresponds: bool) -> Result<Vec<(bool, bool)>, DetectError> {
    let choices = |step: When| -> &[bool] {
        match step {
            When::Auto => &[false, true],
            When::Always => &[true],
            When::Never => &[false],
        }
    };
    let resampling = choices(options.resampling).iter().copied().filter(|&yes| yes || corresponds);
    let plan: Vec<(bool, bool)> = resampling
        .flat_map(|second| choices(options.registration).iter().map(move |&first| (first, second)))
        .collect();
    if plan.is_empty() { Err(SearchError::NeedsResampling.into()) } else { Ok(plan) }
}

/// One detection under way.
struct Attempts<'a> {
    original: &'a Original,
    watermark: &'a [f64],
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

impl<'a> Attempts<'a> {
    fn new(
        original: &'a Original,
        watermark: &'a [f64],
        suspect: &'a Suspect,
        options: &'a DetectOptions,
    ) -> Self {
        let (outcomes, seconds, warnings) = (Vec::new(), Stages::default(), Vec::new());
        Self { original, watermark, suspect, options, registration: None, outcomes, seconds, warnings }
    }

    /// Tries one variant. A step that cannot be done is a warning, unless the user insisted on it.
    fn attempt(&mut self, registration: bool, resampling: bool) -> Result<(), DetectError> {
        let insisted = (registration && self.options.registration == When::Always)
            || (resampling && self.options.resampling == When::Always);
        match self.attempt_or_fail(registration, resampling) {
            Err(error @ (DetectError::Search(SearchError::Registration(_)) | DetectError::Resampling(_)))
                if !insisted =>
            {
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
        let (basis, epsilon) = (self.original.basis(), self.original.epsilon());
        let points = &self.original.model().soup().points;
        let extraction = self.seconds.time("extraction", || extract(basis, epsilon, points, &found))?;
        let test =
            watermark_test(self.watermark, &extraction.coefficients, &WatermarkTestOptions::default())?;
        let variant = Variant {
            registration,
            look: Look::Whole.name(),
            resampling,
            nuisance: "none",
            test: Statistic::CORRELATION,
            floor: 0.0,
            log10_p: test.log10_p(),
            correlation: test.rho(),
        };
        self.outcomes.push(Outcome { variant, test, extraction, found });
        Ok(())
    }

    fn register(&mut self) -> Result<Similarity3<f64>, DetectError> {
        if let Some(known) = &self.registration {
            return Ok(known.best.reference_from_suspect);
        }
        let (original, suspect) = (self.original, &self.suspect.soup);
        let options = RegisterOptions::default();
        let found = self.seconds.time("registration", || {
            register(original.reference()?, &suspect.points, &suspect.triangles, &options)
        });
        let found = found.map_err(SearchError::from)?;
        let similarity = found.best.reference_from_suspect;
        self.registration = Some(found);
        Ok(similarity)
    }

    fn resample(&mut self, similarity: &Similarity3<f64>) -> Result<Vec<Option<Point3<f64>>>, DetectError> {
        let moved = self.suspect.soup.points.iter().map(|p| similarity * p).collect();
        let suspect = Soup::new(moved, self.suspect.soup.triangles.clone());
        let mut rng = ChaCha8Rng::seed_from_u64(self.options.seed);
        let original = self.original.model().soup();
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
            return Err(SearchError::NothingWorked { reasons: self.warnings.join(" ") }.into());
        };
        let p = best_of(best.test.p, planned);
        let aligned = self.registration.filter(|_| best.variant.registration);
        self.warnings.extend(few(best.test.used));
        Ok(Detection {
            detected: p.log10() <= self.options.threshold.log10(),
            p_value: p.p(),
            log10_p: p.log10(),
            threshold: self.options.threshold,
            correlation: best.variant.correlation,
            coefficients_used: best.test.used,
            coverage: self.original.coverage(&best.found),
            method: Method::Paper,
            variant: Some(best.variant),
            variants,
            variants_counted: planned,
            registration: aligned.as_ref().map(Alignment::of_registration),
            parts: Vec::new(),
            extracted: best.extraction.coefficients,
            measured: None,
            found: best.found,
            budget_spent: false,
            seconds: self.seconds,
            warnings: self.warnings,
        })
    }
}
