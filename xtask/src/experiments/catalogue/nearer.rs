//! How far the attack moved an original's surface, and how far that of another model lies from it.
//!
//! Both are root mean squares over the same points: those of the original that the suspect shows. Another model is laid where the
//! search laid it. One that is no farther than the attack cannot be told from the right one by shape.

use super::measure::Original;
use super::queries::{Suspect, moved};
use nalgebra::Point3;
use sombrero::attacks::mirror;
use sombrero::mesh::Soup;
use sombrero::spatial::{Surface, spread_samples};
use sombrero_catalogue::{Candidate, Question};

/// Points on a suspect.
const SAMPLES: usize = 1500;

/// What of the original a suspect shows.
pub(super) struct Shown {
    /// Points of the original, where they are in the suspect.
    points: Vec<Point3<f64>>,
    /// Root of the area of the suspect's share.
    size: f64,
    /// How far the attack moved them, relative to `size`.
    pub(super) attack: f64,
}

impl Shown {
    pub(super) fn of(original: &Original, suspect: &Suspect) -> Self {
        let Some(own) = &suspect.own else { return Self::unmoved(&suspect.soup) };
        let original = original.soup();
        let source = if suspect.mirrored { mirror(&original) } else { original };
        let unmoved = Self::unmoved(own);
        let surface = Surface::new(&source.points, &source.triangles);
        let found: Vec<_> = unmoved.points.iter().filter_map(|p| surface.closest(p)).collect();
        let attack = rms(found.iter().map(|closest| closest.squared_distance)) / unmoved.size;
        let points = found.iter().map(|closest| suspect.pose * closest.point).collect();
        Self { points, size: unmoved.size * suspect.pose.scaling(), attack }
    }

    fn unmoved(soup: &Soup) -> Self {
        let samples = spread_samples(&soup.points, &soup.triangles, SAMPLES);
        let points = samples.iter().filter_map(|s| s.point(&soup.points, &soup.triangles)).collect();
        let size = sombrero_landmarks::area(&soup.points, &soup.triangles).sqrt();
        Self { points, size, attack: 0.0 }
    }

    /// How far a candidate's surface lies from these points, relative to the suspect's size.
    pub(super) fn distance(&self, candidate: &Candidate, model: &Soup) -> f64 {
        let model = if candidate.mirrored { mirror(model) } else { model.clone() };
        let model = moved(&model, &candidate.pose);
        let surface = Surface::new(&model.points, &model.triangles);
        let squared = self.points.iter().filter_map(|p| surface.closest(p));
        rms(squared.map(|closest| closest.squared_distance)) / self.size
    }
}

/// The distances of the first candidates, relative to the suspect's size, as [`Shown::distance`] has them.
pub(super) fn distances(
    shown: &Shown,
    suspect: &Suspect,
    question: &Question,
    before: &[Candidate],
    model: impl Fn(&str) -> Option<Soup>,
) -> Vec<f64> {
    let distance = |candidate: &Candidate| {
        let soup = model(&candidate.entry.name)?;
        // Of a kit whose parts were moved, only the part that the candidate was found by stands still.
        let part = candidate.part.filter(|_| suspect.own.is_none()).and_then(|part| question.part(part));
        Some(match part {
            Some(part) => Shown::unmoved(&part).distance(candidate, &soup),
            None => shown.distance(candidate, &soup),
        })
    };
    before.iter().map(|candidate| distance(candidate).unwrap_or(f64::INFINITY)).collect()
}

fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}
