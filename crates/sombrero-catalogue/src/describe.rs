//! Which landmarks of a piece are looked at, and how they look.

use nalgebra::{Point3, Vector3};
use sombrero_landmarks::{Cloud, SurfacePoint, ladder, surface_points};

use crate::features::{Looks, looks};
use crate::pieces::Piece;

/// Largest radius of a description, relative to the root of the piece's area.
const LARGEST: f64 = 0.17;
/// Points that stand for the surface.
const SAMPLES: usize = 6_000;
/// Mean of the cosines between normals and the directions from the centroid beyond which normals have a side.
const CLEAR: f64 = 0.15;

/// A landmark of a piece, in the piece's unit: about the centroid, lengths relative to the root of the area.
#[derive(Debug, Clone)]
pub(crate) struct Landmark {
    pub(crate) point: Point3<f64>,
    pub(crate) normal: Vector3<f64>,
    /// One for each rung, smallest radii first.
    pub(crate) looks: Vec<Looks>,
}

/// A piece and its landmarks.
#[derive(Debug, Clone)]
pub(crate) struct Described {
    /// Of the surface, in model units.
    pub(crate) centroid: Point3<f64>,
    /// Root of the area, in model units.
    pub(crate) size: f64,
    pub(crate) landmarks: Vec<Landmark>,
}

/// Describes `count` landmarks with `more` rungs of the ladder below and above.
pub(crate) fn described(piece: &Piece, count: usize, more: usize) -> Described {
    let sampled = surface_points(&piece.points, &piece.triangles, SAMPLES);
    let sum: Vector3<f64> = sampled.iter().map(|s| s.point.coords).sum();
    let centroid = Point3::from(sum / sampled.len().max(1) as f64);
    let unit = |s: &SurfacePoint| Point3::from((s.point - centroid) / piece.size);
    let mut points: Vec<_> = sampled.iter().map(|s| SurfacePoint { point: unit(s), ..*s }).collect();
    if outwards(&points) < -CLEAR {
        points.iter_mut().for_each(|s| s.normal = -s.normal);
    }
    let step = (points.len() / count.max(1)).max(1);
    let places: Vec<SurfacePoint> = points.iter().step_by(step).copied().collect();
    let cloud = Cloud::new(points, 1.0);
    let radii = ladder(LARGEST, more, more);
    let landmark = |place: SurfacePoint| Landmark {
        point: place.point,
        normal: place.normal,
        looks: cloud.landmark(place.point, &radii).views.iter().map(|view| looks(&view.features)).collect(),
    };
    Described { centroid, size: piece.size, landmarks: places.into_iter().map(landmark).collect() }
}

/// Mean cosine between the normals and the directions away from the centroid, which is the origin.
fn outwards(points: &[SurfacePoint]) -> f64 {
    let cosine = |s: &SurfacePoint| s.point.coords.try_normalize(0.0).unwrap_or_default().dot(&s.normal);
    points.iter().map(cosine).sum::<f64>() / points.len().max(1) as f64
}
