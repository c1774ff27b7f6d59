//! The last round: an original's landmarks are laid on the suspect's surface, and the distances that remain are what tells
//! siblings apart.
//!
//! Each step minimises Σ w (n · (q + ω × q + t + s q - c))² over a small turn ω, shift t and growth s, with q the landmarks
//! where the pose puts them, c their closest points, n the normals there (point to plane: Chen and Medioni 1992), and
//! w = (1 - d²/τ²)² within the distance τ (Tukey's biweight), which becomes smaller from step to step.

use nalgebra::{Point3, SMatrix, SVector, Similarity3, Translation3, UnitQuaternion, Vector3};
use sombrero_spatial::{Closest, Surface};

use crate::matching::{Fit, flipped};
use crate::portrait::Likeness;

/// τ by step, relative to the root of the suspect's area.
const REACHES: [f64; 10] = [0.08, 0.08, 0.06, 0.06, 0.04, 0.04, 0.03, 0.03, 0.02, 0.02];
/// Cosine between normals from which a landmark may lie on a place.
const TURNED: f64 = 0.4;
/// Distance of a landmark that lies on nothing.
const FAR: f64 = 1.0;

/// An original's landmarks laid on the suspect.
#[derive(Debug, Clone)]
pub(crate) struct Settled {
    /// From the likeness to the suspect, in their units; applied after x was negated when the fit is mirrored.
    pub(crate) pose: Similarity3<f64>,
    /// Distance of each landmark, relative to the root of the suspect's area, ascending.
    distances: Vec<f64>,
}

impl Settled {
    /// A distance that a quarter of the landmarks are within.
    pub(crate) fn quartile(&self) -> f64 {
        self.distances.get(self.distances.len() / 4).copied().unwrap_or(FAR)
    }

    /// How much of the original lies on the suspect within `reach`, and of the suspect on the original, as the geometric mean
    /// of both shares.
    pub(crate) fn score(&self, reach: f64) -> f64 {
        let on: f64 = self.distances.iter().map(|d| (1.0 - (d / reach).powi(2)).max(0.0)).sum();
        let share = on / self.distances.len().max(1) as f64;
        let covered = (share * self.pose.scaling().powi(2)).min(1.0);
        (share * covered).sqrt()
    }
}

/// Lays the landmarks of `likeness` on the surface, starting from `fit`.
pub(crate) fn settle(surface: &Surface, normals: &[Vector3<f64>], likeness: &Likeness, fit: &Fit) -> Settled {
    let flip = |v| flipped(v, fit.mirrored);
    let marks: Vec<(Point3<f64>, Vector3<f64>)> =
        likeness.marks.iter().map(|m| (Point3::from(flip(m.point().coords)), flip(m.normal()))).collect();
    let normal = |closest: &Closest| normals[closest.face as usize];
    let mut pose = fit.pose;
    let mut faces = vec![0; marks.len()];
    for reach in REACHES {
        let mut system = System::default();
        for ((p, m), face) in marks.iter().zip(&mut faces) {
            let q = pose * p;
            let Some(closest) = surface.closest_from(&q, *face) else { continue };
            *face = closest.face;
            let n = normal(&closest);
            let near = 1.0 - closest.squared_distance / (reach * reach);
            if near > 0.0 && agrees(&(pose.isometry.rotation * m), &n) {
                system.add(&q.coords, &n, n.dot(&(closest.point - q)), near * near);
            }
        }
        pose = system.step().map_or(pose, |step| step * pose);
    }
    let distance = |((p, m), face): (&(Point3<f64>, Vector3<f64>), &u32)| {
        let found = surface.closest_from(&(pose * p), *face)?;
        agrees(&(pose.isometry.rotation * m), &normal(&found)).then(|| found.distance())
    };
    let mut distances: Vec<f64> = marks.iter().zip(&faces).map(|m| distance(m).unwrap_or(FAR)).collect();
    distances.sort_by(f64::total_cmp);
    Settled { pose, distances }
}

/// Which way round the suspect's faces are is nobody's business.
fn agrees(a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    a.dot(b).abs() > TURNED
}

/// Normal equations in ω, t and s.
#[derive(Default)]
struct System {
    matrix: SMatrix<f64, 7, 7>,
    right: SVector<f64, 7>,
    count: usize,
}

impl System {
    fn add(&mut self, q: &Vector3<f64>, n: &Vector3<f64>, wanted: f64, weight: f64) {
        let turn = q.cross(n);
        let row = SVector::<f64, 7>::from([turn.x, turn.y, turn.z, n.x, n.y, n.z, q.dot(n)]);
        self.matrix += row * row.transpose() * weight;
        self.right += row * (wanted * weight);
        self.count += 1;
    }

    fn step(mut self) -> Option<Similarity3<f64>> {
        // What the landmarks leave open, as the turn of a cylinder, stays as it is.
        let damping = 1e-4 * self.matrix.trace() / 7.0;
        self.matrix += SMatrix::identity() * damping;
        let x = (self.count >= 7).then(|| self.matrix.cholesky()).flatten()?.solve(&self.right);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[0], x[1], x[2]));
        let growth = 1.0 + x[6].clamp(-0.2, 0.2);
        x.iter()
            .all(|x| x.is_finite())
            .then(|| Similarity3::from_parts(Translation3::new(x[3], x[4], x[5]), turn, growth))
    }
}
