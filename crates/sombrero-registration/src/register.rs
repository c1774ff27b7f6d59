//! Registration without a hint: starts, a quick refinement of each, the fit as the judge.
//!
//! ```text
//! starts by moments ─► coarse ICP ─► fit both ways ─► good?  ─► the best few: fine ICP ─► fit ─► the best
//!                                                       │ no
//!                      starts all over the rotations ◄──┘
//! ```
//!
//! Poses that end in the same place are one. Poses that fit the reference as well as the best, which
//! symmetric shapes have, are kept: which of them is right only an extraction can tell, and whoever tries
//! several counts them.

use nalgebra::{Point3, Similarity3};
use rayon::prelude::*;

use crate::error::{RegistrationError, Side};
use crate::icp::{Icp, IcpOptions, Reference, Run};
use crate::judge::{Fit, Judge, REACH};
use crate::shape::{Shape, to_model, to_unit};
use crate::start;

/// Iterations that each start gets before it is judged.
const TRIAL_ITERATIONS: usize = 15;
/// Of many starts, this many get them, chosen after the first few.
const SHORT_LIST: usize = 24;
const FIRST_ITERATIONS: usize = 5;
/// A score up to this ends the search: nine tenths of both surfaces agree.
const GOOD: f64 = 0.1;
/// Of starts by moments, when one is good as it is, those this much worse are not tried.
const HOPELESS: f64 = 0.3;
/// Poses whose points are closer than this on average are the same, in units of the diagonal.
const SAME: f64 = 0.01;
/// Poses tell apart when their truncated RMS differs by more than this factor and this length, in units of
/// the diagonal: about what a mark does to the surface.
const TOLD_APART: (f64, f64) = (1.5, 5e-4);

/// Where the search starts.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub enum Starts {
    /// Moments of both surfaces first; then, if no pose fits, rotations from all over.
    #[default]
    Auto,
    /// Moments only: fast, and enough for a suspect that is whole.
    Moments,
    /// These poses, which map suspect to reference in model units.
    Given(Vec<Similarity3<f64>>),
}

/// How [`register`] searches.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisterOptions {
    /// Where the search starts. Default [`Starts::Auto`].
    pub starts: Starts,
    /// How each start is refined.
    pub icp: IcpOptions,
    /// Alternatives kept at most, besides the best pose. Default 7.
    pub max_alternatives: usize,
}

impl Default for RegisterOptions {
    fn default() -> Self {
        Self { starts: Starts::Auto, icp: IcpOptions::default(), max_alternatives: 7 }
    }
}

/// A pose of the suspect and how well it fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Maps points of the suspect to the frame of the reference, in model units.
    pub reference_from_suspect: Similarity3<f64>,
    /// Root mean square distance between the suspect, where it has a counterpart, and the reference, in
    /// model units of the reference. Where nothing has a counterpart, of the whole suspect.
    pub rms: f64,
    /// Share of the reference's area that has a counterpart in the suspect, 0 to 1.
    pub overlap: f64,
    /// Share of the suspect's area that has a counterpart in the reference, 0 to 1.
    pub suspect_overlap: f64,
    /// The fit both ways, from 0 (the same surface) to 1 (nothing in common).
    pub score: f64,
}

impl Pose {
    pub(crate) fn new(
        reference: &Shape,
        suspect: &Shape,
        pose: &Similarity3<f64>,
        fit: &Fit,
    ) -> Result<Self, RegistrationError> {
        let &Fit { score, rms, overlap, suspect_overlap } = fit;
        let reference_from_suspect =
            to_model(reference, suspect, pose).ok_or(RegistrationError::SizeRatio)?;
        Ok(Self { reference_from_suspect, rms: rms * reference.diagonal, overlap, suspect_overlap, score })
    }
}

/// What [`register`] and [`align`](crate::align) found.
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// Maps points of the suspect to the frame of the reference, in model units.
    pub reference_from_suspect: Similarity3<f64>,
    /// Root mean square distance between the suspect, where it has a counterpart, and the reference, in
    /// model units of the reference. Where nothing has a counterpart, of the whole suspect.
    pub rms: f64,
    /// Share of the reference's area that has a counterpart in the suspect, 0 to 1.
    pub overlap: f64,
    /// Share of the suspect's area that has a counterpart in the reference, 0 to 1.
    pub suspect_overlap: f64,
    /// The fit both ways, from 0 (the same surface) to 1 (nothing in common). Above about 0.5 the suspect is
    /// hardly the reference, or the pose is wrong.
    pub score: f64,
    /// Iterations of the winning pose, coarse and fine.
    pub iterations: usize,
    /// Whether the last step was below the tolerance, rather than the last one allowed.
    pub converged: bool,
    /// Other poses that fit about as well, best first: a symmetric shape has them.
    pub alternatives: Vec<Pose>,
}

impl Registration {
    pub(crate) fn new(best: Pose, iterations: usize, converged: bool, alternatives: Vec<Pose>) -> Self {
        let Pose { reference_from_suspect, rms, overlap, suspect_overlap, score } = best;
        Self {
            reference_from_suspect,
            rms,
            overlap,
            suspect_overlap,
            score,
            iterations,
            converged,
            alternatives,
        }
    }
}

/// Brings the suspect onto the reference.
///
/// # Errors
/// [`RegistrationError`] when the suspect has no shape, a start is no similarity, or an option is out of
/// range. A suspect that is another shape altogether gives a pose with a bad score.
pub fn register(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    options: &RegisterOptions,
) -> Result<Registration, RegistrationError> {
    options.icp.check()?;
    let reference = &reference.0;
    let suspect = Shape::new(Side::Suspect, points, triangles)?;
    let search = Search::new(reference, &suspect, options);
    let candidates = match &options.starts {
        Starts::Auto => search.auto(),
        Starts::Moments => search.tried(start::by_moments(reference, &suspect)),
        Starts::Given(starts) => search.tried(given(reference, &suspect, starts)?),
    };
    search.finish(candidates)
}

fn given(
    reference: &Shape,
    suspect: &Shape,
    starts: &[Similarity3<f64>],
) -> Result<Vec<Similarity3<f64>>, RegistrationError> {
    if starts.is_empty() {
        return Err(RegistrationError::NoStarts);
    }
    let unit = |(index, start)| to_unit(reference, suspect, start).ok_or(RegistrationError::Start { index });
    starts.iter().enumerate().map(unit).collect()
}

/// A start after refinement.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    run: Run,
    fit: Fit,
}

struct Search<'a> {
    reference: &'a Shape,
    suspect: &'a Shape,
    options: &'a RegisterOptions,
    icp: Icp<'a>,
}

impl<'a> Search<'a> {
    fn new(reference: &'a Shape, suspect: &'a Shape, options: &'a RegisterOptions) -> Self {
        Self { reference, suspect, options, icp: Icp::new(reference, suspect, &options.icp) }
    }

    fn auto(&self) -> Vec<Candidate> {
        let mut candidates = self.tried(start::by_moments(self.reference, self.suspect));
        if candidates.first().is_none_or(|best| best.fit.score > GOOD) {
            candidates.extend(self.tried(start::all_over(self.reference, self.suspect)));
            candidates = self.sorted(candidates);
        }
        candidates
    }

    /// Each start after a coarse round, best first, without repetitions.
    fn tried(&self, starts: Vec<Similarity3<f64>>) -> Vec<Candidate> {
        let judge = Judge::coarse(self.reference, self.suspect);
        let trials = |starts: Vec<Similarity3<f64>>, most: usize| {
            let most = most.min(self.options.icp.max_iterations);
            let trial = |start| {
                let run = self.icp.trial_round(start, most);
                Candidate { run, fit: judge.fit(&run.pose) }
            };
            self.sorted(starts.into_par_iter().map(trial).collect())
        };
        let mut starts = hopeful(&judge, starts);
        if starts.len() > SHORT_LIST {
            starts = trials(starts, FIRST_ITERATIONS).iter().map(|c| c.run.pose).take(SHORT_LIST).collect();
        }
        trials(starts, TRIAL_ITERATIONS)
    }

    /// Refines those that may yet turn out best, and reports.
    fn finish(&self, mut candidates: Vec<Candidate>) -> Result<Registration, RegistrationError> {
        candidates = comparable(candidates);
        candidates.truncate(self.options.max_alternatives + 1);
        let judge = Judge::fine(self.reference, self.suspect, &self.options.icp);
        let refine = |candidate: Candidate| {
            let left = self.options.icp.max_iterations.saturating_sub(candidate.run.iterations);
            let mut run = self.icp.all_rounds(candidate.run.pose, left);
            run.iterations += candidate.run.iterations;
            Candidate { run, fit: judge.fit(&run.pose) }
        };
        let refined: Vec<_> = candidates.into_par_iter().map(refine).collect();
        let refined = comparable(self.sorted(refined));
        let poses = refined.iter().map(|c| Pose::new(self.reference, self.suspect, &c.run.pose, &c.fit));
        let mut poses = poses.collect::<Result<Vec<_>, _>>()?.into_iter();
        let (Some(best), Some(pose)) = (refined.first(), poses.next()) else {
            return Err(RegistrationError::NoStarts);
        };
        Ok(Registration::new(pose, best.run.iterations, best.run.converged, poses.collect()))
    }

    /// Best first; of candidates in the same place, the best.
    fn sorted(&self, mut candidates: Vec<Candidate>) -> Vec<Candidate> {
        candidates.sort_by(|a, b| a.fit.score.total_cmp(&b.fit.score));
        let mut kept: Vec<Candidate> = Vec::new();
        for candidate in candidates {
            if kept.iter().all(|k| self.apart(&k.run.pose, &candidate.run.pose) > SAME) {
                kept.push(candidate);
            }
        }
        kept
    }

    /// Root mean square distance between the suspect in two poses.
    fn apart(&self, a: &Similarity3<f64>, b: &Similarity3<f64>) -> f64 {
        let samples = self.icp.coarse.iter().step_by(16);
        let count = samples.len().max(1) as f64;
        (samples.map(|s| (a * s.point - b * s.point).norm_squared()).sum::<f64>() / count).sqrt()
    }
}

/// The starts that are worth a trial: all of them, unless one fits so well that others need not be asked.
fn hopeful(judge: &Judge, starts: Vec<Similarity3<f64>>) -> Vec<Similarity3<f64>> {
    let scores: Vec<f64> = starts.par_iter().map(|start| judge.fit(start).score).collect();
    let best = scores.iter().copied().fold(1.0, f64::min);
    let limit = if best <= GOOD { best + HOPELESS } else { f64::INFINITY };
    starts.into_iter().zip(scores).filter(|(_, score)| *score <= limit).map(|(start, _)| start).collect()
}

/// Those that the fit cannot tell from the best, which comes first.
fn comparable(mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    let rms = |c: &Candidate| REACH * c.fit.score.sqrt();
    if let Some(best) = candidates.first().map(rms) {
        let (factor, length) = TOLD_APART;
        candidates.retain(|c| rms(c) <= factor * best + length);
    }
    candidates
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use sombrero_mesh::{Soup, shapes};

    /// Any rotation, scales from 0.1 to 10, shifts of several sizes.
    fn any_similarity() -> impl Strategy<Value = Similarity3<f64>> {
        let axis = prop::array::uniform4(-1.0..1.0_f64)
            .prop_filter("a rotation", |q| (0.01..1.0).contains(&q.iter().map(|x| x * x).sum::<f64>()));
        let shift = prop::array::uniform3(-100.0..100.0_f64);
        (axis, shift, -1.0..1.0_f64).prop_map(|([w, i, j, k], shift, decades)| {
            let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
            Similarity3::from_parts(Translation3::from(Vector3::from(shift)), rotation, 10f64.powf(decades))
        })
    }

    /// Shapes that no rotation takes to themselves.
    fn any_shape() -> impl Strategy<Value = Soup> {
        prop::sample::select(vec![
            shapes::part(3),
            shapes::bust(16),
            shapes::bumpy_sphere(1500),
            shapes::open_sheet(24, 16),
        ])
    }

    fn moved(soup: &Soup, s: &Similarity3<f64>) -> Vec<Point3<f64>> {
        soup.points.iter().map(|p| s * p).collect()
    }

    /// Largest distance between `expected` and the moved points brought back, in largest sides.
    fn error(expected: &Soup, moved: &[Point3<f64>], found: &Similarity3<f64>) -> f64 {
        let side = expected.bounding_box().unwrap().largest_side();
        let distances = expected.points.iter().zip(moved).map(|(p, x)| (found * x - p).norm());
        distances.fold(0.0, f64::max) / side
    }

    fn reference(soup: &Soup) -> Reference {
        Reference::new(&soup.points, &soup.triangles).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn any_similarity_is_undone(soup in any_shape(), s in any_similarity()) {
            let suspect = moved(&soup, &s);
            let found = register(&reference(&soup), &suspect, &soup.triangles, &RegisterOptions::default()).unwrap();
            prop_assert!(found.converged);
            prop_assert!(found.overlap > 0.99 && found.suspect_overlap > 0.99);
            prop_assert!(error(&soup, &suspect, &found.reference_from_suspect) < 1e-9);
        }

        #[test]
        fn both_ways_are_inverse(soup in any_shape(), s in any_similarity()) {
            let suspect = moved(&soup, &s);
            let there = reference(&Soup::new(suspect, soup.triangles.clone()));
            let found = register(&there, &soup.points, &soup.triangles, &RegisterOptions::default()).unwrap();
            let rest = s.inverse() * found.reference_from_suspect;
            prop_assert!(error(&soup, &soup.points, &rest) < 1e-9);
        }

        #[test]
        fn noise_leaves_little(s in any_similarity(), seed: u64) {
            let soup = shapes::part(4);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let radius = 0.002 * soup.bounding_box().unwrap().largest_side();
            let mut jitter = || Vector3::from_fn(|_, _| rng.random_range(-radius..radius));
            let noisy = Soup::new(soup.points.iter().map(|p| p + jitter()).collect(), soup.triangles.clone());
            let suspect = moved(&noisy, &s);
            let found = register(&reference(&soup), &suspect, &soup.triangles, &RegisterOptions::default()).unwrap();
            prop_assert!(error(&noisy, &suspect, &found.reference_from_suspect) < 1e-3);
        }
    }

    #[test]
    fn other_tessellations_and_orders_do_not_matter() {
        let fine = shapes::bumpy_sphere(4000);
        let coarse = shapes::bumpy_sphere(2000);
        let s = Similarity3::new(Vector3::new(3.0, 2.0, 1.0), Vector3::new(-1.0, 2.0, 0.5), 4.0);
        let suspect = moved(&coarse, &s);
        let found =
            register(&reference(&fine), &suspect, &coarse.triangles, &RegisterOptions::default()).unwrap();
        assert!(error(&coarse, &suspect, &found.reference_from_suspect) < 2e-3);
    }

    #[test]
    fn faces_turned_inside_out_do_not_matter() {
        let soup = shapes::part(2);
        let s = Similarity3::new(Vector3::new(3.0, 2.0, 1.0), Vector3::new(-1.0, 2.0, 0.5), 4.0);
        let suspect = moved(&soup, &s);
        let flipped: Vec<_> = soup.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let found = register(&reference(&soup), &suspect, &flipped, &RegisterOptions::default()).unwrap();
        assert!(error(&soup, &suspect, &found.reference_from_suspect) < 1e-9);
    }

    #[test]
    fn a_symmetric_shape_has_alternatives() {
        for soup in [shapes::torus(24, 12, 2.0, 0.7), shapes::genus(1, 4), shapes::cube(), shapes::sphere(3)]
        {
            let s = Similarity3::new(Vector3::new(3.0, 2.0, 1.0), Vector3::new(-1.0, 2.0, 0.5), 4.0);
            let suspect = moved(&soup, &s);
            let found =
                register(&reference(&soup), &suspect, &soup.triangles, &RegisterOptions::default()).unwrap();
            let side = soup.bounding_box().unwrap().largest_side();
            assert!(found.rms < 1e-2 * side && found.overlap > 0.99);
            assert!(!found.alternatives.is_empty());
            assert!(found.alternatives.iter().all(|a| a.score >= found.score));
        }
    }

    #[test]
    fn another_shape_gets_a_bad_score() {
        let suspect = shapes::torus(24, 12, 2.0, 0.7);
        let options = RegisterOptions::default();
        let found =
            register(&reference(&shapes::bust(12)), &suspect.points, &suspect.triangles, &options).unwrap();
        assert!(found.score > 0.5, "{found:?}");
        assert!(found.rms.is_finite() && (0.0..=1.0).contains(&found.overlap));
    }

    #[test]
    fn threads_do_not_matter() {
        let soup = shapes::bust(12);
        let s = Similarity3::new(Vector3::new(3.0, 2.0, 1.0), Vector3::new(-1.0, 2.0, 0.5), 4.0);
        let (suspect, reference) = (moved(&soup, &s), reference(&soup));
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                register(&reference, &suspect, &soup.triangles, &RegisterOptions::default()).unwrap()
            })
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn extreme_units_do_not_matter() {
        let soup = shapes::part(1);
        for scale in [1e-30, 1e30] {
            let s =
                Similarity3::new(Vector3::new(3.0, 2.0, 1.0) * scale, Vector3::new(-1.0, 2.0, 0.5), scale);
            let suspect = moved(&soup, &s);
            let found =
                register(&reference(&soup), &suspect, &soup.triangles, &RegisterOptions::default()).unwrap();
            assert!(error(&soup, &suspect, &found.reference_from_suspect) < 1e-9);
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let soup = shapes::part(1);
        let reference = reference(&soup);
        let side = Side::Suspect;
        let ask = |points: &[Point3<f64>], triangles: &[[u32; 3]]| {
            register(&reference, points, triangles, &RegisterOptions::default()).map(|_| ()).unwrap_err()
        };
        let corner = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        assert_eq!(ask(&[], &[]), RegistrationError::Empty { side });
        assert_eq!(ask(&soup.points, &[]), RegistrationError::Empty { side });
        assert_eq!(ask(&corner, &[[0, 1, 2]]), RegistrationError::Flat { side });
        assert_eq!(ask(&[corner[1]; 3], &[[0, 1, 2]]), RegistrationError::NoArea { side });
        assert_eq!(
            ask(&vec![corner[1]; soup.points.len()], &soup.triangles),
            RegistrationError::NoArea { side }
        );
        assert_eq!(ask(&corner, &[[0, 1, 1]]), RegistrationError::NoArea { side });
        let line: Vec<_> = soup.points.iter().map(|p| Point3::new(p.x, p.x, p.x)).collect();
        assert_eq!(ask(&line, &soup.triangles), RegistrationError::NoArea { side });
        let plane: Vec<_> = soup.points.iter().map(|p| Point3::new(p.x, p.y, 7.0)).collect();
        assert_eq!(ask(&plane, &soup.triangles), RegistrationError::Flat { side });
        let missing = RegistrationError::MissingVertex { side, triangle: 0, vertex: 9, vertices: 3 };
        assert_eq!(ask(&corner, &[[0, 1, 9]]), missing);
        let mut broken = soup.points.clone();
        broken[5].y = f64::NAN;
        assert_eq!(ask(&broken, &soup.triangles), RegistrationError::NotFinite { side, vertex: 5 });
        let tiny: Vec<_> = soup.points.iter().map(|p| p * 1e-320).collect();
        assert_eq!(ask(&tiny, &soup.triangles), RegistrationError::NoArea { side });
        let huge: Vec<_> = soup.points.iter().map(|p| p * 1e307).collect();
        assert!(matches!(
            ask(&huge, &soup.triangles),
            RegistrationError::NoArea { .. } | RegistrationError::SizeRatio
        ));
        assert!(matches!(
            Reference::new(&plane, &soup.triangles),
            Err(RegistrationError::Flat { side: Side::Reference })
        ));
    }

    #[test]
    fn starts_are_checked() {
        let soup = shapes::part(1);
        let ask = |starts| {
            let options = RegisterOptions { starts: Starts::Given(starts), ..RegisterOptions::default() };
            register(&reference(&soup), &soup.points, &soup.triangles, &options)
        };
        assert_eq!(ask(vec![]), Err(RegistrationError::NoStarts));
        let broken = Similarity3::new(Vector3::new(f64::NAN, 0.0, 0.0), Vector3::zeros(), 1.0);
        assert_eq!(ask(vec![Similarity3::identity(), broken]), Err(RegistrationError::Start { index: 1 }));
        let found = ask(vec![Similarity3::identity()]).unwrap();
        assert!(error(&soup, &soup.points, &found.reference_from_suspect) < 1e-12);
    }
}
