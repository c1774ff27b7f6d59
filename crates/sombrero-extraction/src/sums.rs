//! The sums of the normal equations, which a fit spends its time on.
//!
//! A row of A = [B N] has hundreds of entries: N's are all there but those of a warp, B's only where functions reach the
//! point. A warp's columns are treated as B's. Four observations are added at a time, so that each sum is read and written
//! once for four products; those of a mesh lie beside one another and are reached by the same functions.

use crate::fields::Fields;
use crate::system::{MarkMatrix, Observation};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Observations that one task sums up. The sums depend on it, so it is fixed.
const CHUNK: usize = 8192;

/// Sums over observations: the lower triangles of AᵀWA, and AᵀWr; B's part first.
pub(crate) struct Sums {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) right: DVector<f64>,
}

impl Sums {
    pub(crate) fn of(
        mark_matrix: &MarkMatrix,
        fields: &Fields,
        observations: &[Observation],
        weights: &[f64],
    ) -> Self {
        let chunks = observations.par_chunks(CHUNK).zip(weights.par_chunks(CHUNK));
        let parts: Vec<Self> = chunks.map(|(o, w)| Self::of_chunk(mark_matrix, fields, o, w)).collect();
        let columns = mark_matrix.coefficients() + fields.columns();
        parts.into_iter().fold(Self::new(columns), |mut sum, part| {
            sum.matrix += part.matrix;
            sum.right += part.right;
            sum
        })
    }

    fn new(columns: usize) -> Self {
        Self { matrix: DMatrix::zeros(columns, columns), right: DVector::zeros(columns) }
    }

    fn of_chunk(
        mark_matrix: &MarkMatrix,
        fields: &Fields,
        observations: &[Observation],
        weights: &[f64],
    ) -> Self {
        let (m, k) = (mark_matrix.coefficients(), fields.columns());
        let mut out = Self::new(m + k);
        let mut four = Four::new(m + fields.sparse(), k - fields.sparse());
        for (o, &weight) in observations.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
            four.push(mark_matrix, fields, o, weight.sqrt());
            if four.filled == 4 {
                out.add(&mut four);
            }
        }
        out.add(&mut four);
        out
    }

    /// Adds the products of four rows, and forgets them.
    fn add(&mut self, four: &mut Four) {
        four.places.sort_unstable();
        self.add_mark(four);
        self.add_nuisance(four);
        four.clear();
    }

    /// All terms with B.
    fn add_mark(&mut self, four: &Four) {
        let Four { mark, nuisance, offsets, places, .. } = four;
        let (m, size) = (mark.len(), self.matrix.nrows());
        let columns = self.matrix.as_mut_slice();
        for (at, &i) in places.iter().enumerate() {
            let x = mark[i];
            let column = &mut columns[i * size..][..size];
            for &j in &places[at..] {
                column[j] += product(&x, &mark[j]);
            }
            self.right[i] += product(&x, offsets);
            if at % 2 == 1 {
                let (left, right) = columns.split_at_mut(i * size);
                let first = places[at - 1];
                let two = [&mut left[first * size + m..][..size - m], &mut right[m..size]];
                add_to_two(two, [&mark[first], &x], nuisance.each_ref().map(Vec::as_slice));
            }
        }
        if let (1, Some(&last)) = (places.len() % 2, places.last()) {
            let column = &mut columns[last * size + m..][..size - m];
            add_to_two([column, &mut []], [&mark[last]; 2], nuisance.each_ref().map(Vec::as_slice));
        }
    }

    /// NᵀWN and N's part of AᵀWr. Of the upper triangle, which nobody reads, an entry beside the diagonal is written.
    fn add_nuisance(&mut self, four: &Four) {
        let Four { mark, nuisance, offsets, .. } = four;
        let (m, size) = (mark.len(), self.matrix.nrows());
        let entries = |i: usize| nuisance.each_ref().map(|row| row[i]);
        for (pair, columns) in self.matrix.as_mut_slice()[m * size..].chunks_mut(2 * size).enumerate() {
            let i = 2 * pair;
            let rows = nuisance.each_ref().map(|row| &row[i..]);
            let (left, right) = columns.split_at_mut(size);
            let second = if right.is_empty() { [0.0; 4] } else { entries(i + 1) };
            let right = right.get_mut(m + i..).unwrap_or_default();
            add_to_two([&mut left[m + i..], right], [&entries(i), &second], rows);
        }
        for (i, sum) in self.right.as_mut_slice()[m..].iter_mut().enumerate() {
            *sum += product(&entries(i), offsets);
        }
    }
}

/// Rows of [A | r], each times the root of its weight; zero where there is none yet.
struct Four {
    filled: usize,
    /// Those of B and of a warp, the four entries of a column side by side.
    mark: Vec<[f64; 4]>,
    /// Columns of them with an entry, each once.
    places: Vec<usize>,
    nuisance: [Vec<f64>; 4],
    offsets: [f64; 4],
    /// Whether a column is in `places`.
    listed: Vec<bool>,
}

impl Four {
    fn new(m: usize, k: usize) -> Self {
        Self {
            filled: 0,
            mark: vec![[0.0; 4]; m],
            places: Vec::new(),
            nuisance: [(); 4].map(|()| vec![0.0; k]),
            offsets: [0.0; 4],
            listed: vec![false; m],
        }
    }

    fn push(&mut self, mark_matrix: &MarkMatrix, fields: &Fields, o: &Observation, root: f64) {
        let Self { mark, places, listed, filled, .. } = self;
        let mut term = |i: usize, value: f64| {
            mark[i][*filled] += value * root;
            if !std::mem::replace(&mut listed[i], true) {
                places.push(i);
            }
        };
        mark_matrix.row(o, &mut term);
        let m = mark_matrix.coefficients();
        fields.sparse_row(o.corners, o.weights, &o.direction, |i, value| term(m + i, value));
        let row = &mut self.nuisance[self.filled];
        fields.row(o.corners, o.weights, &o.direction, row);
        row.iter_mut().for_each(|x| *x *= root);
        self.offsets[self.filled] = o.offset * root;
        self.filled += 1;
    }

    fn clear(&mut self) {
        for i in self.places.drain(..) {
            self.mark[i] = [0.0; 4];
            self.listed[i] = false;
        }
        self.nuisance.iter_mut().for_each(|row| row.fill(0.0));
        self.offsets = [0.0; 4];
        self.filled = 0;
    }
}

fn product(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

/// Adds Σ_r x_r row_r to each of two columns, with its own x. The second may be empty.
fn add_to_two(columns: [&mut [f64]; 2], x: [&[f64; 4]; 2], rows: [&[f64]; 4]) {
    let [first, second] = columns;
    let (p, q) = (x[0], x[1]);
    let both = second.len().min(first.len());
    let [a, b, c, d] = rows.map(|row| &row[..first.len()]);
    for i in 0..both {
        let row = [a[i], b[i], c[i], d[i]];
        first[i] += product(p, &row);
        second[i] += product(q, &row);
    }
    for i in both..first.len() {
        first[i] += product(p, &[a[i], b[i], c[i], d[i]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deformation::Deformation;
    use nalgebra::{Point3, Vector3};
    use sombrero_basis::Basis;
    use sombrero_mesh::{Soup, smoothing_modes};
    use sombrero_shapes as shapes;

    /// Functions that each reach a few vertices, so that rows of B are sparse and differ.
    fn functions(points: &[Point3<f64>], count: usize) -> Basis {
        let reach = |i: usize| {
            let near = (0..).zip(points).filter(|(v, _)| (v * 7 + i as u32).is_multiple_of(5));
            near.map(|(v, p)| (v, p.coords * (1.0 + i as f64))).collect()
        };
        Basis::of_fields(points.len(), (0..count).map(reach).collect())
    }

    fn observations(soup: &Soup, count: usize) -> Vec<Observation> {
        let faces = soup.triangles.iter().cycle().step_by(3);
        let one = |(i, &corners): (usize, &[u32; 3])| Observation {
            corners,
            weights: [[0.2, 0.3, 0.5], [1.0, 0.0, 0.0]][i % 2],
            direction: Vector3::new(0.6, 0.0, 0.8),
            offset: 0.1 * i as f64,
        };
        faces.enumerate().map(one).take(count).collect()
    }

    /// Groups that are not full, odd numbers of columns, observations that count nothing.
    #[test]
    fn sums_are_those_of_the_rows_one_by_one() {
        let soup = shapes::bumpy_sphere(200);
        let modes = smoothing_modes(&soup);
        for (functions_count, deformation, count) in [
            (5, Deformation::Similarity, 9),
            (6, Deformation::Affine, 8),
            (1, Deformation::Similarity, 3),
            (4, Deformation::Quadratic, 1),
        ] {
            let mark_matrix = MarkMatrix::new(&functions(&soup.points, functions_count), 0.5);
            let fields = Fields::new(&soup, deformation, modes.iter().take(1).collect(), None);
            let observations = observations(&soup, count);
            let weights: Vec<f64> = (0..count).map(|i| f64::from((i as u32 + 1) % 4)).collect();
            let sums = Sums::of(&mark_matrix, &fields, &observations, &weights);

            let size = functions_count + fields.columns();
            let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
            for (o, &weight) in observations.iter().zip(&weights) {
                let mut row = DVector::zeros(size);
                mark_matrix.row(o, |i, term| row[i] += term);
                let nuisance = &mut row.as_mut_slice()[functions_count..];
                fields.row(o.corners, o.weights, &o.direction, nuisance);
                matrix += &row * row.transpose() * weight;
                right += row * (weight * o.offset);
            }
            let scale = matrix.amax();
            assert!(scale > 0.0);
            let apart = |i: usize, j: usize| (sums.matrix[(i, j)] - matrix[(i, j)]).abs();
            assert!((0..size).all(|j| (j..size).all(|i| apart(i, j) <= 1e-14 * scale)));
            assert!((sums.right - right).amax() <= 1e-14 * scale);
        }
    }
}
