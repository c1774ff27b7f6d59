//! The robust method's ways to look at a suspect: what was done to the shape is solved for together with the coefficients.
//!
//! ```text
//! the same connectivity  ──► vertices as stored ──┐
//! renumbered or cropped  ──► vertices as matched ─┼─► each nuisance ─► an estimate ─► the judge
//! anything else          ──► poses ──► surfaces ──┘
//! ```
//!
//! Which ways there are, which poses fit and what is estimated is decided by the shapes alone: nothing here sees a
//! watermark (Law 1). A judge, who does, is shown each estimate and tells how sure it is, so that the search can end
//! early; ways not taken count as if they had been.

use super::{DetectError, DetectOptions, When};
use crate::Suspect;
use crate::original::Original;
use crate::timing::Stages;
use nalgebra::{Affine3, Point3, Similarity3};
use sombrero_extraction::{Deformation, Estimate, Nuisance};
use sombrero_mesh::{Soup, VertexMatching, match_connectivity};
use sombrero_registration::{RegisterOptions, register, register_affine, similarity_of_pairs};
use sombrero_stats::{LogProbability, best_of};

/// What is solved for beside the coefficients, simplest first.
const NUISANCES: [(&str, Nuisance); 4] = [
    ("similarity", Nuisance { deformation: Deformation::Similarity, smoothing: false }),
    ("similarity, smoothing", Nuisance { deformation: Deformation::Similarity, smoothing: true }),
    ("affine, smoothing", Nuisance { deformation: Deformation::Affine, smoothing: true }),
    ("free form, smoothing", Nuisance { deformation: Deformation::Lattice, smoothing: true }),
];

/// Poses, and matchings of vertices, that are tried at most: a cube has as many.
const MOST_POSES: usize = 24;

/// Matchings are told apart by what a similarity leaves: by this factor and this many largest sides.
const TOLD_APART: (f64, f64) = (1.5, 5e-4);

/// Vertices that a similarity brings this close to the original's (root mean square, in largest sides) do correspond,
/// and surfaces need not be compared.
const CORRESPONDS: f64 = 0.01;

/// So many points tell where a suspect lies.
const ENOUGH: usize = 2000;

/// No further variant is tried once the best is this many orders of magnitude below the threshold.
const MARGIN: f64 = 54.0;

/// How an estimate came about.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hypothesis {
    /// What was solved for beside the coefficients.
    pub(super) nuisance: &'static str,
    /// Whether surfaces were compared instead of vertices.
    pub(super) resampling: bool,
    /// How the suspect was placed; `None` when it was taken as it is.
    pub(super) pose: Option<Affine3<f64>>,
}

/// Who knows watermarks and compares them with estimates.
pub(super) trait KeyTest {
    /// Tests that are made of each estimate.
    const TESTS: usize;

    /// Makes them. `seconds` is there to note their time.
    fn see(
        &mut self,
        hypothesis: Hypothesis,
        estimate: &Estimate,
        seconds: &mut Stages,
    ) -> Result<(), DetectError>;

    /// The best p so far, counted once.
    fn best(&self) -> Option<LogProbability>;

    /// For how many watermarks each test is made.
    fn watermarks(&self) -> usize {
        1
    }
}

/// A search that is over.
pub(super) struct SearchOutcome<J> {
    pub(super) judge: J,
    /// Tests that p is corrected for: those made, and those left out because one was certain.
    pub(super) counted: usize,
    pub(super) seconds: Stages,
    pub(super) warnings: Vec<String>,
}

/// Shows the judge every estimate there is, until one is certain.
pub(super) fn search<J: KeyTest>(
    original: &Original,
    suspect: &Suspect,
    options: &DetectOptions,
    judge: J,
) -> Result<SearchOutcome<J>, DetectError> {
    let mut search = Search::new(original, suspect, options, judge);
    if options.resampling != When::Always {
        search.vertices()?;
    }
    if search.possible > 0 && !search.is_certain() {
        search.surfaces()?;
    }
    search.finish()
}

/// One search under way.
struct Search<'a, J> {
    original: &'a Original,
    suspect: &'a Suspect,
    options: &'a DetectOptions,
    judge: J,
    /// Routes taken so far, and those that may yet come.
    routes: usize,
    possible: usize,
    seconds: Stages,
    warnings: Vec<String>,
}

impl<'a, J: KeyTest> Search<'a, J> {
    fn new(original: &'a Original, suspect: &'a Suspect, options: &'a DetectOptions, judge: J) -> Self {
        let possible = if options.resampling == When::Auto { 2 * MOST_POSES } else { MOST_POSES };
        let (seconds, warnings) = (Stages::default(), Vec::new());
        Self { original, suspect, options, judge, routes: 0, possible, seconds, warnings }
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
            let pose = (self.options.registration != When::Never).then(|| self.pose_of(&found)).flatten();
            if self.rms(&found, &pose.unwrap_or_default()) < CORRESPONDS * self.original.model.largest_side()
            {
                self.possible = 0;
            }
            let placed: Vec<_> = match &pose {
                Some(pose) => found.iter().map(|p| p.map(|p| pose * p)).collect(),
                None => found,
            };
            for nuisance in NUISANCES {
                let extractor = self.original.extractor()?;
                let estimate = self
                    .seconds
                    .time("extraction", || extractor.estimate_from_vertices(&placed, nuisance.1))?;
                self.show(
                    Hypothesis { nuisance: nuisance.0, resampling: false, pose: pose.map(affine) },
                    &estimate,
                )?;
                if self.is_certain() {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Every way to number the suspect's vertices as the original's that fits the shape.
    fn matched(&mut self) -> Vec<Vec<Option<Point3<f64>>>> {
        let (original, suspect) = (self.original.model.soup(), &self.suspect.soup);
        let matchings = self.seconds.time("matching", || {
            match_connectivity(
                &original.triangles,
                original.points.len(),
                &suspect.triangles,
                suspect.points.len(),
            )
        });
        let place = |v: Option<u32>| v.and_then(|v| suspect.points.get(v as usize).copied());
        let places = |m: &VertexMatching| m.of_first.iter().map(|v| place(*v)).collect::<Vec<_>>();
        let judged = matchings.found.iter().map(places).filter_map(|found| {
            let pose = self.pose_of(&found)?;
            Some((self.rms(&found, &pose), found))
        });
        let mut judged: Vec<_> = judged.collect();
        judged.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (factor, length) = TOLD_APART;
        let limit =
            judged.first().map_or(0.0, |best| factor * best.0 + length * self.original.model.largest_side());
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
        let original = self.original.model.soup();
        let seen = found.iter().zip(&original.points).zip(original.used()).filter(|(_, used)| *used);
        seen.filter_map(|((p, q), _)| p.map(|p| (p, *q))).collect()
    }

    /// The suspect's surface against the original's, in every pose that fits: the simplest nuisance in all poses
    /// first, since of a symmetric shape's poses one is right.
    fn surfaces(&mut self) -> Result<(), DetectError> {
        let poses = self.poses()?;
        self.possible -= MOST_POSES;
        self.routes += poses.len();
        let registration = self.options.registration != When::Never;
        let suspects: Vec<Soup> = poses.iter().map(|pose| moved(&self.suspect.soup, pose)).collect();
        for (name, nuisance) in NUISANCES {
            for (pose, suspect) in poses.iter().zip(&suspects) {
                if self.is_certain() {
                    return Ok(());
                }
                let extractor = self.original.extractor()?;
                let estimate =
                    self.seconds.time("extraction", || extractor.estimate_from_surface(suspect, nuisance))?;
                self.show(
                    Hypothesis { nuisance: name, resampling: true, pose: registration.then_some(*pose) },
                    &estimate,
                )?;
            }
        }
        Ok(())
    }

    /// Every pose that the surfaces cannot tell from the best: similarities, or affine maps where no similarity fits.
    fn poses(&mut self) -> Result<Vec<Affine3<f64>>, DetectError> {
        if self.options.registration == When::Never {
            return Ok(vec![Affine3::identity()]);
        }
        let (original, suspect) = (self.original, &self.suspect.soup);
        let options = RegisterOptions::default();
        let similar = self.seconds.time("registration", || {
            register(original.reference()?, &suspect.points, &suspect.triangles, &options)
        });
        let similar = match similar {
            Ok(found) => found,
            Err(error) if self.options.registration == When::Always => return Err(error.into()),
            Err(error) => {
                self.warnings
                    .push(format!("The suspect was taken where it is: it cannot be registered: {error}."));
                return Ok(vec![Affine3::identity()]);
            }
        };
        if !similar.trusted {
            let stretched = self.seconds.time("registration", || {
                register_affine(original.reference()?, &suspect.points, &suspect.triangles, &options)
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
        let mut poses: Vec<Affine3<f64>> = poses.map(affine).collect();
        if self.lies_elsewhere(&poses)? {
            poses.insert(0, Affine3::identity());
            poses.truncate(MOST_POSES);
        }
        Ok(poses)
    }

    /// Whether the suspect lies on the original as it is, and none of the poses says so: a small piece that nobody moved
    /// may fit better somewhere else.
    fn lies_elsewhere(&self, poses: &[Affine3<f64>]) -> Result<bool, DetectError> {
        let near = CORRESPONDS * self.original.model.largest_side();
        let points = &self.suspect.soup.points;
        let some: Vec<Point3<f64>> =
            points.iter().step_by(points.len().div_ceil(ENOUGH).max(1)).copied().collect();
        let moves = |pose: &Affine3<f64>| {
            let squares: f64 = some.iter().map(|p| (pose * p - p).norm_squared()).sum();
            (squares / some.len().max(1) as f64).sqrt() > near
        };
        Ok(self.options.registration == When::Auto
            && poses.iter().all(moves)
            && self.original.reference()?.distance(&some) < near)
    }

    fn show(&mut self, hypothesis: Hypothesis, estimate: &Estimate) -> Result<(), DetectError> {
        self.judge.see(hypothesis, estimate, &mut self.seconds)
    }

    /// All tests that p is corrected for: of the routes taken, and as long as others may come, of those too.
    fn counted(&self) -> usize {
        (self.routes + self.possible) * NUISANCES.len() * J::TESTS * self.judge.watermarks()
    }

    /// Whether the best p so far stays found by a wide margin whatever the others would give.
    fn is_certain(&self) -> bool {
        let limit = self.options.threshold.log10() - MARGIN;
        self.judge.best().is_some_and(|best| best_of(best, self.counted()).log10() <= limit)
    }

    fn finish(mut self) -> Result<SearchOutcome<J>, DetectError> {
        if !self.is_certain() {
            // Nothing else will be tried.
            self.possible = 0;
        }
        if self.judge.best().is_none() {
            if self.warnings.is_empty() {
                return Err(DetectError::NeedsResampling);
            }
            return Err(DetectError::NothingWorked { reasons: self.warnings.join(" ") });
        }
        let counted = self.counted();
        Ok(SearchOutcome { judge: self.judge, counted, seconds: self.seconds, warnings: self.warnings })
    }
}

fn affine(similarity: Similarity3<f64>) -> Affine3<f64> {
    Affine3::from_matrix_unchecked(similarity.to_homogeneous())
}

fn moved(soup: &Soup, pose: &Affine3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| pose * p).collect(), soup.triangles.clone())
}
