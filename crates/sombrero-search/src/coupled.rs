//! A basis over points, coupled so that nothing comes apart: B' = W B.

use nalgebra::{Matrix3, Vector3};
use sombrero_basis::Basis;
use sombrero_coupling::Coupling;
use std::ops::AddAssign;

/// (row, value) of a column, in order of rows.
type Column<T> = Vec<(usize, T)>;

/// The basis whose functions are those of `basis`, coupled. A free coupling leaves it as it is, to the bit. Functions
/// stay numbers times a direction where weights are numbers, and become vectors otherwise.
pub(crate) fn coupled(basis: Basis, coupling: &Coupling) -> Basis {
    if coupling.is_free() {
        return basis;
    }
    if let (None, Some(weights)) = (basis.vectors(), coupling.weights()) {
        let rows = Rows::new(basis.vertex_count(), weights.iter().map(|(v, row)| (*v, row.as_slice())));
        let columns: Vec<Column<f64>> = (0..basis.functions().len())
            .map(|i| {
                let column = basis.values().col(i);
                let entries = column.row_indices().iter().copied().zip(column.values().iter().copied());
                rows.apply(entries, |weight, phi| weight * phi)
            })
            .collect();
        let lengths: Vec<usize> = columns.iter().map(Vec::len).collect();
        let entries = || columns.iter().flatten();
        let (indices, values) = (entries().map(|e| e.0).collect(), entries().map(|e| e.1).collect());
        return Basis::from_parts(
            basis.vertex_count(),
            basis.functions().to_vec(),
            &lengths,
            indices,
            values,
        )
        .expect("each column has its rows once, in order, and means of finite numbers");
    }
    let rows = Rows::new(basis.vertex_count(), coupling.rows());
    let columns: Vec<Column<Vector3<f64>>> = (0..basis.functions().len())
        .map(|i| rows.apply(vectors(&basis, i), |map: &Matrix3<f64>, d| map * d))
        .collect();
    let lengths: Vec<usize> = columns.iter().map(Vec::len).collect();
    let entries = || columns.iter().flatten();
    let (indices, values) = (entries().map(|e| e.0).collect(), entries().map(|e| e.1).collect());
    Basis::from_vectors(basis.vertex_count(), &lengths, indices, values)
        .expect("each column has its rows once, in order, and sums of finite numbers")
}

/// Calls `take` with each row of column i of B at ε = 1, in order.
pub(crate) fn each(basis: &Basis, i: usize, mut take: impl FnMut(usize, Vector3<f64>)) {
    if let Some(vectors) = basis.vectors() {
        let column = vectors.col(i);
        column.row_indices().iter().zip(column.values()).for_each(|(row, d)| take(*row, *d));
        return;
    }
    let (column, step) = (basis.values().col(i), basis.step(i));
    column.row_indices().iter().zip(column.values()).for_each(|(row, phi)| take(*row, step * *phi));
}

/// Column i of B at ε = 1.
fn vectors(basis: &Basis, i: usize) -> Column<Vector3<f64>> {
    let mut column = Column::new();
    each(basis, i, |row, d| column.push((row, d)));
    column
}

/// The rows of W that are not those of the identity, by what they take.
struct Rows<W> {
    changed: Vec<bool>,
    /// For each point the points that take some of it, and how much.
    users: Vec<Vec<(u32, W)>>,
}

impl<W: Copy> Rows<W> {
    fn new<'a>(points: usize, rows: impl Iterator<Item = (u32, &'a [(u32, W)])>) -> Self
    where
        W: 'a,
    {
        let mut made =
            Self { changed: vec![false; points], users: (0..points).map(|_| Vec::new()).collect() };
        for (v, row) in rows {
            made.changed[v as usize] = true;
            row.iter().for_each(|(k, weight)| made.users[*k as usize].push((v, *weight)));
        }
        made
    }

    /// W times a column; sums are taken in the order of rows.
    fn apply<T: Copy + AddAssign>(
        &self,
        column: impl IntoIterator<Item = (usize, T)>,
        times: impl Fn(&W, T) -> T,
    ) -> Column<T> {
        let (mut kept, mut taken) = (Column::new(), Column::new());
        for (row, value) in column {
            if !self.changed[row] {
                kept.push((row, value));
            }
            taken.extend(self.users[row].iter().map(|(v, weight)| (*v as usize, times(weight, value))));
        }
        // Stable, so that what is added up stays in order.
        taken.sort_by_key(|entry| entry.0);
        for (row, value) in taken {
            match kept.last_mut() {
                Some((last, sum)) if *last == row && self.changed[row] => *sum += value,
                _ => kept.push((row, value)),
            }
        }
        kept.sort_by_key(|entry| entry.0);
        kept
    }
}
