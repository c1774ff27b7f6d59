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

use nalgebra::{Affine3, Matrix3, Matrix4, Point3, Similarity3, Vector3};

use crate::affine_map::AffineMap;
use crate::error::{RegistrationError, Side};
use crate::icp::{Icp, IcpOptions, ROUGH_REACH, ROUNDS, Run};
use crate::isotropic;
use crate::judge::{Fit, Judge};
use crate::lookup::Lookup;
use crate::matching::Matching;
use crate::motion::Motion;
use crate::orientation::orientations;
use crate::reference::Reference;
use crate::register::{HYPOTHESIS_REACH, MATCHING, RegisterOptions, Starts};
use crate::rotations;
use crate::sample::{Sample, scattered};
use crate::search::{Candidate, GOOD, REFINING, SYMMETRIES, Search};
use crate::shape::{Shape, to_unit};
use crate::verdict::is_trusted;
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

/// An affine map of the suspect and how well it fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AffinePose {
    /// Maps points of the suspect to the frame of the reference, in model units.
    pub reference_from_suspect: Affine3<f64>,
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

/// What [`register_affine`] and [`refine_affine`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct AffineRegistration {
    /// The best map.
    pub best: AffinePose,
    /// Share of the two surfaces that lie within half a percent of the reference's diagonal of each other.
    pub agreement: f64,
    /// Of what has a counterpart, the share that is so close to it.
    pub sharpness: f64,
    /// Whether the suspect shows the reference, as far as the surfaces tell: see
    /// [`Registration::trusted`](crate::Registration::trusted).
    pub trusted: bool,
    /// Iterations of the winning map, coarse and fine.
    pub iterations: usize,
    /// Whether the last step was below the tolerance, rather than the last one allowed.
    pub converged: bool,
    /// Other maps that fit about as well, best first: a symmetric shape has them.
    pub alternatives: Vec<AffinePose>,
}

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
) -> Result<AffineRegistration, RegistrationError> {
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
        Starts::Auto => search.concluded(auto(&search, reference)),
        Starts::Given(starts) => {
            let starts = crate::register::given(&reference.shape, &suspect, starts)?;
            search.refined(search.tried(starts.iter().map(AffineMap::from).collect(), ROUGH_REACH))
        }
        Starts::Moments => search.refined(by_rotation(&search)),
    };
    let candidates = search.with_symmetries(candidates, reference.symmetries());
    report(&search, &candidates, options.max_alternatives)
}

/// Makes an affine map of a similarity that already brings the suspect about into its place.
///
/// `start` maps suspect to reference, in model units. The suspect may show only a part of the reference.
///
/// # Errors
/// As [`align`](crate::align).
pub fn refine_affine(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    start: &Similarity3<f64>,
    options: &IcpOptions,
) -> Result<AffineRegistration, RegistrationError> {
    options.check()?;
    let suspect = Shape::new(Side::Suspect, points, triangles)?;
    let start = to_unit(&reference.shape, &suspect, start).ok_or(RegistrationError::Start { index: 0 })?;
    let icp = Icp::new(&reference.shape, &suspect, options);
    let progress = Progress::new("registration", ROUNDS);
    let run = icp.all_rounds(start.map(), ROUGH_REACH, options.max_iterations, || progress.advance(1));
    let fit = Judge::fine(&reference.shape, &suspect, options).fit(&run.pose);
    finished(&reference.shape, &suspect, &[Candidate { run, fit }], 0)
}

fn auto(search: &Search, reference: &Reference) -> Vec<Candidate<AffineMap>> {
    let mut candidates = by_rotation(search);
    for orientation in orientations(search.reference, search.suspect) {
        if candidates.first().is_some_and(|best| best.fit.score <= GOOD) {
            break;
        }
        let matching = Matching::new(reference, search.suspect, *orientation);
        let maps = matching.affine_maps(HYPOTHESES);
        search.progress.advance(MATCHING);
        candidates.extend(search.tried(maps, HYPOTHESIS_REACH));
        candidates = search.sorted(candidates);
    }
    candidates
}

/// Both surfaces in isotropic position, and the rotations that are then left.
fn by_rotation(search: &Search) -> Vec<Candidate<AffineMap>> {
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
    search.tried(starts, ROUGH_REACH)
}

fn report(
    search: &Search,
    candidates: &[Candidate<AffineMap>],
    most: usize,
) -> Result<AffineRegistration, RegistrationError> {
    finished(search.reference, search.suspect, candidates, most)
}

fn finished(
    reference: &Shape,
    suspect: &Shape,
    candidates: &[Candidate<AffineMap>],
    most: usize,
) -> Result<AffineRegistration, RegistrationError> {
    let poses = candidates.iter().take(most + 1).map(|c| pose(reference, suspect, c));
    let mut poses = poses.collect::<Result<Vec<_>, _>>()?.into_iter();
    let (Some(first), Some(best)) = (candidates.first(), poses.next()) else {
        return Err(RegistrationError::NoStarts);
    };
    let Run { iterations, converged, .. } = first.run;
    Ok(AffineRegistration {
        best,
        agreement: first.fit.agreement(),
        sharpness: first.fit.sharpness(),
        trusted: is_trusted(&first.fit),
        iterations,
        converged,
        alternatives: poses.collect(),
    })
}

/// In model units.
fn pose(
    reference: &Shape,
    suspect: &Shape,
    candidate: &Candidate<AffineMap>,
) -> Result<AffinePose, RegistrationError> {
    let Fit { score, rms, overlap, suspect_overlap, .. } = candidate.fit;
    let map = candidate.run.pose;
    let linear: Matrix3<f64> = map.linear * (reference.diagonal / suspect.diagonal);
    let shift: Vector3<f64> =
        reference.centre.coords + map.shift * reference.diagonal - linear * suspect.centre.coords;
    let mut matrix: Matrix4<f64> = linear.to_homogeneous();
    matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
    let reference_from_suspect =
        nalgebra::try_convert::<_, Affine3<f64>>(matrix).ok_or(RegistrationError::SizeRatio)?;
    Ok(AffinePose { reference_from_suspect, rms: rms * reference.diagonal, overlap, suspect_overlap, score })
}
