//! One trial: a model is damaged and moved, and the way back is asked for.

use super::damage::Kind;
use super::moves::{random_affine, random_similarity};
use anyhow::Context;
use nalgebra::{Affine3, Matrix4, Point3, Similarity3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero::attacks::{Operation, Simplification};
use sombrero::mesh::Soup;
use sombrero::registration::{Pose, Reference, RegisterOptions, Registration, register, register_affine};
use sombrero::spatial::Surface;
use std::time::Instant;

/// Farthest that a vertex may be from its place, in largest sides.
const RIGHT: f64 = 0.01;

/// A model and what is made of it once.
pub(super) struct Subject {
    pub(super) name: &'static str,
    pub(super) soup: Soup,
    pub(super) simplified: Soup,
    pub(super) reference: Reference,
    pub(super) surface: Surface,
    pub(super) side: f64,
    pub(super) symmetric: bool,
}

/// One trial.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Outcome {
    pub(super) trial: u64,
    /// Largest error of a vertex, in largest sides, of the best returned pose in this respect.
    pub(super) error: f64,
    /// Place of that pose among those returned.
    pub(super) place: usize,
    /// Largest distance of a vertex from the original's surface under the first pose, in largest sides.
    pub(super) surface: f64,
    pub(super) hypotheses: usize,
    pub(super) right: bool,
    pub(super) trusted: bool,
    /// With the distance in largest sides.
    #[serde(flatten)]
    pub(super) fit: Fit,
    pub(super) cpu_seconds: f64,
    pub(super) wall_seconds: f64,
}

impl Subject {
    pub(super) fn new(name: &'static str, soup: Soup, symmetric: bool) -> anyhow::Result<Self> {
        let mut rng = ChaCha8Rng::seed_from_u64(super::SEED);
        let simplified = Simplification { ratio: 0.5 }.apply(&soup, &mut rng)?.soup;
        let reference = Reference::new(&soup.points, &soup.triangles)?;
        let surface = Surface::new(&soup.points, &soup.triangles);
        let side = soup.bounding_box().context("no triangles")?.largest_side();
        Ok(Self { name, soup, simplified, reference, surface, side, symmetric })
    }

    pub(super) fn trial(
        &self,
        kind: Kind,
        trial: u64,
        others: &[(&str, Soup)],
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Outcome> {
        let damaged = kind.damaged(self, trial, others, rng)?;
        let truth = match kind {
            Kind::Affine | Kind::AffineThirdCut => {
                random_similarity(rng).to_homogeneous() * random_affine(rng)
            }
            _ => random_similarity(rng).to_homogeneous(),
        };
        let points: Vec<_> = damaged.points.iter().map(|p| truth.transform_point(p)).collect();
        let (cpu, wall) = (cpu_seconds(), Instant::now());
        let answer = self.answer(kind, &points, &damaged.triangles)?;
        let (wall_seconds, cpu_seconds) = (wall.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        let errors = answer.poses.iter().map(|pose| self.error(&(pose * truth)));
        let (place, error) =
            errors.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).context("no pose was returned")?;
        let surface = self.surface_error(&(answer.poses[0] * truth));
        Ok(Outcome {
            trial,
            error,
            place,
            surface,
            hypotheses: answer.poses.len(),
            right: kind != Kind::Unrelated && (error < RIGHT || self.symmetric && surface < RIGHT),
            trusted: answer.trusted,
            fit: Fit { rms: answer.fit.rms / self.side, ..answer.fit },
            cpu_seconds,
            wall_seconds,
        })
    }

    fn answer(&self, kind: Kind, points: &[Point3<f64>], triangles: &[[u32; 3]]) -> anyhow::Result<Answer> {
        let (reference, options) = (&self.reference, RegisterOptions::default());
        if matches!(kind, Kind::Affine | Kind::AffineThirdCut) {
            let found = register_affine(reference, points, triangles, &options)?;
            return Ok(Answer::new(&found, Affine3::to_homogeneous));
        }
        let found = register(reference, points, triangles, &options)?;
        Ok(Answer::new(&found, Similarity3::to_homogeneous))
    }

    /// Largest distance of a vertex from its place, in largest sides.
    fn error(&self, rest: &Matrix4<f64>) -> f64 {
        let distance = |p: &Point3<f64>| (rest.transform_point(p) - p).norm();
        self.soup.points.iter().map(distance).fold(0.0, f64::max) / self.side
    }

    /// Largest distance of a vertex from the surface, in largest sides.
    fn surface_error(&self, rest: &Matrix4<f64>) -> f64 {
        let there: Vec<_> = self.soup.points.iter().map(|p| rest.transform_point(p)).collect();
        let closest = self.surface.closest_many(&there);
        closest.iter().map(|c| c.map_or(f64::INFINITY, |c| c.distance())).fold(0.0, f64::max) / self.side
    }
}

/// What the search says.
struct Answer {
    poses: Vec<Matrix4<f64>>,
    trusted: bool,
    fit: Fit,
}

impl Answer {
    fn new<M>(found: &Registration<M>, matrix: impl Fn(&M) -> Matrix4<f64>) -> Self {
        let Registration { best, agreement, sharpness, trusted, .. } = found;
        let &Pose { score, overlap, suspect_overlap, rms, .. } = best;
        let (agreement, sharpness) = (*agreement, *sharpness);
        let fit = Fit { score, overlap, suspect_overlap, agreement, sharpness, rms };
        let poses = found.poses().map(|pose| matrix(&pose.reference_from_suspect)).collect();
        Self { poses, trusted: *trusted, fit }
    }
}

/// How well the pose fits, as registration tells it.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Fit {
    score: f64,
    overlap: f64,
    suspect_overlap: f64,
    agreement: f64,
    sharpness: f64,
    rms: f64,
}

/// Processor time of this process so far, all threads; 0 where the system does not tell.
fn cpu_seconds() -> f64 {
    const TICKS_PER_SECOND: f64 = 100.0;
    let told = || {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        // The name in brackets may hold spaces; user and system time are the 12th and 13th after it.
        let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
        let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
        Some(ticks / TICKS_PER_SECOND)
    };
    told().unwrap_or(0.0)
}
