//! Registration without a hint: starts, a quick refinement of each, the fit as the measure.
//!
//! ```text
//! poses by moments ─► sharp? ─► ICP on few samples ─► fit both ways ─► good? ─► the best few: ICP on many ─► fit ─► verdict
//!                        ▲                                               │ no
//!                        └──── poses by landmarks that look alike ◄──────┘
//! ```
//!
//! Whether a start is sharp, a table tells ([`screen`](crate::starts::screen)): of another shape hardly any is.
//!
//! Poses that end in the same place are one. Poses that fit the reference as well as the best, which
//! symmetric shapes have, are kept: which of them is right only an extraction can tell, and whoever tries
//! several counts them. When no pose is anything like a fit, the search ends early and says so.

use nalgebra::{Point3, Similarity3};

use crate::candidate::{Candidate, answer};
use crate::error::{RegistrationError, Side};
use crate::options::{RegisterOptions, Starts};
use crate::reference::Reference;
use crate::refinement::icp::ROUGH_REACH;
use crate::result::Registration;
use crate::search::{GOOD, HYPOTHESIS_REACH, MATCHING, REFINED, REFINING, SYMMETRIES, Search};
use crate::starts::matcher::LandmarkMatcher;
use crate::starts::orientation::orientations;
use crate::starts::principal_axes;
use crate::starts::screen::{FEW, Screen};
use crate::surface::frame::all_to_unit;
use crate::surface::shape::Shape;
use sombrero_progress::Progress;

/// Poses by landmarks that are tried on the surfaces themselves.
const HYPOTHESES: usize = 16;
/// Poses by moments at most.
const MOMENTS: usize = 24;

/// Brings the suspect onto the reference.
///
/// # Errors
/// [`RegistrationError`] when the suspect has no shape, a start is no similarity, or an option is out of
/// range. A suspect that is another shape altogether gives a pose that is not [trusted](Registration::trusted).
pub fn register(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    options: &RegisterOptions,
) -> Result<Registration, RegistrationError> {
    options.icp.check()?;
    let suspect = Shape::new(Side::Suspect, points, triangles)?;
    let starts = match &options.starts {
        Starts::Auto => MOMENTS + 2 * (MATCHING + HYPOTHESES),
        Starts::Moments => MOMENTS,
        Starts::Given(starts) => starts.len(),
    };
    let progress = Progress::new("registration", starts + REFINING + SYMMETRIES);
    let search = Search::new(&reference.shape, &suspect, options, progress);
    let candidates = match &options.starts {
        Starts::Auto => search.concluded(auto(&search, reference), || reference.symmetries()),
        Starts::Moments => search.concluded(by_moments(&search, reference), || reference.symmetries()),
        Starts::Given(starts) => search
            .refined(search.tried(all_to_unit(&reference.shape, &suspect, starts)?, ROUGH_REACH), REFINED),
    };
    let candidates = search.with_symmetries(candidates, || reference.symmetries());
    answer(&reference.shape, &suspect, &candidates, options.max_alternatives)
}

fn auto(search: &Search, reference: &Reference) -> Vec<Candidate<Similarity3<f64>>> {
    let (lookup, orientations) = (reference.lookup(), orientations(search.reference, search.suspect));
    let screen = Screen::new(lookup, search.suspect, orientations);
    let moments = principal_axes::by_moments(search.reference, search.suspect);
    let mut candidates = search.tried(screen.passed(moments, FEW), ROUGH_REACH);
    for orientation in orientations {
        if candidates.first().is_some_and(|best| best.fit.score <= GOOD) {
            break;
        }
        let matcher = LandmarkMatcher::new(reference.landmarks(), lookup, search.suspect, *orientation);
        let poses = matcher.poses(HYPOTHESES);
        search.progress.advance(MATCHING);
        candidates.extend(search.tried(screen.passed(poses, FEW), HYPOTHESIS_REACH));
        candidates = search.sorted(candidates);
    }
    candidates
}

/// Of a suspect that is whole, for which the right one of these is sharp.
fn by_moments(search: &Search, reference: &Reference) -> Vec<Candidate<Similarity3<f64>>> {
    let orientations = orientations(search.reference, search.suspect);
    let screen = Screen::new(reference.lookup(), search.suspect, orientations);
    let moments = principal_axes::by_moments(search.reference, search.suspect);
    search.tried(screen.passed(moments, 1), ROUGH_REACH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use sombrero_mesh::Soup;
    use sombrero_shapes as shapes;

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
            prop_assert!(found.best.overlap > 0.99 && found.best.suspect_overlap > 0.99);
            prop_assert!(error(&soup, &suspect, &found.best.reference_from_suspect) < 1e-9);
        }

        #[test]
        fn both_ways_are_inverse(soup in any_shape(), s in any_similarity()) {
            let suspect = moved(&soup, &s);
            let there = reference(&Soup::new(suspect, soup.triangles.clone()));
            let found = register(&there, &soup.points, &soup.triangles, &RegisterOptions::default()).unwrap();
            let rest = s.inverse() * found.best.reference_from_suspect;
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
            prop_assert!(error(&noisy, &suspect, &found.best.reference_from_suspect) < 1e-3);
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
        assert!(error(&coarse, &suspect, &found.best.reference_from_suspect) < 2e-3);
    }

    #[test]
    fn faces_turned_inside_out_do_not_matter() {
        let soup = shapes::part(2);
        let s = Similarity3::new(Vector3::new(3.0, 2.0, 1.0), Vector3::new(-1.0, 2.0, 0.5), 4.0);
        let suspect = moved(&soup, &s);
        let flipped: Vec<_> = soup.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let found = register(&reference(&soup), &suspect, &flipped, &RegisterOptions::default()).unwrap();
        assert!(error(&soup, &suspect, &found.best.reference_from_suspect) < 1e-9);
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
            assert!(found.best.rms < 1e-2 * side && found.best.overlap > 0.99);
            assert!(!found.alternatives.is_empty());
            assert!(found.alternatives.iter().all(|a| a.score >= found.best.score));
        }
    }

    #[test]
    fn another_shape_gets_a_bad_score() {
        let suspect = shapes::torus(24, 12, 2.0, 0.7);
        let options = RegisterOptions::default();
        let found =
            register(&reference(&shapes::bust(12)), &suspect.points, &suspect.triangles, &options).unwrap();
        assert!(found.best.score > 0.5, "{found:?}");
        assert!(found.best.rms.is_finite() && (0.0..=1.0).contains(&found.best.overlap));
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
            assert!(error(&soup, &suspect, &found.best.reference_from_suspect) < 1e-9);
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
        assert!(error(&soup, &soup.points, &found.best.reference_from_suspect) < 1e-12);
    }
}
