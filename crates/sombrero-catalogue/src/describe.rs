//! Which landmarks of a piece are looked at, and how they look.

use nalgebra::{Point3, Vector3};
use sombrero_landmarks::{Cloud, SurfacePoint, ladder, surface_points};

use crate::features::{Looks, looks, unusual};
use crate::pieces::Piece;
use crate::rim::Rim;

/// Largest radius of a description, relative to the root of the piece's area.
const LARGEST: f64 = 0.2;
/// Points that stand for the surface.
const SAMPLES: usize = 4500;
/// Places among which landmarks are chosen: every so many of the points.
const STRIDE: usize = 7;
/// Least distance between landmarks, relative to that of as many points on a square grid over the whole surface.
const SPACING: f64 = 0.5;
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
    let places: Vec<SurfacePoint> = points.iter().step_by(STRIDE).copied().collect();
    let cloud = Cloud::new(points, 1.0);
    let seen = |place: &SurfacePoint, more: usize| -> Vec<Looks> {
        let landmark = cloud.landmark(place.point, &ladder(LARGEST, more, more));
        landmark.views.iter().map(|view| looks(&view.features)).collect()
    };
    let landmark = |place: SurfacePoint| {
        let looks = seen(&place, more);
        Landmark { point: place.point, normal: place.normal, looks }
    };
    let rim = Rim::new(piece, &centroid);
    let strange = |place: &SurfacePoint| match seen(place, 0).first() {
        Some(looks) if !rim.is_near(&place.point) => unusual(looks),
        _ => 0,
    };
    let chosen = chosen(places, count, strange);
    Described { centroid, size: piece.size, landmarks: chosen.into_iter().map(landmark).collect() }
}

/// `count` of the places: the strangest ones that keep their distance from each other, and more of the strangest when these are
/// too few. What is strange to a catalogue is so after an attack as well, so that suspect and original choose alike.
fn chosen(
    places: Vec<SurfacePoint>,
    count: usize,
    strange: impl Fn(&SurfacePoint) -> u32,
) -> Vec<SurfacePoint> {
    let mut sorted: Vec<(u32, usize)> = places.iter().map(strange).zip(0..).collect();
    sorted.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    let apart = (SPACING / (count as f64).sqrt()).powi(2);
    let (mut near, mut far): (Vec<SurfacePoint>, Vec<SurfacePoint>) = (Vec::new(), Vec::new());
    for (_, index) in sorted {
        let place = places[index];
        let free = far.iter().all(|other| (other.point - place.point).norm_squared() >= apart);
        if free && far.len() < count { far.push(place) } else { near.push(place) }
    }
    let missing = count.saturating_sub(far.len());
    far.extend(near.into_iter().take(missing));
    far
}

/// Mean cosine between the normals and the directions away from the centroid, which is the origin.
fn outwards(points: &[SurfacePoint]) -> f64 {
    let cosine = |s: &SurfacePoint| s.point.coords.try_normalize(0.0).unwrap_or_default().dot(&s.normal);
    points.iter().map(cosine).sum::<f64>() / points.len().max(1) as f64
}
