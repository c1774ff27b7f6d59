//! What is seen of a displacement: a quadratic form G, as a sum of squares of linear functionals.
//!
//! ```text
//! d'G d = Σ_f A |dn|² + ℓ² Σ_e 3 l²/max(A₁ + A₂, 0.2 l²) dθ² + η Σ_f A |strain|² + Σ_v A_v |d|²/L²
//! ```
//!
//! with dn the change of a face's normal, dθ that of an edge's dihedral angle (a quarter of its weight where the surface
//! has a crease, since nobody sees it there), strain what the triangle is stretched and sheared by in its plane, and the
//! last term for where the surface is. Shading shows dn, highlights and reflections show dθ. For a triangle with unit
//! normal n and gradients g_k of its corners' hat functions
//!
//! ```text
//! dn = -Σ_k g_k (n · d_k),      g_k = n × e_k / 2A,      e_k the edge opposite corner k,
//! ```
//!
//! to first order in d.

use crate::surface::{Hinge, Surface};
use nalgebra::Vector3;

/// ℓ, in largest sides.
const BENDING: f64 = 0.02;
/// η.
const STRAIN: f64 = 0.02;
/// The weight of dθ at a crease.
const CREASE: f64 = 0.25;
/// What the faces of an edge have as area at least, in squares of its length. How sharply a sliver bends nobody sees, and
/// weighed by its area it would count more than all that is around.
const STOUT: f64 = 0.2;
/// The cosine of the angle from which an edge is a crease: 25 degrees.
const CREASE_COSINE: f64 = 0.906_307_787_036_65;

/// A linear functional of the displacements of up to four vertices, Σ g_k · d_k, whose square counts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    pub(crate) vertices: [u32; 4],
    /// With the root of the term's weight in them.
    pub(crate) gradients: [Vector3<f64>; 4],
    /// How many of the four there are.
    pub(crate) count: usize,
}

impl Term {
    fn of_face(corners: [u32; 3], gradients: [Vector3<f64>; 3]) -> Self {
        let [a, b, c] = corners;
        let [x, y, z] = gradients;
        Self { vertices: [a, b, c, c], gradients: [x, y, z, Vector3::zeros()], count: 3 }
    }
}

/// All terms of the face: normal (two), strain (three).
pub(crate) fn face_terms(surface: &Surface, face: usize) -> [Term; 5] {
    let corners = surface.triangles[face];
    let Some(frame) = Frame::new(surface, face) else {
        return [Term::of_face(corners, [Vector3::zeros(); 3]); 5];
    };
    let root = surface.facets.areas[face].sqrt();
    let Frame { normal, along, across, gradients } = frame;
    let turn = |t: Vector3<f64>| Term::of_face(corners, gradients.map(|g| normal * (g.dot(&t) * root)));
    let strain = |p: Vector3<f64>, q: Vector3<f64>, factor: f64| {
        let symmetric = |g: Vector3<f64>| (q * g.dot(&p) + p * g.dot(&q)) * (factor * root * STRAIN.sqrt());
        Term::of_face(corners, gradients.map(symmetric))
    };
    // |e|² = e₁₁² + e₂₂² + 2 e₁₂².
    let shear = std::f64::consts::FRAC_1_SQRT_2;
    [
        turn(along),
        turn(across),
        strain(along, along, 0.5),
        strain(across, across, 0.5),
        strain(along, across, shear),
    ]
}

/// The change of the dihedral angle, with its weight.
pub(crate) fn hinge_term(surface: &Surface, hinge: &Hinge) -> Option<Term> {
    let [first, second] = hinge.faces.map(|f| f as usize);
    let cosine = surface.facets.normals[first].dot(&surface.facets.normals[second]);
    let crease = if cosine < CREASE_COSINE { CREASE } else { 1.0 };
    let [a, b] = hinge.ends.map(|v| surface.points[v as usize]);
    let length = (b - a).norm();
    let areas = (surface.facets.areas[first] + surface.facets.areas[second]).max(STOUT * length * length);
    bend(surface, hinge, (3.0 * crease / areas).sqrt() * length * BENDING * surface.side)
}

/// The change of the dihedral angle times `weight`; `None` beside faces without area.
pub(crate) fn bend(surface: &Surface, hinge: &Hinge, weight: f64) -> Option<Term> {
    let [i, j] = hinge.ends.map(|v| surface.points[v as usize]);
    let edge = j - i;
    let length = edge.norm();
    let [first, second] = hinge.faces.map(|f| f as usize);
    let [n, m] = [first, second].map(|f| surface.facets.normals[f]);
    if length <= 0.0 || n == Vector3::zeros() || m == Vector3::zeros() {
        return None;
    }
    let direction = edge / length;
    let [a, b] = hinge.ends;
    let vertices = [a, b, hinge.opposite[0], hinge.opposite[1]];
    let mut gradients = [Vector3::zeros(); 4];
    for (face, sign) in [(first, -1.0), (second, 1.0)] {
        let Frame { normal, gradients: hats, .. } = Frame::new(surface, face)?;
        // The part of dn across the edge is how far the face turns about it.
        let across = direction.cross(&normal);
        for (corner, g) in surface.triangles[face].into_iter().zip(hats) {
            let place = vertices.iter().position(|&v| v == corner)?;
            gradients[place] += normal * (sign * weight * g.dot(&across));
        }
    }
    Some(Term { vertices, gradients, count: 4 })
}

/// A face's normal, two directions in its plane, and the gradients of its corners' hat functions.
struct Frame {
    normal: Vector3<f64>,
    along: Vector3<f64>,
    across: Vector3<f64>,
    gradients: [Vector3<f64>; 3],
}

impl Frame {
    /// `None` for a face without area.
    fn new(surface: &Surface, face: usize) -> Option<Self> {
        let normal = surface.facets.normals[face];
        let [a, b, c] = surface.corners(face);
        let along = (b - a).try_normalize(0.0)?;
        if normal == Vector3::zeros() {
            return None;
        }
        let twice = 2.0 * surface.facets.areas[face];
        let gradients = [c - b, a - c, b - a].map(|e| normal.cross(&e) / twice);
        Some(Self { normal, along, across: normal.cross(&along), gradients })
    }
}

/// Σ g_k · d_k.
pub(crate) fn value(term: &Term, d: &[Vector3<f64>]) -> f64 {
    (0..term.count).map(|k| term.gradients[k].dot(&d[term.vertices[k] as usize])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use sombrero_shapes as shapes;

    #[test]
    fn the_terms_are_derivatives_of_normals_and_angles() {
        let soup = shapes::bumpy_sphere(200);
        let surface = Surface::new(soup.points.clone(), soup.triangles.clone());
        let d: Vec<Vector3<f64>> = (0..soup.points.len())
            .map(|v| {
                let t = v as f64;
                Vector3::new((1.3 * t).sin(), (0.7 * t).cos(), (2.1 * t).sin())
            })
            .collect();
        let step = 1e-6;
        let moved = |step: f64| {
            let points: Vec<Point3<f64>> = soup.points.iter().zip(&d).map(|(p, d)| p + d * step).collect();
            Surface::new(points, soup.triangles.clone())
        };
        let (before, after) = (moved(-step), moved(step));
        for f in 0..soup.triangles.len() {
            let turned = ((after.facets.normals[f] - before.facets.normals[f]) / (2.0 * step)).norm_squared();
            let [a, b, ..] = face_terms(&surface, f).map(|t| value(&t, &d));
            let expected = turned * surface.facets.areas[f];
            assert!((a * a + b * b - expected).abs() < 1e-4 * expected.max(1e-3), "{f}");
        }
        for hinge in &surface.hinges {
            let angle = |s: &Surface| {
                let [a, b] = hinge.faces.map(|f| s.facets.normals[f as usize]);
                let edge = s.points[hinge.ends[1] as usize] - s.points[hinge.ends[0] as usize];
                a.cross(&b).dot(&edge.normalize()).atan2(a.dot(&b))
            };
            let change = (angle(&after) - angle(&before)) / (2.0 * step);
            let [first, second] = hinge.faces.map(|f| f as usize);
            let length =
                (surface.points[hinge.ends[1] as usize] - surface.points[hinge.ends[0] as usize]).norm();
            let crease = if surface.facets.normals[first].dot(&surface.facets.normals[second]) < CREASE_COSINE
            {
                CREASE
            } else {
                1.0
            };
            let areas = surface.facets.areas[first] + surface.facets.areas[second];
            let areas = areas.max(STOUT * length * length);
            let weight = (3.0 * crease / areas).sqrt() * length * BENDING * surface.side;
            let term = hinge_term(&surface, hinge).unwrap();
            assert!(
                (value(&term, &d).abs() - (weight * change).abs()).abs()
                    < 1e-4 * (weight * change).abs().max(1e-3)
            );
        }
    }

    #[test]
    fn turning_and_moving_strain_and_bend_nothing() {
        let soup = shapes::part(2);
        let surface = Surface::new(soup.points.clone(), soup.triangles.clone());
        let turn = Vector3::new(0.3, -0.2, 0.5);
        let d: Vec<Vector3<f64>> =
            soup.points.iter().map(|p| turn.cross(&p.coords) + Vector3::new(1.0, 2.0, 3.0)).collect();
        for f in 0..soup.triangles.len() {
            let strain: f64 = face_terms(&surface, f)[2..].iter().map(|t| value(t, &d).abs()).sum();
            assert!(strain < 1e-9, "{f}: {strain}");
        }
        for hinge in &surface.hinges {
            let term = hinge_term(&surface, hinge).unwrap();
            assert!(value(&term, &d).abs() < 1e-9);
        }
    }
}
