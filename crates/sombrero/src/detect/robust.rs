//! The robust method's verdict on one key: of every estimate a correlation and ellipsoids, and the best counts.
//!
//! Every test on the way counts as a variant.

use super::search::{Hypothesis, KeyTest, SearchOutcome, search};
use super::{Alignment, DetectError, DetectOptions, Detection, Detector, Method, Test, Variant, few, rows};
use crate::Suspect;
use crate::timing::Stages;
use nalgebra::{Affine3, Point3};
use sombrero_extraction::Estimate;
use sombrero_stats::{Ellipsoid, LogProbability, WatermarkTestOptions, best_of, watermark_test};

/// Least standard errors for the ellipsoid test, in standard deviations of the watermark: residuals of a structured
/// attack are not independent, which the errors take them for.
pub const FLOORS: [f64; 4] = [0.0, 0.1, 0.3, 1.0];

/// The correlation and the ellipsoids.
pub(super) const TESTS: usize = 1 + FLOORS.len();

pub(super) fn detect(
    detector: &Detector,
    suspect: &Suspect,
    options: &DetectOptions,
) -> Result<Detection, DetectError> {
    let judge = OneKey { watermark: &detector.key.watermark, best: None, variants: Vec::new() };
    let SearchOutcome { judge, counted, seconds, mut warnings } =
        search(&detector.original, suspect, options, judge)?;
    let OneKey { best: Some(best), variants, .. } = judge else {
        return Err(DetectError::NeedsResampling);
    };
    let p = best_of(best.p, counted);
    let Outcome { variant, estimate, pose, used, .. } = best;
    warnings.extend(few(used));
    let found = positions(&estimate);
    let coverage = detector.original.coverage(&found);
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
        registration: pose.map(|pose| alignment(&pose, &estimate, coverage)),
        extracted: estimate.known(),
        found,
        seconds,
        warnings,
    })
}

/// Where each point of the original is on the suspect, in the original's coordinates.
pub(super) fn positions(estimate: &Estimate) -> Vec<Option<Point3<f64>>> {
    let place = |(p, present): (&Point3<f64>, &bool)| present.then_some(*p);
    estimate.positions.iter().zip(&estimate.present).map(place).collect()
}

pub(super) fn alignment(pose: &Affine3<f64>, estimate: &Estimate, overlap: f64) -> Alignment {
    Alignment {
        matrix: rows(&pose.to_homogeneous()),
        rms: estimate.residual_rms,
        overlap,
        iterations: estimate.iterations,
        converged: estimate.converged,
    }
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

impl KeyTest for OneKey<'_> {
    const TESTS: usize = TESTS;

    fn see(
        &mut self,
        hypothesis: Hypothesis,
        estimate: &Estimate,
        seconds: &mut Stages,
    ) -> Result<(), DetectError> {
        let w = self.watermark;
        let Hypothesis { nuisance, resampling, pose } = hypothesis;
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
