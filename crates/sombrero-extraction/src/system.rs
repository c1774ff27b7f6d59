//! The normal equations of r = B w + N β, and their solution.
//!
//! Each observation is one scalar equation about a point of the original's surface, seen along one direction n:
//!
//! ```text
//! n · (B w + N β)(x) = n · (p - x),      B(x) = Σ_c bary_c φ_i(v_c) ε a_i d_i,
//! ```
//!
//! with x on a face, or a vertex. With weights W and A = [B N],
//!
//! ```text
//! AᵀWA = | G  C |     AᵀW r = | b |      P = (G - C H⁻¹ Cᵀ) / s²,   P w* = (b - C H⁻¹ c) / s²
//!        | Cᵀ H |             | c |
//! ```
//!
//! eliminates β: P is the precision of w*, the inverse of the covariance of its errors for residuals of variance s².
//! Both unknowns have weak priors while the fit is under way, so that what the suspect does not show stays 0: w is
//! standard Gaussian, as every watermark is, N β is of the order of a tenth of the model, and a filter's strength of
//! one. The answer (`answer.rs`) is w* without the prior, and P as a square.
//!
//! Matrices are multiplied by plain loops in a fixed order: the same bits on every machine, which a library that picks
//! its instructions at run time does not give.

use crate::fields::Fields;
use crate::sums::Sums;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};
use nalgebra_sparse::CsrMatrix;
use rayon::prelude::*;
use sombrero_basis::Basis;

/// One scalar equation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observation {
    /// The face, or one vertex three times.
    pub(crate) corners: [u32; 3],
    /// Barycentric weights.
    pub(crate) weights: [f64; 3],
    /// n, of unit length.
    pub(crate) direction: Vector3<f64>,
    /// n · (p - x), in model units.
    pub(crate) offset: f64,
}

/// B by rows: what the coefficients do to each vertex.
#[derive(Debug, Clone)]
pub(crate) struct MarkMatrix {
    rows: CsrMatrix<f64>,
    /// ε a_i d_i.
    steps: Vec<Vector3<f64>>,
    /// B by rows where functions are vectors.
    vectors: Option<CsrMatrix<Vector3<f64>>>,
}

/// w and β of one solve.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    /// With the prior: for the next iteration.
    pub(crate) w: DVector<f64>,
    pub(crate) beta: DVector<f64>,
    /// s² P as a difference, with its rounding; the lower triangle.
    pub(crate) left: DMatrix<f64>,
    /// The squared lengths of the columns of B, of which it is what is left.
    pub(crate) lengths: Vec<f64>,
    /// s² P w*.
    pub(crate) score: DVector<f64>,
    /// τ of the warp that this solution makes likely, in largest sides.
    pub(crate) spread: f64,
}

impl MarkMatrix {
    pub(crate) fn new(basis: &Basis, epsilon: f64) -> Self {
        let steps = (0..basis.functions().len()).map(|i| basis.step(i) * epsilon).collect();
        let mut vectors = basis.vectors().map(CsrMatrix::from);
        if let Some(vectors) = &mut vectors {
            vectors.values_mut().iter_mut().for_each(|d| *d *= epsilon);
        }
        Self { rows: CsrMatrix::from(basis.values()), steps, vectors }
    }

    pub(crate) fn coefficients(&self) -> usize {
        self.steps.len()
    }

    /// (B w) at a vertex.
    pub(crate) fn displacement(&self, vertex: u32, w: &DVector<f64>) -> Vector3<f64> {
        if let Some(vectors) = &self.vectors {
            let row = vectors.row(vertex as usize);
            return row.col_indices().iter().zip(row.values()).map(|(&i, d)| d * w[i]).sum();
        }
        let row = self.rows.row(vertex as usize);
        row.col_indices().iter().zip(row.values()).map(|(&i, &phi)| self.steps[i] * (phi * w[i])).sum()
    }

    /// The terms of n · B at an observation, column by column; a column may come once for each corner.
    pub(crate) fn row(&self, o: &Observation, mut term: impl FnMut(usize, f64)) {
        for (&v, weight) in o.corners.iter().zip(o.weights).filter(|(_, weight)| *weight != 0.0) {
            let direction = o.direction * weight;
            if let Some(vectors) = &self.vectors {
                let row = vectors.row(v as usize);
                row.col_indices().iter().zip(row.values()).for_each(|(&i, d)| term(i, d.dot(&direction)));
            } else {
                let row = self.rows.row(v as usize);
                let entries = row.col_indices().iter().zip(row.values());
                entries.for_each(|(&i, phi)| term(i, phi * self.steps[i].dot(&direction)));
            }
        }
    }
}

/// Solves the weighted equations. `variance` is s² and `side` the largest side, which scale the priors.
pub(crate) fn solve(
    mark_matrix: &MarkMatrix,
    fields: &Fields,
    observations: &[Observation],
    weights: &[f64],
    (variance, side): (f64, f64),
) -> Solution {
    let (m, k) = (mark_matrix.coefficients(), fields.columns());
    let Sums { matrix, right } = Sums::of(mark_matrix, fields, observations, weights);
    let prior: Vec<f64> = (0..k).map(|i| variance / fields.prior_deviation(i, side).powi(2)).collect();
    let elimination = Elimination::new(&matrix, &right, m, &prior);
    let (left, score) = elimination.reduced(&matrix, &right);
    let w = with_prior(&left, &score, variance);
    let beta = elimination.nuisance(&w);
    let lengths = (0..m).map(|i| matrix[(i, i)]).collect();
    let spread = elimination.spread(&beta, &prior, fields.sparse()) / side;
    Solution { w, beta, left, lengths, score, spread }
}

/// L⁻¹ Cᵀ and L⁻¹ c with H = L Lᵀ, the columns of N scaled to a unit diagonal.
///
/// L⁻¹ Cᵀ is the part of B that nuisances explain, in k coordinates, so that its columns are no longer than those of B,
/// whatever the condition of H. (H⁻¹ Cᵀ may be huge where deformations are hardly seen, on flat parts say, and
/// G - C (H⁻¹ Cᵀ) then lost half of its digits.)
struct Elimination {
    scale: DVector<f64>,
    /// L; `None` where there are no nuisances, or H has a value that is not finite.
    factor: Option<Cholesky<f64, Dyn>>,
    explained: DMatrix<f64>,
    of_right: DVector<f64>,
}

impl Elimination {
    fn new(matrix: &DMatrix<f64>, right: &DVector<f64>, m: usize, prior: &[f64]) -> Self {
        let k = prior.len();
        let diagonal = |i: usize| matrix[(m + i, m + i)] + prior[i];
        let scale =
            DVector::from_fn(k, |i, _| if diagonal(i) > 0.0 { diagonal(i).sqrt().recip() } else { 0.0 });
        let mut h = DMatrix::from_fn(k, k, |i, j| matrix[(m + i.max(j), m + i.min(j))] * scale[i] * scale[j]);
        for i in 0..k {
            // 1 with the prior in it; a little more against rounding.
            h[(i, i)] = 1.0 + 1e-12;
        }
        let mut explained = DMatrix::from_fn(k, m, |i, j| matrix[(m + i, j)] * scale[i]);
        let mut of_right = DVector::from_fn(k, |i, _| right[m + i] * scale[i]);
        let factor = cholesky(h).filter(|factor| {
            let l = factor.l_dirty();
            l.solve_lower_triangular_mut(&mut explained) && l.solve_lower_triangular_mut(&mut of_right)
        });
        if factor.is_none() {
            (explained, of_right) = (DMatrix::zeros(k, m), DVector::zeros(k));
        }
        Self { scale, factor, explained, of_right }
    }

    /// G - C H⁻¹ Cᵀ, the lower triangle, and b - C H⁻¹ c.
    fn reduced(&self, matrix: &DMatrix<f64>, right: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let m = self.explained.ncols();
        let column = |i: usize| self.explained.column(i);
        let left = DMatrix::from_fn(m, m, |i, j| match i >= j {
            true => matrix[(i, j)] - column(i).dot(&column(j)),
            false => 0.0,
        });
        let score = DVector::from_fn(m, |i, _| right[i] - column(i).dot(&self.of_right));
        (left, score)
    }

    fn nuisance(&self, w: &DVector<f64>) -> DVector<f64> {
        let mut beta = &self.of_right - &self.explained * w;
        if let Some(factor) = &self.factor {
            factor.l_dirty().tr_solve_lower_triangular_mut(&mut beta);
        }
        beta.component_mul(&self.scale)
    }

    /// τ by MacKay's step (`warp.rs`), of the first so many unknowns; `prior` is s² / τ².
    fn spread(&self, beta: &DVector<f64>, prior: &[f64], count: usize) -> f64 {
        let (Some(factor), Some(prior)) = (&self.factor, prior.first().filter(|_| count > 0)) else {
            return 0.0;
        };
        // (H⁻¹)_ii = Σ_r (L⁻¹)_ri².
        let variance = |i: usize| column_of_inverse(factor.l_dirty(), i) * self.scale[i].powi(2);
        let trace: f64 = (0..count).into_par_iter().map(variance).collect::<Vec<f64>>().iter().sum();
        let determined = (count as f64 - prior * trace).max(1.0);
        (beta.rows(0, count).norm_squared() / determined).sqrt()
    }
}

/// The squared length of column i of L⁻¹, of which the entries from i on are not 0.
fn column_of_inverse(l: &DMatrix<f64>, i: usize) -> f64 {
    let mut x = vec![0.0; l.nrows() - i];
    x[0] = 1.0;
    for k in 0..x.len() {
        let below = &l.column(i + k).data.into_slice()[i + k..];
        let entry = x[k] / below[0];
        x[k] = entry;
        x[k + 1..].iter_mut().zip(&below[1..]).for_each(|(x, l)| *x -= l * entry);
    }
    x.iter().map(|x| x * x).sum()
}

/// (s² P + s² 1) w = s² P w*: the most probable w for a standard Gaussian one.
fn with_prior(left: &DMatrix<f64>, score: &DVector<f64>, variance: f64) -> DVector<f64> {
    let largest = left.diagonal().max();
    // What rounding leaves of directions that are hardly seen may be negative by some share of the largest.
    let solve = |rounding: f64| {
        let damping = variance.max(rounding * largest).max(f64::MIN_POSITIVE);
        let damped = left + DMatrix::identity(score.len(), score.len()) * damping;
        cholesky(damped).map(|factor| factor.solve(score))
    };
    [1e-14, 1e-12, 1e-10].into_iter().find_map(solve).unwrap_or_else(|| DVector::zeros(score.len()))
}

/// Of the lower triangle.
fn cholesky(matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix).filter(|factor| factor.l_dirty().iter().all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_basis::{Basis, BasisOptions};
    use sombrero_mesh::repair;
    use sombrero_progressive::ProgressiveMesh;
    use sombrero_shapes as shapes;

    #[test]
    fn a_vector_for_each_entry_moves_and_is_seen_as_a_function_along_a_direction() {
        let made = repair(&shapes::bumpy_sphere(400));
        let triangles = made.mesh.triangles();
        let progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
        let options = BasisOptions { coefficients: 30, ..Default::default() };
        let basis = Basis::new(progressive, &made.points, &options).unwrap();
        let along = |i: usize| {
            let column = basis.values().col(i);
            let entries = column.row_indices().iter().zip(column.values());
            entries.map(|(&v, phi)| (v as u32, basis.step(i) * *phi)).collect()
        };
        let vectors = Basis::of_fields(made.points.len(), (0..30).map(along).collect());
        let both = [&basis, &vectors].map(|b| MarkMatrix::new(b, 0.01));
        let w = DVector::from_fn(30, |i, _| f64::from(i as u32 % 5) - 2.0);
        for &corners in triangles.iter().step_by(7) {
            let [a, b] = both.each_ref().map(|matrix| matrix.displacement(corners[0], &w));
            assert!((a - b).norm() < 1e-15);
            let direction = Vector3::new(0.6, 0.0, 0.8);
            let observation = Observation { corners, weights: [0.2, 0.3, 0.5], direction, offset: 0.0 };
            let [a, b] = both.each_ref().map(|matrix| {
                let mut row = [0.0; 30];
                matrix.row(&observation, |i, term| row[i] += term);
                row
            });
            assert!(a.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-15));
        }
    }
}
