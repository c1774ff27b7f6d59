//! The poses in which the suspect's surface fits the original's.

use crate::error::SearchError;
use crate::glance::Glance;
use crate::limits::{CORRESPONDS, MOST_POSES};
use crate::options::When;
use crate::outline::Outline;
use crate::placement::{Placement, mirror_image};
use crate::stages::Stages;
use nalgebra::{Affine3, Point3, Similarity3};
use sombrero_mesh::Soup;
use sombrero_registration::{RegisterOptions, Registration, register, register_affine};

/// The number of points that tell where a suspect lies.
const ENOUGH: usize = 2000;
/// Agreement below which two shapes have nothing in common: right poses of attacked models have 0.5 to 1.
const IN_COMMON: f64 = 0.25;
/// A mirror image is looked at where its fit is not worse by more than this factor than the fit of the suspect itself.
const MIRROR_FITS: f64 = 1.5;

/// Maps from the suspect to the original, and what the user should know of them.
pub(crate) struct Poses {
    /// Best first, [`MOST_POSES`] at most.
    pub(crate) found: Vec<Affine3<f64>>,
    /// Whether the shapes have next to nothing in common.
    pub(crate) unrelated: bool,
    pub(crate) warning: Option<String>,
}

/// The similarities in which a suspect may fit; or that it has to be taken where it is, and the reason.
#[derive(Debug)]
pub(crate) enum Similar {
    Found(Registration),
    AsItIs(Option<String>),
}

impl Similar {
    /// Whether the surfaces say that the suspect shows the original.
    pub(crate) fn is_trusted(&self) -> bool {
        matches!(self, Self::Found(found) if found.trusted)
    }

    /// Whether there are poses, and none of them can be trusted.
    pub(crate) fn is_doubted(&self) -> bool {
        matches!(self, Self::Found(found) if !found.trusted)
    }

    /// Whether they say that it has next to nothing in common with the original.
    pub(crate) fn is_apart(&self) -> bool {
        matches!(self, Self::Found(found) if !found.trusted && found.agreement < IN_COMMON)
    }

    /// Best first, [`MOST_POSES`] at most.
    pub(crate) fn poses(&self) -> Vec<Affine3<f64>> {
        match self {
            Self::Found(found) => {
                found.poses().map(|pose| affine(pose.reference_from_suspect)).take(MOST_POSES).collect()
            }
            Self::AsItIs(_) => vec![Affine3::identity()],
        }
    }

    /// The score up to which a pose of the mirror image fits about as well, or better.
    pub(crate) fn limit_of_mirror_image(&self) -> f64 {
        match self {
            Self::Found(found) if found.trusted => MIRROR_FITS * found.best.score,
            _ => f64::INFINITY,
        }
    }
}

/// The similarities that the surfaces cannot tell from the best.
pub(crate) fn similar(
    outline: &Outline,
    suspect: &Soup,
    registration: When,
    seconds: &mut Stages,
) -> Result<Similar, SearchError> {
    if registration == When::Never {
        return Ok(Similar::AsItIs(None));
    }
    let found = seconds.time("registration", || {
        register(outline.reference()?, &suspect.points, &suspect.triangles, &RegisterOptions::default())
    });
    match found {
        Ok(found) => Ok(Similar::Found(found)),
        Err(error) if registration == When::Always => Err(error.into()),
        Err(error) => Ok(Similar::AsItIs(Some(format!(
            "The suspect was taken where it is: it cannot be registered: {error}."
        )))),
    }
}

/// The poses of the suspect's mirror image, where they can be trusted and their score is not above `limit`.
pub(crate) fn mirrored(
    outline: &Outline,
    suspect: &Soup,
    limit: f64,
    seconds: &mut Stages,
) -> Vec<Affine3<f64>> {
    let image = mirror_image(suspect);
    let found = seconds.time("mirror image", || {
        register(outline.reference()?, &image.points, &image.triangles, &RegisterOptions::default())
    });
    let Ok(found) = found else { return Vec::new() };
    if !found.trusted || found.best.score > limit {
        return Vec::new();
    }
    let map = |similarity| Placement { similarity, mirrored: true }.map();
    found.poses().map(|pose| map(pose.reference_from_suspect)).take(MOST_POSES).collect()
}

/// Every pose that the surfaces cannot tell from the best: similarities, or the affine maps that fit where no similarity does.
pub(crate) fn poses(
    outline: &Outline,
    suspect: &Soup,
    registration: When,
    similar: Similar,
    stretched: Option<Vec<Affine3<f64>>>,
) -> Result<Poses, SearchError> {
    if let Some(found) = stretched {
        return Ok(Poses { found, unrelated: false, warning: None });
    }
    let mut found = similar.poses();
    let mut unrelated = similar.is_apart();
    let trusted = match similar {
        Similar::Found(found) => found.trusted,
        Similar::AsItIs(warning) => return Ok(Poses { found, unrelated, warning }),
    };
    let warning = (!trusted).then(|| Glance::ANOTHER_SHAPE.to_owned());
    if registration == When::Auto && lies_elsewhere(outline, suspect, &found)? {
        found.insert(0, Affine3::identity());
        found.truncate(MOST_POSES);
        unrelated = false;
    }
    Ok(Poses { found, unrelated, warning })
}

/// The affine maps that fit, where they can be trusted; best first, [`MOST_POSES`] at most.
pub(crate) fn stretched(
    outline: &Outline,
    suspect: &Soup,
    seconds: &mut Stages,
) -> Option<Vec<Affine3<f64>>> {
    let found = seconds.time("registration", || {
        let options = RegisterOptions::default();
        register_affine(outline.reference()?, &suspect.points, &suspect.triangles, &options)
    });
    let found = found.ok().filter(|found| found.trusted)?;
    Some(found.poses().map(|pose| pose.reference_from_suspect).take(MOST_POSES).collect())
}

/// Whether the suspect lies on the original as it is, and none of the poses says so: a small piece that nobody moved
/// may fit better somewhere else.
pub(crate) fn lies_elsewhere(
    outline: &Outline,
    suspect: &Soup,
    poses: &[Affine3<f64>],
) -> Result<bool, SearchError> {
    let near = CORRESPONDS * outline.model().largest_side();
    let stride = suspect.points.len().div_ceil(ENOUGH).max(1);
    let some: Vec<Point3<f64>> = suspect.points.iter().step_by(stride).copied().collect();
    let moves = |pose: &Affine3<f64>| {
        let squares: f64 = some.iter().map(|p| (pose * p - p).norm_squared()).sum();
        (squares / some.len().max(1) as f64).sqrt() > near
    };
    Ok(poses.iter().all(moves) && outline.reference()?.distance(&some) < near)
}

fn affine(similarity: Similarity3<f64>) -> Affine3<f64> {
    Affine3::from_matrix_unchecked(similarity.to_homogeneous())
}
