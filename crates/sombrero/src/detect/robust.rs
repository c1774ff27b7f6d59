//! The robust method's verdict on one key: every estimate is put to all tests, and the best counts.
//!
//! Every test on the way counts as a variant.

use super::detection::{Alignment, Detection, Measured, Part, Variant, few, positions};
use super::error::DetectError;
use super::options::{DetectOptions, Method};
use nalgebra::Affine3;
use sombrero_extraction::Estimate;
use sombrero_search::{
    Examiner, FoundPart, Glance, Hypothesis, Look, Looked, Original, SearchError, SearchOutcome, Stages,
    Suspect, search_from,
};
use sombrero_stats::{KeyTest, KeyTests, LogProbability, best_of};

/// `glance` is the first look at this suspect with these options, made before.
pub(super) fn detect(
    original: &Original,
    watermark: &[f64],
    suspect: &Suspect,
    options: &DetectOptions,
    glance: Option<Box<Glance>>,
) -> Result<Detection, DetectError> {
    let one_key = OneKey { watermark, best: None, variants: Vec::new() };
    let search_options = options.search();
    let glance = match glance {
        Some(glance) => *glance,
        None => original.outline().glance(suspect, &search_options)?,
    };
    if glance.is_another_shape() {
        let (coefficients, points) = (watermark.len(), original.model().soup().points.len());
        return Ok(Detection::of_another_shape(coefficients, points, options.threshold, glance.seconds));
    }
    let SearchOutcome { looks, seconds, mut warnings, budget_spent, .. } =
        search_from(glance, original, suspect, &search_options, one_key)?;
    let mut variants = Vec::new();
    let mut winner: Option<(Outcome, LogProbability, usize, Vec<FoundPart>)> = None;
    for Looked { examiner, counted, parts, .. } in looks {
        variants.extend(examiner.variants);
        let Some(best) = examiner.best else { continue };
        let p = best_of(best.p, counted);
        if winner.as_ref().is_none_or(|winner| p < winner.1) {
            winner = Some((best, p, counted, parts));
        }
    }
    let Some((best, p, counted, parts)) = winner else { return Err(SearchError::NeedsResampling.into()) };
    let Outcome { variant, estimate, pose, used, .. } = best;
    warnings.extend(few(used));
    warnings.extend(budget_spent.then(|| {
        "The search ended when its budget was spent, before all was looked at; a larger --budget may find more.".to_owned()
    }));
    let found = positions(&estimate);
    let coverage = original.coverage(&found);
    Ok(Detection {
        detected: p.log10() <= options.threshold.log10(),
        p_value: p.p(),
        log10_p: p.log10(),
        threshold: options.threshold,
        correlation: variant.correlation,
        coefficients_used: used,
        coverage,
        method: Method::Robust,
        variant: Some(variant),
        variants,
        variants_counted: counted,
        registration: pose.map(|pose| Alignment::of_estimate(&pose, &estimate, coverage)),
        parts: parts.iter().map(|part| Part::new(part, counted)).collect(),
        extracted: estimate.known(),
        measured: Some(Measured { centre: estimate.coefficients, precision: estimate.precision }),
        found,
        budget_spent,
        seconds,
        warnings,
    })
}

/// Looks for one watermark, and keeps account of every test.
#[derive(Clone)]
struct OneKey<'a> {
    watermark: &'a [f64],
    best: Option<Outcome>,
    variants: Vec<Variant>,
}

/// The best variant and what it rests on.
#[derive(Clone)]
struct Outcome {
    variant: Variant,
    p: LogProbability,
    used: usize,
    estimate: Estimate,
    pose: Option<Affine3<f64>>,
}

impl Examiner for OneKey<'_> {
    type Error = DetectError;
    const TESTS: usize = KeyTests::COUNT;

    fn examine(
        &mut self,
        hypothesis: &Hypothesis,
        estimate: &Estimate,
        seconds: &mut Stages,
    ) -> Result<(), DetectError> {
        let Hypothesis { nuisance, look, resampling, pose, .. } = *hypothesis;
        let compared = seconds.time("tests", || {
            KeyTests::new(&estimate.coefficients, estimate.known(), &estimate.precision)?
                .compare(self.watermark)
        })?;
        for KeyTest { statistic, p, used, .. } in compared.tests {
            let variant = Variant {
                registration: pose.is_some() || look == Look::Parts,
                look: look.name(),
                resampling,
                nuisance,
                test: statistic,
                floor: statistic.floor.unwrap_or(0.0),
                log10_p: p.log10(),
                correlation: compared.correlation,
            };
            self.variants.push(variant);
            if self.best.as_ref().is_none_or(|best| p < best.p) {
                self.best = Some(Outcome { variant, p, used, estimate: estimate.clone(), pose });
            }
        }
        Ok(())
    }

    fn weigh(&self, functions: &[usize], estimate: &Estimate) -> Result<LogProbability, DetectError> {
        let watermark: Vec<f64> = functions.iter().map(|&i| self.watermark[i]).collect();
        let tests = KeyTests::new(&estimate.coefficients, estimate.known(), &estimate.precision)?;
        Ok(tests.compare(&watermark)?.best())
    }

    fn best(&self) -> Option<LogProbability> {
        self.best.as_ref().map(|best| best.p)
    }
}
