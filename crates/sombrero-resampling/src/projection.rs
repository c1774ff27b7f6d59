//! Projects the samples of the suspect onto the deforming original: π of E_dist.
//!
//! Samples are drawn once. A sample without a counterpart is left out of the round: it is too far away
//! (the suspect has something added there) or its projection faces the other way (the far side of a thin
//! wall, or a part that the crop took away from in front).

use nalgebra::{Point3, Vector3};
use rand::Rng;
use sombrero_mesh::Soup;
use sombrero_spatial::{Surface, SurfaceSample, sample_surface};

use crate::distance::Attachment;
use crate::frame::{Frame, Lists};

/// A sample nearer than this (in largest sides) to its foot has no direction of its own.
const TOUCHING: f64 = 1e-9;

/// Points drawn on the suspect, and the original as it deforms.
pub(crate) struct Projection {
    samples: Vec<Sample>,
    surface: Surface,
}

struct Sample {
    position: Point3<f64>,
    /// Unit normal of the suspect; zero on a face without area.
    normal: Vector3<f64>,
    /// The face of the original that was closest last.
    face: u32,
}

/// What holds the samples now.
pub(crate) struct Attached {
    /// What holds the samples, by face.
    pub(crate) attachments: Lists<Attachment>,
    /// How many samples are attached.
    pub(crate) count: usize,
    /// Sum of their squared distances.
    pub(crate) squared: f64,
}

impl Projection {
    /// Draws `count` samples on the suspect, which is in the units of `frame`.
    pub(crate) fn new<R: Rng + ?Sized>(frame: &Frame, suspect: &Soup, count: usize, rng: &mut R) -> Self {
        let drawn = sample_surface(&suspect.points, &suspect.triangles, count, rng);
        let place = |s: &SurfaceSample| {
            let corners = suspect.triangles[s.face as usize].map(|v| suspect.points[v as usize].coords);
            let position = s.point(&suspect.points, &suspect.triangles)?;
            Some(Sample { position, normal: normal(&corners), face: 0 })
        };
        let mut samples: Vec<Sample> = drawn.iter().filter_map(place).collect();
        let surface = Surface::new(&positions(&frame.points), &frame.faces);
        let queries: Vec<Point3<f64>> = samples.iter().map(|s| s.position).collect();
        for (sample, closest) in samples.iter_mut().zip(surface.closest_many(&queries)) {
            sample.face = closest.map_or(0, |c| c.face);
        }
        // Neighbours in the list are then neighbours on the surface, which memory rewards in every round.
        samples.sort_by_key(|s| s.face);
        Self { samples, surface }
    }

    /// How many samples were drawn.
    pub(crate) fn count(&self) -> usize {
        self.samples.len()
    }

    /// Attaches each sample to its closest point on the original at `points`, unless that is farther than
    /// `max_distance` or faces the other way.
    pub(crate) fn attach(&mut self, frame: &Frame, points: &[Vector3<f64>], max_distance: f64) -> Attached {
        self.surface.refit(&positions(points));
        let queries: Vec<Point3<f64>> = self.samples.iter().map(|s| s.position).collect();
        let starts: Vec<u32> = self.samples.iter().map(|s| s.face).collect();
        let found = self.surface.closest_many_from(&queries, &starts);
        let mut held = Vec::with_capacity(self.samples.len());
        let mut squared = 0.0;
        for (sample, closest) in self.samples.iter_mut().zip(found) {
            let Some(closest) = closest else { continue };
            sample.face = closest.face;
            let normal = normal(&frame.faces[closest.face as usize].map(|v| points[v as usize]));
            if closest.distance() > max_distance || sample.normal.dot(&normal) < 0.0 {
                continue;
            }
            squared += closest.squared_distance;
            let attachment = Attachment {
                sample: sample.position.coords,
                barycentric: closest.barycentric,
                direction: direction(&(sample.position - closest.point), &normal),
            };
            held.push((closest.face, attachment));
        }
        Attached { count: held.len(), attachments: Lists::new(frame.faces.len(), &held), squared }
    }
}

fn positions(points: &[Vector3<f64>]) -> Vec<Point3<f64>> {
    points.iter().map(|p| Point3::from(*p)).collect()
}

/// u of E_dist: from foot to sample, or the normal when the two are one.
fn direction(offset: &Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    let length = offset.norm();
    if length > TOUCHING { offset / length } else { *normal }
}

/// Unit normal of a triangle; zero without area.
pub(crate) fn normal([a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    let area = (b - a).cross(&(c - a));
    area.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite())).unwrap_or_default()
}
