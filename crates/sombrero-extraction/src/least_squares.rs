//! The paper's extraction (section 4): w* minimises |B w* - (v* - v)|² over the vertices that are present.
//!
//! With B = ε [φ_i h_i d_i] the normal matrix is, entry by entry,
//!
//!   (BᵀB)_ij = ε² h_i h_j (d_i · d_j) (ΦᵀΦ)_ij,
//!
//! so the three coordinates need not be treated one by one. A missing vertex deletes its rows; a column
//! left without rows is dropped. The rest is scaled to a unit diagonal and solved by its eigenvectors,
//! which is the singular value decomposition of the scaled B: directions whose singular value is below
//! [`RANK_TOLERANCE`] of the largest are not determined by the present vertices, and coefficients with a
//! part in them are reported as missing rather than guessed. One step of iterative refinement takes back
//! the digits that squaring the matrix lost.
//!
//! Nothing here knows a watermark (design law 1: what computes w* must not see w).

use crate::answer::eigen;
use nalgebra::{DMatrix, DVector, Point3, SymmetricEigen, Vector3};
use nalgebra_sparse::CsrMatrix;
use rayon::prelude::*;
use sombrero_basis::{Basis, Rows};
use thiserror::Error;

/// Singular values below this fraction of the largest one count as zero.
const RANK_TOLERANCE: f64 = 1e-5;
/// Coefficients with more than this share of their unit vector in undetermined directions are missing.
const LARGEST_UNDETERMINED: f64 = 1e-6;

/// The coefficients that were found in a suspect mesh.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Extraction {
    /// w*, one entry for each basis function; `None` where the present vertices do not determine it.
    pub coefficients: Vec<Option<f64>>,
    /// How many vertices were present.
    pub vertices: usize,
    /// Root mean square of what the coefficients do not explain, |B w* - (v* - v)| / √vertices, in model
    /// units.
    pub residual_rms: f64,
}

/// A question that [`extract`] cannot answer.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ExtractError {
    /// The three slices do not belong to one mesh.
    #[error(
        "the basis has {basis} vertices, the original {original} and the suspect {suspect}; all must be equal"
    )]
    Lengths {
        /// Rows of the basis.
        basis: usize,
        /// Points of the original.
        original: usize,
        /// Points of the suspect.
        suspect: usize,
    },
    /// A position of the suspect is NaN or infinite.
    #[error("vertex {vertex} of the suspect has a coordinate that is not finite")]
    NotFinite {
        /// Its index.
        vertex: usize,
    },
}

/// The coefficients w* that best explain how `suspect` differs from `original`.
///
/// All three have one row a vertex: `suspect[j]` is where vertex j of the original is found, in the frame
/// of the original, or `None` when it has no counterpart. `epsilon` is the strength that the mark was made with.
///
/// # Errors
/// [`ExtractError`] when lengths differ or a position is not finite.
pub fn extract(
    basis: &Basis,
    epsilon: f64,
    original: &[Point3<f64>],
    suspect: &[Option<Point3<f64>>],
) -> Result<Extraction, ExtractError> {
    let offsets = offsets(basis, original, suspect)?;
    Ok(System::new(basis, epsilon, &gram(basis, &present(&offsets))).solve(&offsets))
}

/// What extractions from suspects have in common whose vertices are all present: most of the work.
#[derive(Debug, Clone)]
pub struct Whole {
    gram: Vec<f64>,
}

impl Whole {
    /// For suspects of this basis.
    pub fn new(basis: &Basis) -> Self {
        Self { gram: gram(basis, &vec![true; basis.vertex_count()]) }
    }

    /// [`extract`] for each of several suspects, which takes longer for one whose vertices are not all present. `basis` is the
    /// one that this was made of.
    ///
    /// # Errors
    /// As [`extract`].
    ///
    /// # Panics
    /// When `basis` has another number of functions.
    pub fn extract(
        &self,
        basis: &Basis,
        epsilon: f64,
        original: &[Point3<f64>],
        suspects: &[&[Option<Point3<f64>>]],
    ) -> Result<Vec<Extraction>, ExtractError> {
        let system = System::new(basis, epsilon, &self.gram);
        let of = |suspect: &&[Option<Point3<f64>>]| {
            let offsets = offsets(basis, original, suspect)?;
            let present = present(&offsets);
            if present.iter().all(|present| *present) {
                return Ok(system.solve(&offsets));
            }
            Ok(System::new(basis, epsilon, &gram(basis, &present)).solve(&offsets))
        };
        suspects.iter().map(of).collect()
    }
}

fn present(offsets: &[Option<Vector3<f64>>]) -> Vec<bool> {
    offsets.iter().map(Option::is_some).collect()
}

/// v* - v of the vertices that are present.
fn offsets(
    basis: &Basis,
    original: &[Point3<f64>],
    suspect: &[Option<Point3<f64>>],
) -> Result<Vec<Option<Vector3<f64>>>, ExtractError> {
    let (rows, original_rows, suspect_rows) = (basis.vertex_count(), original.len(), suspect.len());
    if original_rows != rows || suspect_rows != rows {
        return Err(ExtractError::Lengths { basis: rows, original: original_rows, suspect: suspect_rows });
    }
    let finite = |p: &Option<Point3<f64>>| p.is_none_or(|p| p.coords.iter().all(|x| x.is_finite()));
    if let Some(vertex) = suspect.iter().position(|p| !finite(p)) {
        return Err(ExtractError::NotFinite { vertex });
    }
    Ok(suspect.iter().zip(original).map(|(s, o)| s.map(|s| s - o)).collect())
}

/// The least squares of the vertices that are present, whatever became of them.
struct System<'a> {
    basis: &'a Basis,
    epsilon: f64,
    /// ε h_i d_i.
    steps: Vec<Vector3<f64>>,
    /// What scales BᵀB to a unit diagonal; a column without rows gets a zero and drops out.
    scale: DVector<f64>,
    inverse: PseudoInverse,
}

/// Rows that one task looks up.
const CHUNK: usize = 4096;

/// Tasks whose rows are kept at a time.
const PIECES: usize = 8;

/// Functions whose products one task adds up.
const GROUP: usize = 32;

impl<'a> System<'a> {
    /// `gram` is that of the vertices that are present.
    fn new(basis: &'a Basis, epsilon: f64, gram: &[f64]) -> Self {
        let steps: Vec<_> = (0..basis.functions().len()).map(|i| basis.step(i) * epsilon).collect();
        let normal = |i: usize, j: usize| {
            let entry = gram[i.min(j) * steps.len() + i.max(j)];
            if basis.vectors().is_some() {
                entry * epsilon * epsilon
            } else {
                entry * steps[i].dot(&steps[j])
            }
        };
        let diagonal = (0..steps.len()).map(|i| normal(i, i));
        let scale = diagonal.map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let scale = DVector::from_vec(scale.collect());
        let scaled = |i: usize, j: usize| normal(i, j) * scale[i] * scale[j];
        let inverse = PseudoInverse::new(DMatrix::from_fn(steps.len(), steps.len(), scaled));
        Self { basis, epsilon, steps, scale, inverse }
    }

    fn solve(&self, offsets: &[Option<Vector3<f64>>]) -> Extraction {
        let Self { scale, inverse, .. } = self;
        let step = |residual: &[Option<Vector3<f64>>]| {
            inverse.times(&self.transposed_times(residual).component_mul(scale)).component_mul(scale)
        };
        let mut w = step(offsets);
        w += step(&self.residual(offsets, &w));

        let found =
            |i: usize| (scale[i] > 0.0 && inverse.undetermined[i] <= LARGEST_UNDETERMINED).then(|| w[i]);
        let residual = self.residual(offsets, &w);
        let vertices = residual.iter().flatten().count();
        let sum: f64 = residual.iter().flatten().map(Vector3::norm_squared).sum();
        Extraction {
            coefficients: (0..w.len()).map(found).collect(),
            vertices,
            residual_rms: (sum / vertices.max(1) as f64).sqrt(),
        }
    }

    /// Bᵀ r over the present rows.
    fn transposed_times(&self, r: &[Option<Vector3<f64>>]) -> DVector<f64> {
        if let Some(vectors) = self.basis.vectors() {
            let sum = |i: usize| {
                let column = vectors.col(i);
                let terms = column.row_indices().iter().zip(column.values());
                terms.filter_map(|(&row, d)| r[row].map(|r| r.dot(d))).sum::<f64>() * self.epsilon
            };
            return DVector::from_vec((0..self.steps.len()).into_par_iter().map(sum).collect());
        }
        let sums = self.basis.values().col_iter().zip(&self.steps).map(|(column, step)| {
            let terms = column.row_indices().iter().zip(column.values());
            let sum: Vector3<f64> = terms.filter_map(|(&row, &phi)| r[row].map(|r| r * phi)).sum();
            sum.dot(step)
        });
        DVector::from_iterator(self.steps.len(), sums)
    }

    /// v* - v - B w over the present rows.
    fn residual(&self, offsets: &[Option<Vector3<f64>>], w: &DVector<f64>) -> Vec<Option<Vector3<f64>>> {
        let moved = if self.basis.vectors().is_some() {
            self.basis.displacements(w.as_slice(), self.epsilon)
        } else {
            let mut moved = vec![Vector3::zeros(); offsets.len()];
            for (i, column) in self.basis.values().col_iter().enumerate() {
                let entries = column.row_indices().iter().zip(column.values());
                entries.for_each(|(&row, &phi)| moved[row] += self.steps[i] * (phi * w[i]));
            }
            moved
        };
        offsets.iter().zip(moved).map(|(offset, moved)| offset.map(|offset| offset - moved)).collect()
    }
}

/// ΦᵀΦ, or BᵀB at ε = 1 where functions are vectors, over the present rows: its upper triangle, by rows.
fn gram(basis: &Basis, present: &[bool]) -> Vec<f64> {
    let m = basis.functions().len();
    let mut gram = vec![0.0; m * m];
    if basis.vectors().is_none() {
        let rows = CsrMatrix::from(basis.values());
        for (row, _) in rows.row_iter().zip(present).filter(|(_, present)| **present) {
            for (k, (&i, &phi)) in row.col_indices().iter().zip(row.values()).enumerate() {
                for (&j, &psi) in row.col_indices().iter().zip(row.values()).skip(k) {
                    gram[i * m + j] += phi * psi;
                }
            }
        }
        return gram;
    }
    for (piece, present) in present.chunks(CHUNK * PIECES).enumerate() {
        let first = piece * CHUNK * PIECES;
        let rows = |(k, part): (usize, &[bool])| {
            let start = first + k * CHUNK;
            basis.rows(start..start + part.len())
        };
        let rows: Vec<Rows> = present.par_chunks(CHUNK).enumerate().map(rows).collect();
        let rows = rows.iter().flat_map(Rows::iter).zip(present);
        let rows: Vec<_> = rows.filter(|(_, present)| **present).map(|(row, _)| row).collect();
        let groups = gram.par_chunks_mut(m * GROUP).enumerate();
        groups.for_each(|(group, sums)| add_products(sums, m, group * GROUP, &rows));
    }
    gram
}

/// Adds to rows of the upper triangle, from the one of function `first` on, what functions have in common in `rows` of B.
fn add_products(sums: &mut [f64], m: usize, first: usize, rows: &[&[(u32, Vector3<f64>)]]) {
    let end = first + sums.len() / m;
    for row in rows {
        let [start, end] = [first, end].map(|end| row.partition_point(|(i, _)| (*i as usize) < end));
        for k in start..end {
            let (i, d) = &row[k];
            let sums = &mut sums[(*i as usize - first) * m..][..m];
            row[k..].iter().for_each(|(j, e)| sums[*j as usize] += d.dot(e));
        }
    }
}

/// The inverse of a symmetric matrix on the directions that it determines.
struct PseudoInverse {
    eigen: SymmetricEigen<f64, nalgebra::Dyn>,
    /// 1 / eigenvalue, or 0 for directions that are not determined.
    reciprocal: DVector<f64>,
    /// For each unknown how much of its unit vector (squared) lies in directions that are not determined.
    undetermined: Vec<f64>,
}

impl PseudoInverse {
    fn new(matrix: DMatrix<f64>) -> Self {
        let eigen = eigen(matrix);
        // Eigenvalues are squares of singular values.
        let smallest = eigen.eigenvalues.max() * RANK_TOLERANCE * RANK_TOLERANCE;
        let reciprocal = eigen.eigenvalues.map(|x| if x > smallest && x > 0.0 { 1.0 / x } else { 0.0 });
        let lost = |row: usize| -> f64 {
            let parts = eigen.eigenvectors.row(row);
            parts.iter().zip(reciprocal.iter()).filter(|(_, r)| **r == 0.0).map(|(x, _)| x * x).sum()
        };
        let undetermined = (0..reciprocal.len()).map(lost).collect();
        Self { eigen, reciprocal, undetermined }
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let v = &self.eigen.eigenvectors;
        v * (v.transpose() * x).component_mul(&self.reciprocal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_basis::BasisOptions;
    use sombrero_mesh::repair;
    use sombrero_progressive::ProgressiveMesh;
    use sombrero_shapes as shapes;

    fn case(coefficients: usize) -> (Basis, Vec<Point3<f64>>) {
        let made = repair(&shapes::bumpy_sphere(1500));
        let progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
        let options = BasisOptions { coefficients, ..Default::default() };
        (Basis::new(progressive, &made.points, &options).unwrap(), made.points)
    }

    fn marked(basis: &Basis, points: &[Point3<f64>], w: &[f64]) -> Vec<Option<Point3<f64>>> {
        points.iter().zip(basis.displacements(w, 0.01)).map(|(p, d)| Some(p + d)).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn an_unattacked_mesh_gives_the_watermark_back(w in prop::collection::vec(-3.0..3.0f64, 40)) {
            let (basis, points) = case(40);
            let found = extract(&basis, 0.01, &points, &marked(&basis, &points, &w)).unwrap();
            for (found, w) in found.coefficients.iter().zip(&w) {
                prop_assert!(found.is_some_and(|f| (f - w).abs() < 1e-6), "{found:?} for {w}");
            }
            prop_assert!(found.residual_rms < 1e-12);
        }

        #[test]
        fn a_cropped_mesh_gives_back_what_is_determined(
            w in prop::collection::vec(-3.0..3.0f64, 40), cut in -0.9..0.9f64
        ) {
            let (basis, points) = case(40);
            let mut suspect = marked(&basis, &points, &w);
            for (s, p) in suspect.iter_mut().zip(&points) {
                if p.x > cut { *s = None; }
            }
            let found = extract(&basis, 0.01, &points, &suspect).unwrap();
            for (found, w) in found.coefficients.iter().zip(&w) {
                prop_assert!(found.is_none_or(|f| (f - w).abs() < 1e-5), "{found:?} for {w}");
            }
            // A function that keeps its centre is rarely lost.
            let kept = basis.functions().iter().filter(|f| suspect[f.centre.index()].is_some()).count();
            let determined = found.coefficients.iter().flatten().count();
            prop_assert!(determined + 5 >= kept, "{determined} of {kept}");
        }
    }

    #[test]
    fn agrees_with_a_dense_solve_under_noise() {
        let (basis, points) = case(12);
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let shift = |_| Vector3::new(random(), random(), random()) * 0.01;
        let offsets: Vec<Vector3<f64>> = (0..points.len()).map(shift).collect();
        let suspect: Vec<_> = points.iter().zip(&offsets).map(|(p, o)| Some(p + o)).collect();
        let dense = DMatrix::from_fn(3 * points.len(), 12, |row, i| {
            let phi = basis.values().get_entry(row / 3, i).map_or(0.0, |e| e.into_value());
            0.01 * phi * basis.step(i)[row % 3]
        });
        let r = DVector::from_fn(3 * points.len(), |row, _| offsets[row / 3][row % 3]);
        let expected = dense.svd(true, true).solve(&r, 1e-12).unwrap();
        let found = extract(&basis, 0.01, &points, &suspect).unwrap();
        for (found, expected) in found.coefficients.iter().zip(expected.iter()) {
            assert!((found.unwrap() - expected).abs() < 1e-9 * expected.abs().max(1.0));
        }
    }

    #[test]
    fn vectors_are_read_as_scalar_functions_are() {
        let (basis, points) = case(20);
        let along = |i: usize| {
            let column = basis.values().col(i);
            let entries = column.row_indices().iter().zip(column.values());
            entries.map(|(&v, phi)| (v as u32, basis.step(i) * *phi)).collect()
        };
        let vectors = Basis::of_fields(points.len(), (0..20).map(along).collect());
        let w: Vec<f64> = (0..20).map(|i| f64::from(i % 7) - 3.0).collect();
        let mut suspect = marked(&basis, &points, &w);
        for (k, s) in suspect.iter_mut().enumerate() {
            *s = s.map(|p| p + Vector3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3) * 1e-3);
        }
        suspect[5] = None;
        let [scalar, vector] = [&basis, &vectors].map(|b| extract(b, 0.01, &points, &suspect).unwrap());
        for (a, b) in scalar.coefficients.iter().zip(&vector.coefficients) {
            assert!((a.unwrap() - b.unwrap()).abs() < 1e-9, "{a:?} {b:?}");
        }
        assert!((scalar.residual_rms - vector.residual_rms).abs() < 1e-12);
    }

    #[test]
    fn what_extractions_have_in_common_changes_no_bit() {
        let (basis, points) = case(20);
        let w: Vec<f64> = (0..20).map(|i| f64::from(i % 7) - 3.0).collect();
        let all = marked(&basis, &points, &w);
        let mut some = all.clone();
        some[..300].fill(None);
        let whole = Whole::new(&basis);
        let found = whole.extract(&basis, 0.01, &points, &[&all, &some]).unwrap();
        let alone = [&all, &some].map(|suspect| extract(&basis, 0.01, &points, suspect).unwrap());
        assert_eq!(found, alone);
        assert_ne!(found[0], found[1]);
    }

    #[test]
    fn nothing_present_determines_nothing() {
        let (basis, points) = case(5);
        let found = extract(&basis, 0.01, &points, &vec![None; points.len()]).unwrap();
        assert_eq!(found.coefficients, vec![None; 5]);
        assert_eq!((found.vertices, found.residual_rms), (0, 0.0));
    }

    #[test]
    fn senseless_questions_are_refused() {
        let (basis, points) = case(5);
        let mut suspect = vec![Some(points[0]); points.len()];
        suspect[7] = Some(Point3::new(0.0, f64::NAN, 0.0));
        assert_eq!(extract(&basis, 0.01, &points, &suspect), Err(ExtractError::NotFinite { vertex: 7 }));
        let shorter = extract(&basis, 0.01, &points, &suspect[1..]);
        assert!(matches!(shorter, Err(ExtractError::Lengths { .. })));
    }
}
