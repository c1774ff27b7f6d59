//! The robust method's verdict on one key: of every estimate a correlation and ellipsoids, and the best counts.
//!
//! Every test on the way counts as a variant.

use super::detection::{Alignment, Detection, Test, Variant, few, positions};
use super::error::DetectError;
use super::options::{DetectOptions, Method};
use nalgebra::Affine3;
use sombrero_extraction::Estimate;
use sombrero_search::{Examiner, Hypothesis, Original, SearchError, SearchOutcome, Stages, Suspect, search};
use sombrero_stats::{Ellipsoid, LogProbability, WatermarkTestOptions, best_of, watermark_test};

/// Least standard errors for the ellipsoid test, in standard deviations of the watermark: residuals of a structured
/// attack are not independent, which the errors take them for.
pub const FLOORS: [f64; 4] = [0.0, 0.1, 0.3, 1.0];

/// The correlation and the ellipsoids.
pub(crate) const TESTS: usize = 1 + FLOORS.len();

pub(super) fn detect(
    original: &Original,
    watermark: &[f64],
    suspect: &Suspect,
    options: &DetectOptions,
) -> Result<Detection, DetectError> {
    let one_key = OneKey { watermark, best: None, variants: Vec::new() };
    let SearchOutcome { examiner, counted, seconds, mut warnings, .. } =
        search(original, suspect, &options.search(), one_key)?;
    let OneKey { best: Some(best), variants, .. } = examiner else {
        return Err(SearchError::NeedsResampling.into());
    };
    let p = best_of(best.p, counted);
    let Outcome { variant, estimate, pose, used, .. } = best;
    warnings.extend(few(used));
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
        variant,
        variants,
        variants_counted: counted,
        registration: pose.map(|pose| Alignment::of_estimate(&pose, &estimate, coverage)),
        extracted: estimate.known(),
        found,
        seconds,
        warnings,
    })
}

/// Looks for one watermark, and keeps account of every test.
struct OneKey<'a> {
    watermark: &'a [f64],
    best: Option<Outcome>,
    variants: Vec<Variant>,
}

/// The best variant and what it rests on.
struct Outcome {
    variant: Variant,
    p: LogProbability,
    used: usize,
    estimate: Estimate,
    pose: Option<Affine3<f64>>,
}

impl Examiner for OneKey<'_> {
    type Error = DetectError;
    const TESTS: usize = TESTS;

    fn examine(
        &mut self,
        hypothesis: &Hypothesis,
        estimate: &Estimate,
        seconds: &mut Stages,
    ) -> Result<(), DetectError> {
        let w = self.watermark;
        let Hypothesis { nuisance, resampling, pose, .. } = *hypothesis;
        let extracted = estimate.known();
        let correlation = watermark_test(w, &extracted, &WatermarkTestOptions::default())?;
        let ellipsoid =
            seconds.time("tests", || Ellipsoid::new(&estimate.coefficients, &estimate.precision))?;
        let mut tests = vec![(Test::Correlation, 0.0, correlation.p)];
        for floor in FLOORS {
            tests.push((Test::Ellipsoid, floor, ellipsoid.with_floor(floor)?.test(w)?.bound));
        }
        for (test, floor, p) in tests {
            let variant = Variant {
                registration: pose.is_some(),
                resampling,
                nuisance,
                test,
                floor,
                log10_p: p.log10(),
                correlation: correlation.rho(),
            };
            self.variants.push(variant);
            if self.best.as_ref().is_none_or(|best| p < best.p) {
                let used = match test {
                    Test::Correlation => correlation.used,
                    Test::Ellipsoid => extracted.iter().flatten().count(),
                };
                self.best = Some(Outcome { variant, p, used, estimate: estimate.clone(), pose });
            }
        }
        Ok(())
    }

    fn best(&self) -> Option<LogProbability> {
        self.best.as_ref().map(|best| best.p)
    }
}
