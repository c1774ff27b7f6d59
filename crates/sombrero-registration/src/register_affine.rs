//! Suspects that were stretched: affine maps, 12 degrees of freedom.
//!
//! ```text
//! isotropic position of both ─► all rotations ─► rough ICP ─┐
//!                                        (a whole suspect)  ├─► affine ICP ─► fit both ways ─► the best
//! landmarks that look alike ─► rough ICP, then affine ──────┘
//!                                        (a cut one)
//! ```
//!
//! The landmarks' descriptions change with the stretch, but slowly: among many matches some give a similarity
//! that is near enough for the affine ICP to take over.

use nalgebra::{Affine3, Point3};

use crate::candidate::{Candidate, answer};
use crate::error::{RegistrationError, Side};
use crate::options::{RegisterOptions, Starts};
use crate::reference::Reference;
use crate::refinement::affine_map::AffineMap;
use crate::refinement::icp::ROUGH_REACH;
use crate::refinement::motion::Motion;
use crate::result::Registration;
use crate::search::{GOOD, HYPOTHESIS_REACH, MATCHING, REFINED, REFINING, SYMMETRIES, Search};
use crate::starts::isotropic;
use crate::starts::matcher::LandmarkMatcher;
use crate::starts::orientation::orientations;
use crate::starts::rotations;
use crate::starts::screen::{FEW, Screen};
use crate::surface::frame::all_to_unit;
use crate::surface::lookup::Lookup;
use crate::surface::sample::{Sample, scattered};
use crate::surface::shape::Shape;
use sombrero_progress::Progress;

/// Samples that stand for a surface in isotropic position.
const SAMPLES: usize = 4_000;
/// Those by which rotations are tried.
const LOOKS: usize = 256;
/// RMS distance from the centre in isotropic position, which makes the size about 1.
const RADIUS: f64 = 0.3;
/// Rotations in isotropic position, and maps by landmarks, that are tried on the surfaces themselves.
const ROTATIONS: usize = 8;
const HYPOTHESES: usize = 24;
/// What all rotations count in [`Progress`], where a trial counts 1.
const ROTATING: usize = 10;
/// Share of the samples that a rotation has to put onto the surface.
const LEAST: f64 = 0.3;

/// Brings a suspect that may also have been stretched onto the reference, without a hint.
///
/// Finds maps whose condition (the largest over the smallest stretch) is up to about 1.5, of suspects that may
/// lack a third; when nothing is cut off, much larger ones too. Of `options` it uses `icp` and
/// `max_alternatives`, and `starts` when they are given.
///
/// # Errors
/// As [`register`](crate::register()).
pub fn register_affine(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    options: &RegisterOptions,
) -> Result<Registration<Affine3<f64>>, RegistrationError> {
    options.icp.check()?;
    let suspect = Shape::new(Side::Suspect, points, triangles)?;
    let starts = match &options.starts {
        Starts::Auto => 2 * (ROTATING + ROTATIONS + MATCHING + HYPOTHESES),
        Starts::Given(starts) => starts.len(),
        Starts::Moments => 2 * (ROTATING + ROTATIONS),
    };
    let progress = Progress::new("registration", starts + REFINING + SYMMETRIES);
    let search = Search::new(&reference.shape, &suspect, options, progress);
    let candidates = match &options.starts {
        Starts::Auto => search.concluded(auto(&search, reference), || reference.symmetries()),
        Starts::Given(starts) => {
            let starts = all_to_unit(&reference.shape, &suspect, starts)?;
            search.refined(search.tried(starts.iter().map(AffineMap::from).collect(), ROUGH_REACH), REFINED)
        }
        Starts::Moments => search.refined(search.tried(by_rotation(&search), ROUGH_REACH), REFINED),
    };
    let candidates = search.with_symmetries(candidates, || reference.symmetries());
    answer(&reference.shape, &suspect, &candidates, options.max_alternatives)
}

fn auto(search: &Search, reference: &Reference) -> Vec<Candidate<AffineMap>> {
    let (lookup, orientations) = (reference.lookup(), orientations(search.reference, search.suspect));
    let screen = Screen::new(lookup, search.suspect, orientations);
    let mut candidates = search.tried(screen.passed(by_rotation(search), FEW), ROUGH_REACH);
    for orientation in orientations {
        if candidates.first().is_some_and(|best| best.fit.score <= GOOD) {
            break;
        }
        let matcher = LandmarkMatcher::new(reference.landmarks(), lookup, search.suspect, *orientation);
        let maps = matcher.affine_maps(HYPOTHESES);
        search.progress.advance(MATCHING);
        candidates.extend(search.tried(screen.passed(maps, FEW), HYPOTHESIS_REACH));
        candidates = search.sorted(candidates);
    }
    candidates
}

/// Both surfaces in isotropic position, and the rotations that are then left.
fn by_rotation(search: &Search) -> Vec<AffineMap> {
    let isotropic = |shape: &Shape, orientation: f64| {
        let samples = scattered(shape, SAMPLES, orientation);
        let map = isotropic::position(&samples, RADIUS)?;
        let moved = |s: &Sample| {
            let face_normal = map.normal(&s.face_normal).try_normalize(0.0).unwrap_or_default();
            Sample { point: map.point(&s.point), normal: map.normal(&s.normal), face_normal }
                .with_unit_normal()
        };
        Some((map.inverse()?, map, samples.iter().map(moved).collect::<Vec<_>>()))
    };
    let Some((back, _, samples)) = isotropic(search.reference, 1.0) else { return Vec::new() };
    let lookup = Lookup::of_samples(samples);
    let mut starts = Vec::new();
    for orientation in orientations(search.reference, search.suspect) {
        let Some((_, there, samples)) = isotropic(search.suspect, *orientation) else { continue };
        let looks = &samples[..samples.len().min(LOOKS)];
        let found = rotations::poses(&lookup, looks, &Point3::origin(), LEAST, ROTATIONS);
        search.progress.advance(ROTATING);
        starts.extend(found.iter().map(|rotation| back.after(&rotation.map()).after(&there)));
    }
    starts
}
