//! The robust method: what was done to the shape is solved for together with the coefficients.
//!
//! ```text
//! the same connectivity  ──► vertices as stored ──┐
//! renumbered or cropped  ──► vertices as matched ─┼─► each nuisance ─► correlation, ellipsoids ─► the best counts
//! anything else          ──► poses ──► surfaces ──┘
//! ```
//!
//! Every test on the way counts as a variant. Which routes there are and which poses fit is decided by the shape alone.

use super::{
    Alignment, DetectError, DetectOptions, Detection, Method, Prepared, Step, Test, Variant, few, rows,
};
use crate::Suspect;
use crate::timing::Stages;
use nalgebra::{Affine3, Point3, Similarity3};
use sombrero_extraction::{Deformation, Estimate, Nuisance};
use sombrero_mesh::{Matching, Soup, match_connectivity};
use sombrero_registration::{RegisterOptions, register, register_affine, similarity_of_pairs};
use sombrero_stats::{Ellipsoid, LogProbability, WatermarkTestOptions, best_of, watermark_test};

/// What is solved for beside the coefficients, simplest first.
const NUISANCES: [(&str, Nuisance); 4] = [
    ("similarity", Nuisance { deformation: Deformation::Similarity, smoothing: false }),
    ("similarity, smoothing", Nuisance { deformation: Deformation::Similarity, smoothing: true }),
    ("affine, smoothing", Nuisance { deformation: Deformation::Affine, smoothing: true }),
    ("free form, smoothing", Nuisance { deformation: Deformation::Lattice, smoothing: true }),
];

/// Least standard errors for the ellipsoid test, in standard deviations of the watermark: residuals of a structured
/// attack are not independent, which the errors take them for.
pub const FLOORS: [f64; 4] = [0.0, 0.1, 0.3, 1.0];

/// Tests of one route: the correlation and the ellipsoids of each nuisance.
const TESTS_PER_ROUTE: usize = NUISANCES.len() * (1 + FLOORS.len());

/// Poses, and matchings of vertices, that are tried at most: a cube has as many.
const MOST_POSES: usize = 24;

/// Matchings are told apart by what a similarity leaves: by this factor and this many largest sides.
const TOLD_APART: (f64, f64) = (1.5, 5e-4);

/// Vertices that a similarity brings this close to the original's (root mean square, in largest sides) do correspond,
/// and surfaces need not be compared.
const CORRESPONDS: f64 = 0.01;

/// No further variant is tried once the best is this many orders of magnitude below the threshold.
const MARGIN: f64 = 54.0;

pub(super) fn detect(
    prepared: &Prepared,
    suspect: &Suspect,
    options: &DetectOptions,
) -> Result<Detection, DetectError> {
    let mut search = Search::new(prepared, suspect, options);
    if options.resampling != Step::Always {
        search.vertices()?;
    }
    if search.possible > 0 && !search.is_certain() {
        search.surfaces()?;
    }
    search.finish()
}

/// One detection under way.
struct Search<'a> {
    prepared: &'a Prepared,
    suspect: &'a Suspect,
    options: &'a DetectOptions,
    /// Routes taken so far, and those that may yet come.
    routes: usize,
    possible: usize,
    best: Option<Outcome>,
    variants: Vec<Variant>,
    seconds: Stages,
    warnings: Vec<String>,
}

/// The best variant and what it rests on.
struct Outcome {
    variant: Variant,
    p: LogProbability,
    used: usize,
    estimate: Estimate,
    pose: Option<Affine3<f64>>,
}

impl<'a> Search<'a> {
    fn new(prepared: &'a Prepared, suspect: &'a Suspect, options: &'a DetectOptions) -> Self {
        let possible = if options.resampling == Step::Auto { 2 * MOST_POSES } else { MOST_POSES };
        Self {
            prepared,
            suspect,
            options,
            routes: 0,
            possible,
            best: None,
            variants: Vec::new(),
            seconds: Stages::default(),
            warnings: Vec::new(),
        }
    }

    /// The suspect's vertices as those of the original: as they are stored, or by the connectivity.
    fn vertices(&mut self) -> Result<(), DetectError> {
        let found = match &self.suspect.correspondence {
            Some(stored) => vec![stored.clone()],
            None => self.matched(),
        };
        self.possible -= MOST_POSES;
        self.routes += found.len();
        for found in found {
            if self.is_certain() {
                break;
            }
            let pose = (self.options.registration != Step::Never).then(|| self.pose_of(&found)).flatten();
            if self.rms(&found, &pose.unwrap_or_default())
                < CORRESPONDS * self.prepared.model().largest_side()
            {
                self.possible = 0;
            }
            let placed: Vec<_> = match &pose {
                Some(pose) => found.iter().map(|p| p.map(|p| pose * p)).collect(),
                None => found,
            };
            for nuisance in NUISANCES {
                let extractor = self.prepared.extractor()?;
                let estimate =
                    self.seconds.time("extraction", || extractor.from_vertices(&placed, nuisance.1))?;
                self.judge(nuisance.0, false, pose.map(affine), &estimate)?;
                if self.is_certain() {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Every way to number the suspect's vertices as the original's that fits the shape.
    fn matched(&mut self) -> Vec<Vec<Option<Point3<f64>>>> {
        let (original, suspect) = (self.prepared.model().soup(), &self.suspect.soup);
        let matchings = self.seconds.time("matching", || {
            match_connectivity(
                &original.triangles,
                original.points.len(),
                &suspect.triangles,
                suspect.points.len(),
            )
        });
        let place = |v: Option<u32>| v.and_then(|v| suspect.points.get(v as usize).copied());
        let places = |m: &Matching| m.of_first.iter().map(|v| place(*v)).collect::<Vec<_>>();
        let judged = matchings.found.iter().map(places).filter_map(|found| {
            let pose = self.pose_of(&found)?;
            Some((self.rms(&found, &pose), found))
        });
        let mut judged: Vec<_> = judged.collect();
        judged.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (factor, length) = TOLD_APART;
        let limit = judged
            .first()
            .map_or(0.0, |best| factor * best.0 + length * self.prepared.model().largest_side());
        judged.into_iter().filter(|(rms, _)| *rms <= limit).map(|(_, found)| found).take(MOST_POSES).collect()
    }

    /// The similarity that brings the found vertices nearest to the original's.
    fn pose_of(&self, found: &[Option<Point3<f64>>]) -> Option<Similarity3<f64>> {
        similarity_of_pairs(&self.pairs(found))
    }

    /// Root mean square distance of the found vertices, in this pose, from the original's.
    fn rms(&self, found: &[Option<Point3<f64>>], pose: &Similarity3<f64>) -> f64 {
        let pairs = self.pairs(found);
        let squares: f64 = pairs.iter().map(|(p, q)| (pose * p - q).norm_squared()).sum();
        (squares / pairs.len().max(1) as f64).sqrt()
    }

    /// Found vertices that have a face, each with the original's.
    fn pairs(&self, found: &[Option<Point3<f64>>]) -> Vec<(Point3<f64>, Point3<f64>)> {
        let original = self.prepared.model().soup();
        let seen = found.iter().zip(&original.points).zip(original.used()).filter(|(_, used)| *used);
        seen.filter_map(|((p, q), _)| p.map(|p| (p, *q))).collect()
    }

    /// The suspect's surface against the original's, in every pose that fits: the simplest nuisance in all poses
    /// first, since of a symmetric shape's poses one is right.
    fn surfaces(&mut self) -> Result<(), DetectError> {
        let poses = self.poses()?;
        self.possible -= MOST_POSES;
        self.routes += poses.len();
        let registration = self.options.registration != Step::Never;
        let suspects: Vec<Soup> = poses.iter().map(|pose| moved(&self.suspect.soup, pose)).collect();
        for (name, nuisance) in NUISANCES {
            for (pose, suspect) in poses.iter().zip(&suspects) {
                if self.is_certain() {
                    return Ok(());
                }
                let extractor = self.prepared.extractor()?;
                let estimate =
                    self.seconds.time("extraction", || extractor.from_surface(suspect, nuisance))?;
                self.judge(name, true, registration.then_some(*pose), &estimate)?;
            }
        }
        Ok(())
    }

    /// Every pose that the surfaces cannot tell from the best: similarities, or affine maps where no similarity fits.
    fn poses(&mut self) -> Result<Vec<Affine3<f64>>, DetectError> {
        if self.options.registration == Step::Never {
            return Ok(vec![Affine3::identity()]);
        }
        let (prepared, suspect) = (self.prepared, &self.suspect.soup);
        let options = RegisterOptions::default();
        let similar = self.seconds.time("registration", || {
            register(prepared.reference()?, &suspect.points, &suspect.triangles, &options)
        });
        let similar = match similar {
            Ok(found) => found,
            Err(error) if self.options.registration == Step::Always => return Err(error.into()),
            Err(error) => {
                self.warnings
                    .push(format!("The suspect was taken where it is: it cannot be registered: {error}."));
                return Ok(vec![Affine3::identity()]);
            }
        };
        if !similar.trusted {
            let stretched = self.seconds.time("registration", || {
                register_affine(prepared.reference()?, &suspect.points, &suspect.triangles, &options)
            });
            if let Ok(found) = stretched
                && found.trusted
            {
                let poses = [&found.best].into_iter().chain(&found.alternatives);
                return Ok(poses.map(|pose| pose.reference_from_suspect).take(MOST_POSES).collect());
            }
            self.warnings.push(
                "The suspect fits the original badly in every pose that was tried; it may be another shape."
                    .to_owned(),
            );
        }
        let others = similar.alternatives.iter().map(|pose| pose.reference_from_suspect);
        let poses = [similar.reference_from_suspect].into_iter().chain(others).take(MOST_POSES);
        Ok(poses.map(affine).collect())
    }

    /// Every test of one estimate.
    fn judge(
        &mut self,
        nuisance: &'static str,
        resampling: bool,
        pose: Option<Affine3<f64>>,
        estimate: &Estimate,
    ) -> Result<(), DetectError> {
        let w = &self.prepared.key().watermark;
        let extracted = estimate.known();
        let correlation = watermark_test(w, &extracted, &WatermarkTestOptions::default())?;
        let ellipsoid =
            self.seconds.time("tests", || Ellipsoid::new(&estimate.coefficients, &estimate.precision))?;
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

    /// All variants that p is corrected for: of the routes taken, and as long as others may come, of those too.
    fn counted(&self) -> usize {
        (self.routes + self.possible) * TESTS_PER_ROUTE
    }

    /// Whether the best variant so far stays found by a wide margin whatever the others would give.
    fn is_certain(&self) -> bool {
        let limit = self.options.threshold.log10() - MARGIN;
        self.best.as_ref().is_some_and(|best| best_of(best.p, self.counted()).log10() <= limit)
    }

    fn finish(mut self) -> Result<Detection, DetectError> {
        if !self.is_certain() {
            // Nothing else will be tried.
            self.possible = 0;
        }
        let counted = self.counted();
        let Some(best) = self.best else {
            if self.warnings.is_empty() {
                return Err(DetectError::NeedsResampling);
            }
            return Err(DetectError::NothingWorked { reasons: self.warnings.join(" ") });
        };
        let p = best_of(best.p, counted);
        let Outcome { variant, estimate, pose, used, .. } = best;
        self.warnings.extend(few(used));
        let extracted = estimate.known();
        let place = |(p, present): (&Point3<f64>, &bool)| present.then_some(*p);
        let found: Vec<_> = estimate.positions.iter().zip(&estimate.present).map(place).collect();
        let coverage = self.prepared.coverage(&found);
        let aligned = pose.map(|pose| Alignment {
            matrix: rows(&pose.to_homogeneous()),
            rms: estimate.residual_rms,
            overlap: coverage,
            iterations: estimate.iterations,
            converged: estimate.converged,
        });
        Ok(Detection {
            detected: p.log10() <= self.options.threshold.log10(),
            p_value: p.p(),
            log10_p: p.log10(),
            threshold: self.options.threshold,
            correlation: variant.correlation,
            coefficients_used: used,
            coverage,
            method: Method::Robust,
            variant,
            variants: self.variants,
            variants_counted: counted,
            registration: aligned,
            extracted,
            found,
            seconds: self.seconds,
            warnings: self.warnings,
        })
    }
}

fn affine(similarity: Similarity3<f64>) -> Affine3<f64> {
    Affine3::from_matrix_unchecked(similarity.to_homogeneous())
}

fn moved(soup: &Soup, pose: &Affine3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| pose * p).collect(), soup.triangles.clone())
}
