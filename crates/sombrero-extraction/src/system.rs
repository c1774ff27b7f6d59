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
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};
use nalgebra_sparse::CsrMatrix;
use rayon::prelude::*;
use sombrero_basis::Basis;

/// Observations that one task sums up. The sums depend on it, so it is fixed.
const CHUNK: usize = 8192;
/// Rows of N that are kept at a time, four by four.
const BLOCK: usize = 256;
/// Standard deviation of N β beforehand, in units of the largest side.
const DEFORMATION: f64 = 0.1;

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

    /// The entries of n · B at an observation into `sums`, where all else is 0, and their places into `places`.
    fn row(&self, o: &Observation, sums: &mut [f64], places: &mut Vec<usize>) {
        places.clear();
        if let Some(vectors) = &self.vectors {
            for (&v, weight) in o.corners.iter().zip(o.weights).filter(|(_, weight)| *weight != 0.0) {
                let row = vectors.row(v as usize);
                let direction = o.direction * weight;
                for (&i, d) in row.col_indices().iter().zip(row.values()) {
                    places.push(i);
                    sums[i] += d.dot(&direction);
                }
            }
            places.sort_unstable();
            places.dedup();
            return;
        }
        for (&v, weight) in o.corners.iter().zip(o.weights).filter(|(_, weight)| *weight != 0.0) {
            let row = self.rows.row(v as usize);
            for (&i, &phi) in row.col_indices().iter().zip(row.values()) {
                places.push(i);
                sums[i] += weight * phi;
            }
        }
        places.sort_unstable();
        places.dedup();
        places.iter().for_each(|&i| sums[i] *= self.steps[i].dot(&o.direction));
    }
}

/// Sums over observations: the lower triangles of AᵀWA, and AᵀWr; B's part first.
struct Sums {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl Sums {
    fn new(columns: usize) -> Self {
        Self { matrix: DMatrix::zeros(columns, columns), right: DVector::zeros(columns) }
    }

    fn of(mark_matrix: &MarkMatrix, fields: &Fields, observations: &[Observation], weights: &[f64]) -> Self {
        let (m, k) = (mark_matrix.coefficients(), fields.columns());
        let chunks = observations.par_chunks(CHUNK).zip(weights.par_chunks(CHUNK));
        let parts: Vec<Self> = chunks.map(|(o, w)| Self::of_chunk(mark_matrix, fields, o, w)).collect();
        parts.into_iter().fold(Self::new(m + k), |mut sum, part| {
            sum.matrix += part.matrix;
            sum.right += part.right;
            sum
        })
    }

    fn of_chunk(
        mark_matrix: &MarkMatrix,
        fields: &Fields,
        observations: &[Observation],
        weights: &[f64],
    ) -> Self {
        let (m, k) = (mark_matrix.coefficients(), fields.columns());
        let mut out = Self::new(m + k);
        let (mut sums, mut places) = (vec![0.0; m], Vec::new());
        let mut rows = Vec::with_capacity(BLOCK * k);
        let mut nuisance = vec![0.0; k];
        for (o, &weight) in observations.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
            fields.row(o.corners, o.weights, &o.direction, &mut nuisance);
            mark_matrix.row(o, &mut sums, &mut places);
            out.add_sparse(&sums, &places, &nuisance, weight, o.offset);
            places.iter().for_each(|&i| sums[i] = 0.0);
            let root = weight.sqrt();
            rows.extend(nuisance.iter().map(|x| x * root));
            if rows.len() == BLOCK * k {
                out.add_dense(&rows, m, k);
                rows.clear();
            }
        }
        out.add_dense(&rows, m, k);
        out
    }

    /// All terms with B, and the right-hand side.
    fn add_sparse(&mut self, b: &[f64], places: &[usize], n: &[f64], weight: f64, offset: f64) {
        let m = b.len();
        for (at, &i) in places.iter().enumerate() {
            let x = b[i] * weight;
            let mut column = self.matrix.column_mut(i);
            let column = column.as_mut_slice();
            places[at..].iter().for_each(|&j| column[j] += x * b[j]);
            column[m..].iter_mut().zip(n).for_each(|(sum, n)| *sum += x * n);
            self.right[i] += x * offset;
        }
        let x = weight * offset;
        self.right.as_mut_slice()[m..].iter_mut().zip(n).for_each(|(sum, n)| *sum += x * n);
    }

    /// NᵀWN of some rows, which come with the root of their weight; four rows at a time, to spare memory traffic.
    fn add_dense(&mut self, rows: &[f64], m: usize, k: usize) {
        let zeros = vec![0.0; k];
        for four in rows.chunks(4 * k.max(1)) {
            let row = |i: usize| four.get(i * k..(i + 1) * k).unwrap_or(&zeros);
            let [a, b, c, d] = [row(0), row(1), row(2), row(3)];
            for i in 0..k {
                let mut column = self.matrix.column_mut(m + i);
                let sums = &mut column.as_mut_slice()[m + i..];
                let (x, y, z, u) = (a[i], b[i], c[i], d[i]);
                let others = a[i..].iter().zip(&b[i..]).zip(&c[i..]).zip(&d[i..]);
                for (sum, (((a, b), c), d)) in sums.iter_mut().zip(others) {
                    *sum += (x * a + y * b) + (z * c + u * d);
                }
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
    let prior: Vec<f64> =
        (0..k).map(|i| variance / fields.prior_deviation(i, DEFORMATION * side).powi(2)).collect();
    let elimination = Elimination::new(&matrix, &right, m, &prior);
    let (left, score) = elimination.reduced(&matrix, &right);
    let w = with_prior(&left, &score, variance);
    let beta = elimination.nuisance(&w);
    let lengths = (0..m).map(|i| matrix[(i, i)]).collect();
    Solution { w, beta, left, lengths, score }
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
        let mut progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
        let options = BasisOptions { coefficients: 30, ..Default::default() };
        let basis = Basis::new(&mut progressive, &made.points, &options).unwrap();
        let along = |i: usize| {
            let column = basis.values().col(i);
            let entries = column.row_indices().iter().zip(column.values());
            entries.map(|(&v, phi)| (v as u32, basis.step(i) * *phi)).collect()
        };
        let vectors = Basis::of_fields(made.points.len(), &(0..30).map(along).collect::<Vec<_>>());
        let both = [&basis, &vectors].map(|b| MarkMatrix::new(b, 0.01));
        let w = DVector::from_fn(30, |i, _| f64::from(i as u32 % 5) - 2.0);
        let triangles = progressive.mesh().triangles();
        for &corners in triangles.iter().step_by(7) {
            let [a, b] = both.each_ref().map(|matrix| matrix.displacement(corners[0], &w));
            assert!((a - b).norm() < 1e-15);
            let direction = Vector3::new(0.6, 0.0, 0.8);
            let observation = Observation { corners, weights: [0.2, 0.3, 0.5], direction, offset: 0.0 };
            let [a, b] = both.each_ref().map(|matrix| {
                let (mut sums, mut places) = (vec![0.0; 30], Vec::new());
                matrix.row(&observation, &mut sums, &mut places);
                (sums, places)
            });
            assert_eq!(a.1, b.1);
            assert!(a.0.iter().zip(&b.0).all(|(x, y)| (x - y).abs() < 1e-15));
        }
    }
}
