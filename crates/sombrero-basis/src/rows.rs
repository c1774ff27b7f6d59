//! What functions do at a vertex: the matrix B by rows.

use crate::Basis;
use nalgebra::Vector3;
use std::ops::Range;

/// Some rows of B at ε = 1, one behind the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Where each row starts, and where the last one ends.
    starts: Vec<u32>,
    entries: Vec<(u32, Vector3<f64>)>,
}

impl Rows {
    /// For each vertex the functions that move it and what a unit of each does there, in order of functions.
    pub fn iter(&self) -> impl Iterator<Item = &[(u32, Vector3<f64>)]> {
        self.starts.windows(2).map(|ends| &self.entries[ends[0] as usize..ends[1] as usize])
    }
}

impl Basis {
    /// The rows of these vertices. Of a few thousand at a time they fit the caches, and can be made in parallel.
    ///
    /// # Panics
    /// When the range ends beyond the vertices.
    pub fn rows(&self, vertices: Range<usize>) -> Rows {
        assert!(vertices.end <= self.vertex_count(), "a row for each vertex");
        let functions = 0..self.functions().len();
        let mut starts = vec![0; vertices.len() + 1];
        functions.clone().for_each(|i| self.part(i, &vertices, |row, _| starts[row + 1] += 1));
        (0..vertices.len()).for_each(|row| starts[row + 1] += starts[row]);
        let mut next = starts.clone();
        let mut entries = vec![(0, Vector3::zeros()); next[vertices.len()] as usize];
        for i in functions {
            self.part(i, &vertices, |row, d| {
                entries[next[row] as usize] = (i as u32, d);
                next[row] += 1;
            });
        }
        Rows { starts, entries }
    }

    /// What function i does to these vertices, which are counted from their first.
    pub(crate) fn part(&self, i: usize, vertices: &Range<usize>, mut take: impl FnMut(usize, Vector3<f64>)) {
        let within = |rows: &[usize]| {
            let [start, end] =
                [vertices.start, vertices.end].map(|end| rows.partition_point(|row| *row < end));
            start..end
        };
        if let Some(vectors) = self.vectors() {
            let column = vectors.col(i);
            let part = within(column.row_indices());
            let entries = column.row_indices()[part.clone()].iter().zip(&column.values()[part]);
            entries.for_each(|(row, d)| take(row - vertices.start, *d));
            return;
        }
        let (column, step) = (self.values().col(i), self.step(i));
        let part = within(column.row_indices());
        let entries = column.row_indices()[part.clone()].iter().zip(&column.values()[part]);
        entries.for_each(|(row, phi)| take(row - vertices.start, step * *phi));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Amplitudes, BasisFunction, BasisOptions};
    use sombrero_mesh::repair;
    use sombrero_progressive::ProgressiveMesh;

    #[test]
    fn rows_are_those_of_the_columns() {
        let made = repair(&sombrero_shapes::bumpy_sphere(700));
        for (function, amplitudes) in
            [(BasisFunction::Sombrero, Amplitudes::Heights), (BasisFunction::Field, Amplitudes::Filled)]
        {
            let mut progressive = ProgressiveMesh::new(made.mesh.clone(), &made.points).unwrap();
            let options = BasisOptions { function, amplitudes, coefficients: 30 };
            let basis = Basis::new(&mut progressive, &made.points, &options).unwrap();
            let n = basis.vertex_count();
            let parts = [0..1, 1..1, 1..300, 300..n].map(|vertices| basis.rows(vertices));
            let rows: Vec<_> = parts.iter().flat_map(Rows::iter).collect();
            assert_eq!(rows.len(), n);
            assert!(rows.iter().all(|row| row.is_sorted_by(|a, b| a.0 < b.0)));
            for i in 0..basis.functions().len() {
                let w: Vec<f64> = (0..basis.functions().len()).map(|k| f64::from(u8::from(k == i))).collect();
                let column = basis.displacements(&w, 1.0);
                for (row, moved) in rows.iter().zip(column) {
                    let entry = row.iter().find(|entry| entry.0 as usize == i);
                    assert_eq!(entry.map_or(Vector3::zeros(), |entry| entry.1), moved);
                }
            }
        }
    }
}
