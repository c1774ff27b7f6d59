//! Which routes are taken, and what they count for, seen by an examiner that tests nothing.

use crate::{Examiner, Hypothesis, Original, SearchError, SearchOptions, Stages, Suspect, When, search};
use nalgebra::{Point3, Vector3};
use sombrero_basis::BasisOptions;
use sombrero_extraction::Estimate;
use sombrero_mesh::Soup;
use sombrero_shapes::bumpy_sphere;
use sombrero_stats::LogProbability;
use std::sync::LazyLock;

static ORIGINAL: LazyLock<Original> = LazyLock::new(|| original(&bumpy_sphere(400)));

fn original(shape: &Soup) -> Original {
    let options = BasisOptions { coefficients: 20, ..BasisOptions::default() };
    Original::new(shape, &options, 0.01).unwrap()
}

/// Says the same p of everything.
struct Fixed {
    log10_p: f64,
    seen: Vec<Hypothesis>,
    /// Of every estimate, in the order in which they were shown.
    coefficients: Vec<Vec<f64>>,
}

impl Examiner for Fixed {
    type Error = SearchError;
    const TESTS: usize = 5;

    fn examine(
        &mut self,
        hypothesis: &Hypothesis,
        estimate: &Estimate,
        _: &mut Stages,
    ) -> Result<(), SearchError> {
        self.seen.push(*hypothesis);
        self.coefficients.push(estimate.coefficients.clone());
        Ok(())
    }

    fn best(&self) -> Option<LogProbability> {
        (!self.seen.is_empty()).then(|| LogProbability::from_log10(self.log10_p))
    }

    fn watermarks(&self) -> usize {
        3
    }
}

/// The number of tests counted, and who was shown the estimates.
fn look(suspect: &Suspect, options: SearchOptions, log10_p: f64) -> Result<(usize, Fixed), SearchError> {
    look_with(&ORIGINAL, suspect, options, log10_p)
}

fn look_with(
    original: &Original,
    suspect: &Suspect,
    options: SearchOptions,
    log10_p: f64,
) -> Result<(usize, Fixed), SearchError> {
    let examiner = Fixed { log10_p, seen: Vec::new(), coefficients: Vec::new() };
    let outcome = search(original, suspect, &options, examiner)?;
    Ok((outcome.counted, outcome.examiner))
}

/// Every nuisance, all tests, for each of the watermarks.
const A_ROUTE: usize = 4 * Fixed::TESTS * 3;

fn without_surfaces() -> SearchOptions {
    SearchOptions { resampling: When::Never, ..SearchOptions::default() }
}

#[test]
fn vertices_that_fit_are_all_there_is_to_see() {
    let (counted, examiner) =
        look(&ORIGINAL.suspect(&bumpy_sphere(400)), SearchOptions::default(), 0.0).unwrap();
    assert_eq!(counted, A_ROUTE);
    assert_eq!(examiner.seen.len(), 4);
    assert!(examiner.seen.iter().all(|seen| !seen.resampling && seen.pose.is_some()));
}

#[test]
fn what_is_left_out_because_one_is_certain_counts_all_the_same() {
    let (counted, examiner) =
        look(&ORIGINAL.suspect(&bumpy_sphere(400)), SearchOptions::default(), -1000.0).unwrap();
    assert_eq!((counted, examiner.seen.len()), (A_ROUTE, 1));
    // Of surfaces any number of poses might have come, so the most that could count.
    let always = SearchOptions { resampling: When::Always, ..SearchOptions::default() };
    let (counted, examiner) = look(&ORIGINAL.suspect(&bumpy_sphere(400)), always, -1000.0).unwrap();
    assert_eq!(examiner.seen.len(), 1);
    assert!(examiner.seen[0].resampling && counted >= A_ROUTE && counted % A_ROUTE == 0);
}

/// A suspect with its vertices in reverse order and its faces to match, moved.
fn renumbered(soup: &Soup) -> Soup {
    let last = soup.points.len() as u32 - 1;
    let moved = soup.points.iter().rev().map(|p| Point3::from(2.0 * p.coords + Vector3::x()));
    let triangles = soup.triangles.iter().rev().map(|corners| corners.map(|v| last - v));
    Soup::new(moved.collect(), triangles.collect())
}

/// The sphere with holes that no other numbering has: a whole one can be numbered in more ways than are tried.
#[test]
fn renumbered_vertices_are_told_by_the_connectivity() {
    let mut shape = bumpy_sphere(400);
    for hole in [131, 130, 50, 7] {
        shape.triangles.remove(hole);
    }
    let original = original(&shape);
    let mut marked = original.model().soup().clone();
    let w: Vec<f64> = (0..20).map(|i| f64::from(i % 3) - 1.0).collect();
    let moves = original.basis().displacements(&w, original.epsilon());
    for (point, by) in marked.points.iter_mut().zip(moves) {
        *point += by;
    }
    let suspect = original.suspect(&renumbered(&marked));
    assert_eq!(suspect.correspondence, None);
    let (counted, renumbered) = look_with(&original, &suspect, without_surfaces(), 0.0).unwrap();
    assert_eq!(counted, A_ROUTE);
    assert!(renumbered.seen.iter().all(|seen| !seen.resampling));
    let (_, stored) = look_with(&original, &original.suspect(&marked), without_surfaces(), 0.0).unwrap();
    assert_eq!(renumbered.coefficients.len(), stored.coefficients.len());
    for (a, b) in renumbered.coefficients.iter().zip(&stored.coefficients) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} {b:?}");
    }
}

#[test]
fn another_connectivity_needs_surfaces() {
    let other = ORIGINAL.suspect(&bumpy_sphere(300));
    assert!(matches!(look(&other, without_surfaces(), 0.0), Err(SearchError::NeedsResampling)));
    let as_it_is = SearchOptions { registration: When::Never, ..SearchOptions::default() };
    let (counted, examiner) = look(&other, as_it_is, 0.0).unwrap();
    assert_eq!((counted, examiner.seen.len()), (A_ROUTE, 4));
    assert!(examiner.seen.iter().all(|seen| seen.resampling && seen.pose.is_none()));
}
