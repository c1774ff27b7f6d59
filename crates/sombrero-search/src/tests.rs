//! Which routes are taken, and what they count for, seen by an examiner that tests nothing.

use crate::{
    Examiner, Hypothesis, Look, Looked, Original, SearchError, SearchOptions, Stages, Suspect, When, search,
};
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
#[derive(Clone)]
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

    fn weigh(&self, functions: &[usize], estimate: &Estimate) -> Result<LogProbability, SearchError> {
        assert_eq!(functions.len(), estimate.coefficients.len());
        Ok(LogProbability::ONE)
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
    // The usual look comes last, whatever was seen before.
    let last = outcome.looks.into_iter().rev().find(|looked| looked.look == Look::Whole).unwrap();
    Ok((last.counted, last.examiner))
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
    // Others might have followed, which costs a 63rd.
    assert!(examiner.seen[0].resampling && counted >= A_ROUTE);
    let routes = counted * 63 / 64 / A_ROUTE;
    assert_eq!(counted, (routes * A_ROUTE * 64).div_ceil(63));
}

/// A suspect with its vertices in reverse order and its faces to match, moved.
fn renumbered(soup: &Soup) -> Soup {
    let last = soup.points.len() as u32 - 1;
    let moved = soup.points.iter().rev().map(|p| Point3::from(2.0 * p.coords + Vector3::x()));
    let triangles = soup.triangles.iter().rev().map(|corners| corners.map(|v| last - v));
    Soup::new(moved.collect(), triangles.collect())
}

fn with_holes() -> Soup {
    let mut shape = bumpy_sphere(400);
    for hole in [131, 130, 50, 7] {
        shape.triangles.remove(hole);
    }
    shape
}

/// The sphere with holes that no other numbering has: a whole one can be numbered in more ways than are tried.
#[test]
fn renumbered_vertices_are_told_by_the_connectivity() {
    let shape = with_holes();
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
    // Its mirror image might have followed, which costs a 63rd.
    assert_eq!(counted, (A_ROUTE * 64).div_ceil(63));
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

/// What is seen of a suspect in each look.
fn looks(original: &Original, suspect: &Soup) -> Vec<Looked<Fixed>> {
    let examiner = Fixed { log10_p: 0.0, seen: Vec::new(), coefficients: Vec::new() };
    search(original, &original.suspect(suspect), &SearchOptions::default(), examiner).unwrap().looks
}

/// The shares of the looks sum to at most one, whatever was looked at.
#[test]
fn each_look_pays_for_itself() {
    let soup = two_parts();
    let marked = marked(&original(&soup));
    for suspect in [marked.clone(), mirrored(&marked), laid_elsewhere(&marked), bumpy_sphere(300)] {
        let looks = looks(&original(&soup), &suspect);
        let share = |looked: &Looked<Fixed>| {
            let routes = match looked.look {
                Look::Parts => (1 + looked.parts.len()) as f64,
                _ => looked.examiner.seen.len() as f64 / 4.0,
            };
            routes * A_ROUTE as f64 / looked.counted as f64
        };
        let all: f64 = looks.iter().map(share).sum();
        assert!(all <= 1.0 + 1e-12, "{all}");
    }
}

/// A warp is looked for where the suspect fits and nothing was found clearly.
#[test]
fn a_warp_is_looked_for_last() {
    let always = SearchOptions { resampling: When::Always, ..SearchOptions::default() };
    let suspect = ORIGINAL.suspect(&bumpy_sphere(400));
    for (log10_p, follows) in [(0.0, true), (-15.0, true), (-40.0, false)] {
        let examiner = Fixed { log10_p, seen: Vec::new(), coefficients: Vec::new() };
        let looks = search(&ORIGINAL, &suspect, &always, examiner).unwrap().looks;
        let last = looks.last().unwrap();
        assert_eq!(last.look == Look::Warped, follows, "{log10_p}");
        assert!(!follows || last.examiner.seen[0].nuisance == "warp, smoothing");
    }
}

/// Two spheres of other bumps, side by side.
fn two_parts() -> Soup {
    let (mut both, other) = (bumpy_sphere(400), bumpy_sphere(301));
    let first = both.points.len() as u32;
    both.points.extend(other.points.iter().map(|p| p + Vector3::new(3.0, 0.0, 0.0)));
    both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    both
}

fn marked(original: &Original) -> Soup {
    let mut marked = original.model().soup().clone();
    let w: Vec<f64> = (0..20).map(|i| f64::from(i % 3) - 1.0).collect();
    let moves = original.basis().displacements(&w, original.epsilon());
    marked.points.iter_mut().zip(moves).for_each(|(point, by)| *point += by);
    marked
}

fn mirrored(soup: &Soup) -> Soup {
    let points = soup.points.iter().map(|p| Point3::new(p.x, -p.y, p.z)).collect();
    Soup::new(points, soup.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect())
}

/// Each part turned and moved by itself, in the opposite order.
fn laid_elsewhere(soup: &Soup) -> Soup {
    let turn = |p: &Point3<f64>| match p.x < 1.5 {
        true => Point3::new(p.y + 9.0, -p.x, p.z),
        false => Point3::new(2.0 * p.z, 2.0 * p.y, -2.0 * p.x),
    };
    renumbered(&Soup::new(soup.points.iter().map(turn).collect(), soup.triangles.clone()))
}

#[test]
fn a_mirror_image_is_told_by_its_vertices() {
    let original = original(&with_holes());
    let marked = marked(&original);
    let (_, upright) = look_with(&original, &original.suspect(&marked), without_surfaces(), 0.0).unwrap();
    // With its faces turned round, and stored as they were.
    for turned in [true, false] {
        let mut image = mirrored(&marked);
        if !turned {
            image.triangles.clone_from(&marked.triangles);
        }
        let suspect = original.suspect(&image);
        assert_eq!(suspect.correspondence.is_none(), turned);
        let blank = Fixed { log10_p: 0.0, seen: Vec::new(), coefficients: Vec::new() };
        let looks = search(&original, &suspect, &without_surfaces(), blank).unwrap().looks;
        // Nearly all of its faces lie on others upright too, and only a look in the mirror tells.
        let wanted = if turned { Look::Mirrored } else { Look::Whole };
        let found = looks.iter().find(|looked| looked.look == wanted).unwrap();
        let pose = found.examiner.seen[0].pose.unwrap();
        assert!(pose.matrix().fixed_view::<3, 3>(0, 0).determinant() < 0.0);
        for (a, b) in found.examiner.coefficients[0].iter().zip(&upright.coefficients[0]) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}

#[test]
fn a_mirror_image_is_told_by_its_surface() {
    let other = bumpy_sphere(1500);
    let looks = looks(&original(&bumpy_sphere(1700)), &mirrored(&other));
    let found = looks.iter().find(|looked| looked.look == Look::Mirrored).unwrap();
    assert!(found.examiner.seen.iter().all(|seen| seen.resampling && seen.look == Look::Mirrored));
    let pose = found.examiner.seen[0].pose.unwrap();
    let off = |(p, image): (&Point3<f64>, &Point3<f64>)| (pose * image - p).norm();
    let worst = other.points.iter().zip(&mirrored(&other).points).map(off).fold(0.0, f64::max);
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn parts_that_were_laid_elsewhere_are_found_one_by_one() {
    let soup = two_parts();
    let original = original(&soup);
    let marked = marked(&original);
    let looks = looks(&original, &laid_elsewhere(&marked));
    let parts = looks.iter().find(|looked| looked.look == Look::Parts).unwrap();
    let places: Vec<_> = parts.parts.iter().map(|part| (part.part, part.component)).collect();
    assert_eq!(places, [(0, 1), (1, 0)]);
    assert!(parts.parts.iter().all(|part| part.coverage == 1.0));
    // What the parts say together is what the whole says where it lies.
    let (_, whole) = look_with(&original, &original.suspect(&marked), SearchOptions::default(), 0.0).unwrap();
    let differ = |(a, b): (&f64, &f64)| (a - b).abs();
    let worst =
        parts.examiner.coefficients[0].iter().zip(&whole.coefficients[0]).map(differ).fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst}");
}

#[test]
fn one_part_alone_is_found() {
    let soup = two_parts();
    let original = original(&soup);
    let mut marked = marked(&original);
    let first = bumpy_sphere(400).points.len() as u32;
    marked.triangles.retain(|t| t[0] >= first);
    let (alone, _) = laid_elsewhere(&marked).compacted();
    // Its connectivity says which part it is, in as many ways as it is symmetric, and its shape which of them is right.
    let found = looks(&original, &alone);
    assert!(found[0].look == Look::Whole && found.iter().all(|looked| looked.look != Look::Parts));
    assert!(found[0].examiner.seen[0].pose.is_some());
}

/// Whichever part's connectivity it has, its shape says which it is.
#[test]
fn one_of_two_parts_of_like_connectivity_is_found() {
    let ball = bumpy_sphere(400);
    let first = ball.points.len();
    let mut soup = ball.clone();
    soup.points.extend(ball.points.iter().map(|p| Point3::new(3.0 + p.x, 1.2 * p.y, p.z)));
    soup.triangles.extend(ball.triangles.iter().map(|t| t.map(|v| v + first as u32)));
    let original = original(&soup);
    let mut marked = marked(&original);
    marked.triangles.retain(|t| t[0] >= first as u32);
    let (alone, _) = laid_elsewhere(&marked).compacted();
    let looks = looks(&original, &alone);
    let parts = looks.iter().find(|looked| looked.look == Look::Parts).unwrap();
    assert_eq!(parts.parts.iter().map(|part| (part.part, part.component)).collect::<Vec<_>>(), [(1, 0)]);
    assert!(parts.examiner.seen[0].pose.is_some());
}
