//! What of a displacement tells: its normal component, after what an attacker may have done to the shape is taken out.
//!
//! ```text
//! d'E d = Σ_v d_v' S_v d_v - |Uᵀ d|²,      S_v = Σ_f A_f/3 n_f n_fᵀ over the faces around v
//! ```
//!
//! with U an orthonormal basis, in the first form, of the nuisances: free-form deformation by a lattice of 4 × 4 × 4
//! control points (products of Legendre polynomials up to degree 3 span the same) and what smoothing filters do to the
//! surface. Whoever extracts solves for those too, so a displacement that they explain says nothing.

use crate::envelope::{Envelope, Factor, dot};
use crate::surface::Surface;
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::BoundingBox;

/// Scalar fields of the lattice.
const LATTICE: usize = 64;

/// E on the vertices of a surface.
#[derive(Debug, Clone)]
pub(crate) struct Evidence {
    /// S_v.
    weights: Vec<Matrix3<f64>>,
    /// U, three rows a vertex: what one unit along each axis gives.
    nuisances: Vec<[Vec<f64>; 3]>,
    columns: usize,
}

impl Evidence {
    /// `modes` are what filters do to the surface: for each a vector at each vertex.
    pub(crate) fn new(surface: &Surface, modes: &[Vec<Vector3<f64>>]) -> Self {
        let weights = weights(surface);
        let bounds = BoundingBox::of(&surface.points);
        let scalars: Vec<Vec<f64>> = surface.points.iter().map(|p| lattice(p, bounds)).collect();
        let columns = 3 * LATTICE + modes.len();
        // S_v N_v: what a unit along each axis has in common with each nuisance.
        let common = |v: usize| {
            let s = weights[v];
            [0, 1, 2].map(|axis| {
                let mut row = Vec::with_capacity(columns);
                row.extend(scalars[v].iter().flat_map(|psi| [0, 1, 2].map(|a| s[(axis, a)] * psi)));
                row.extend(modes.iter().map(|mode| s.row(axis).dot(&mode[v].transpose())));
                row
            })
        };
        let common: Vec<[Vec<f64>; 3]> = (0..weights.len()).into_par_iter().map(common).collect();
        let (scale, factor) = factor(&weights, &scalars, modes, &common);
        let orthogonal = |mut rows: [Vec<f64>; 3]| {
            for row in &mut rows {
                row.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s);
                factor.solve_lower(row);
            }
            rows
        };
        let nuisances = common.into_par_iter().map(orthogonal).collect();
        Self { weights, nuisances, columns }
    }

    /// S_v d.
    pub(crate) fn weigh(&self, vertex: u32, d: &Vector3<f64>) -> Vector3<f64> {
        self.weights[vertex as usize] * d
    }

    /// Uᵀ d of displacements of some vertices.
    pub(crate) fn explained<'a>(&self, field: impl IntoIterator<Item = (u32, &'a Vector3<f64>)>) -> Vec<f64> {
        let mut sums = vec![0.0; self.columns];
        for (v, d) in field {
            let [x, y, z] = &self.nuisances[v as usize];
            let rows = x.iter().zip(y).zip(z);
            sums.iter_mut().zip(rows).for_each(|(sum, ((x, y), z))| *sum += x * d.x + y * d.y + z * d.z);
        }
        sums
    }

    /// U u at a vertex.
    pub(crate) fn explaining(&self, vertex: u32, u: &[f64]) -> Vector3<f64> {
        let [x, y, z] = &self.nuisances[vertex as usize];
        Vector3::new(dot(x, u), dot(y, u), dot(z, u))
    }
}

fn weights(surface: &Surface) -> Vec<Matrix3<f64>> {
    let mut weights = vec![Matrix3::zeros(); surface.points.len()];
    for (f, corners) in surface.triangles.iter().enumerate() {
        let n = surface.facets.normals[f];
        let outer = n * n.transpose() * (surface.facets.areas[f] / 3.0);
        corners.iter().for_each(|&v| weights[v as usize] += outer);
    }
    weights
}

/// The factor of NᵀSN scaled to a unit diagonal, and the scale.
fn factor(
    weights: &[Matrix3<f64>],
    scalars: &[Vec<f64>],
    modes: &[Vec<Vector3<f64>>],
    common: &[[Vec<f64>; 3]],
) -> (Vec<f64>, Factor) {
    /// Against rounding.
    const RIDGE: f64 = 1e-11;
    let lattice = 3 * LATTICE;
    let columns = lattice + modes.len();
    // The lattice's part for each pair of axes: Σ S_v[a, b] ψ ψᵀ.
    let pairs: Vec<(usize, usize)> = (0..3).flat_map(|a| (0..=a).map(move |b| (a, b))).collect();
    let part = |&(a, b): &(usize, usize)| {
        let mut sums = vec![0.0; LATTICE * LATTICE];
        for (psi, s) in scalars.iter().zip(weights) {
            for (row, x) in sums.chunks_exact_mut(LATTICE).zip(psi) {
                let x = x * s[(a, b)];
                row.iter_mut().zip(psi).for_each(|(sum, y)| *sum += x * y);
            }
        }
        sums
    };
    let parts: Vec<Vec<f64>> = pairs.par_iter().map(part).collect();
    let of_pair =
        |a: usize, b: usize| &parts[pairs.iter().position(|&p| p == (a.max(b), a.min(b))).unwrap_or(0)];
    let mut rows = vec![vec![0.0; columns]; columns];
    for (i, row) in rows.iter_mut().take(lattice).enumerate() {
        for (j, entry) in row.iter_mut().take(lattice).enumerate() {
            *entry = of_pair(i % 3, j % 3)[(i / 3) * LATTICE + j / 3];
        }
    }
    for (k, mode) in modes.iter().enumerate() {
        for (d, common) in mode.iter().zip(common) {
            for (axis, row) in common.iter().enumerate() {
                rows[lattice + k].iter_mut().zip(row).for_each(|(sum, x)| *sum += d[axis] * x);
            }
        }
    }
    let scale: Vec<f64> =
        (0..columns).map(|i| if rows[i][i] > 0.0 { rows[i][i].sqrt().recip() } else { 0.0 }).collect();
    let mut matrix = Envelope::zeros(vec![0; columns]);
    for i in 0..columns {
        for j in 0..=i {
            matrix.add(i, j, rows[i][j] * scale[i] * scale[j]);
        }
        matrix.add(i, i, 1.0 + RIDGE - matrix.diagonal(i));
    }
    (scale, matrix.factor())
}

/// The products of P_0 to P_3 of the coordinates, scaled to [-1, 1] over the bounding box.
fn lattice(p: &Point3<f64>, bounds: Option<BoundingBox>) -> Vec<f64> {
    let Some(bounds) = bounds else { return vec![0.0; LATTICE] };
    let (centre, half) = (nalgebra::center(&bounds.min, &bounds.max), bounds.sides() / 2.0);
    let least = 0.05 * half.max();
    let [x, y, z] = [0, 1, 2].map(|a| legendre((p[a] - centre[a]) / half[a].max(least)));
    (0..LATTICE).map(|k| x[k / 16] * y[k / 4 % 4] * z[k % 4]).collect()
}

fn legendre(x: f64) -> [f64; 4] {
    [1.0, x, (3.0 * x * x - 1.0) / 2.0, (5.0 * x * x - 3.0) * x / 2.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn what_nuisances_explain_says_nothing() {
        let soup = shapes::bust(24);
        let surface = Surface::new(soup.points, soup.triangles);
        let mode: Vec<Vector3<f64>> =
            surface.points.iter().map(|p| Vector3::new((9.0 * p.x).sin(), (7.0 * p.y).cos(), 0.3)).collect();
        let evidence = Evidence::new(&surface, std::slice::from_ref(&mode));
        let value = |field: &[Vector3<f64>]| {
            let all = || (0..).zip(field);
            let whole: f64 = all().map(|(v, d)| d.dot(&evidence.weigh(v, d))).sum();
            let explained: f64 = evidence.explained(all()).iter().map(|u| u * u).sum();
            (whole - explained) / whole
        };
        let bounds = BoundingBox::of(&surface.points).unwrap();
        let (low, sides) = (bounds.min, bounds.sides());
        let unit = |p: &Point3<f64>| (p - low).component_div(&sides);
        // One control point of the lattice: Bernstein polynomials.
        let bend: Vec<Vector3<f64>> = surface
            .points
            .iter()
            .map(|p| {
                let x = unit(p);
                let b = |t: f64| 3.0 * t * (1.0 - t) * (1.0 - t);
                Vector3::new(0.3, 1.0, -0.5) * (b(x.x) * b(x.y) * b(x.z))
            })
            .collect();
        assert!(value(&bend) < 1e-6, "{}", value(&bend));
        assert!(value(&mode) < 1e-6, "{}", value(&mode));
        let ripple: Vec<Vector3<f64>> = (0..)
            .zip(&surface.points)
            .map(|(v, p)| {
                let n = evidence.weigh(v, &Vector3::new(1.0, 1.0, 1.0));
                n * (40.0 * unit(p).x).sin()
            })
            .collect();
        assert!(value(&ripple) > 0.5, "{}", value(&ripple));
    }
}
