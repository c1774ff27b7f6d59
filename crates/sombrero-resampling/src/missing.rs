//! Which vertices of the fitted original are on the suspect.
//!
//! The paper calls a vertex missing when it "lacks a corresponding point on the attacked mesh" (section 6)
//! and leaves the rule open. Ours: a vertex is present when all of these hold, c being the point of the
//! suspect closest to its fitted position.
//!
//! 1. It has a face.
//! 2. c is near: within the missing distance over the suspect's faces; where c is on the suspect's boundary
//!    the vertex may lie beyond it, so there within half the length of its edges.
//! 3. The suspect does not face the other way at c, as the far side of a thin wall would.
//! 4. Samples are attached around it, where by area many should be. This finds parts that are gone although
//!    some other part of the suspect is near.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::Soup;
use sombrero_spatial::{Closest, Rim, Surface};

use crate::frame::Frame;
use crate::projection::normal;

/// Cosine of normals below which two surfaces face opposite ways. At a crease the normals of the vertex and
/// of one of the faces at it differ by up to a right angle and more.
const OPPOSITE: f64 = -0.5;

/// Samples to expect before their absence says anything.
const MANY: f64 = 30.0;

/// Share of the expected samples below which a neighbourhood counts as gone.
const FEW: f64 = 0.1;

/// Weight of a corner up to which a closest point lies on the edge opposite to it. Fitted vertices end up on vertices and
/// edges of the suspect to within the fit's tolerance: so near the rim they count as on it.
const ON_RIM: f64 = 1e-9;

/// What presence is told by.
pub(crate) struct Evidence<'a> {
    pub(crate) frame: &'a Frame,
    /// Fitted positions.
    pub(crate) points: &'a [Vector3<f64>],
    /// In the units of the frame.
    pub(crate) suspect: &'a Soup,
    /// Samples attached to each face.
    pub(crate) held: &'a [f64],
    /// Samples per unit of area.
    pub(crate) density: f64,
    /// Farthest that a vertex may be from the suspect.
    pub(crate) distance: f64,
}

/// `present(..)[v]`: whether vertex v has a counterpart on the suspect.
pub(crate) fn present(evidence: &Evidence<'_>) -> Vec<bool> {
    let Evidence { frame, points, suspect, distance, .. } = *evidence;
    let surface = Surface::new(&suspect.points, &suspect.triangles);
    let rim = Rim::new(&suspect.triangles);
    let queries: Vec<Point3<f64>> = points.iter().map(|p| Point3::from(*p)).collect();
    let normals = vertex_normals(frame, points);
    let supported = supported(evidence);
    let near = |v: usize, c: &Closest| {
        let limit = if rim.holds(c, ON_RIM) { distance.min(half_edge(frame, v)) } else { distance };
        let corners = suspect.triangles[c.face as usize].map(|i| suspect.points[i as usize].coords);
        c.distance() <= limit && normal(&corners).dot(&normals[v]) >= OPPOSITE
    };
    let is_present = |(v, closest): (usize, Option<Closest>)| {
        frame.is_used(v) && supported[v] && closest.is_some_and(|c| near(v, &c))
    };
    surface.closest_many(&queries).into_iter().enumerate().map(is_present).collect()
}

/// Half the mean rest length of the springs at a vertex.
fn half_edge(frame: &Frame, vertex: usize) -> f64 {
    let springs = frame.springs.of(vertex);
    let total: f64 = springs.iter().map(|(_, rest)| rest).sum();
    0.5 * total / springs.len().max(1) as f64
}

/// Unit normals of the fitted vertices, faces weighted by area.
fn vertex_normals(frame: &Frame, points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut sums: Vec<Vector3<f64>> = vec![Vector3::zeros(); points.len()];
    for &face in &frame.faces {
        let [a, b, c] = face.map(|v| points[v as usize]);
        let area = (b - a).cross(&(c - a));
        face.iter().for_each(|&v| sums[v as usize] += area);
    }
    sums.into_iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default()).collect()
}

/// Whether the neighbourhood of each vertex, the faces around it and around its neighbours, holds the
/// samples that its area asks for.
fn supported(evidence: &Evidence<'_>) -> Vec<bool> {
    let Evidence { frame, held, density, .. } = *evidence;
    let over_ring = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let ring = |v: usize| frame.corners.of(v).iter().map(|&c| value(c as usize / 3)).sum();
        (0..frame.points.len()).map(ring).collect()
    };
    let over_neighbours = |ring: Vec<f64>| -> Vec<f64> {
        let sum =
            |v: usize| ring[v] + frame.springs.of(v).iter().map(|&(u, _)| ring[u as usize]).sum::<f64>();
        (0..ring.len()).map(sum).collect()
    };
    let found = over_neighbours(over_ring(&|f| held[f]));
    let expected = over_neighbours(over_ring(&|f| frame.area(f) * density));
    found
        .into_iter()
        .zip(expected)
        .map(|(found, expected)| expected < MANY || found >= FEW * expected)
        .collect()
}
