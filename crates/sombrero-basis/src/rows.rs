//! What functions do at a vertex: the matrix B by rows.

use crate::Basis;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;

/// Vertices whose functions one task looks up.
const CHUNK: usize = 4096;

/// Some rows of B at ε = 1, one behind the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Where each row starts, and where the last one ends.
    starts: Vec<usize>,
    entries: Vec<(u32, Vector3<f64>)>,
}

impl Rows {
    /// For each vertex the functions that move it and what a unit of each does there, in order of functions.
    pub fn iter(&self) -> impl Iterator<Item = &[(u32, Vector3<f64>)]> {
        self.starts.windows(2).map(|ends| &self.entries[ends[0]..ends[1]])
    }
}

impl Basis {
    /// The rows of these vertices. Of a few thousand at a time they fit the caches, and can be made in parallel.
    ///
    /// # Panics
    /// When the range ends beyond the vertices.
    pub fn rows(&self, vertices: Range<usize>) -> Rows {
        assert!(vertices.end <= self.vertex_count(), "a row for each vertex");
        let starts = starts(self.row_lengths(&vertices));
        let mut entries = vec![(0, Vector3::zeros()); starts[vertices.len()]];
        self.fill(&vertices, &starts, &mut entries);
        Rows { starts, entries }
    }

    /// The rows of all vertices, by all threads.
    pub fn all_rows(&self) -> Rows {
        let vertices = self.vertex_count();
        let chunks = (0..vertices.div_ceil(CHUNK)).into_par_iter();
        let chunks = chunks.map(|i| i * CHUNK..((i + 1) * CHUNK).min(vertices));
        let starts = starts(chunks.clone().flat_map_iter(|chunk| self.row_lengths(&chunk)).collect());
        // One piece of memory, made by many threads.
        let mut entries: Vec<(u32, Vector3<f64>)> =
            rayon::iter::repeat_n((0, Vector3::zeros()), starts[vertices]).collect();
        let mut rest = &mut entries[..];
        let parts = (0..vertices).step_by(CHUNK).map(|first| {
            let end = (first + CHUNK).min(vertices);
            rest.split_off_mut(..starts[end] - starts[first]).unwrap_or_default()
        });
        let parts: Vec<_> = parts.collect();
        chunks.zip(parts).for_each(|(chunk, part)| self.fill(&chunk, &starts[chunk.start..=chunk.end], part));
        Rows { starts, entries }
    }

    /// How many functions move each of these vertices.
    fn row_lengths(&self, vertices: &Range<usize>) -> Vec<usize> {
        let mut lengths = vec![0; vertices.len()];
        (0..self.functions().len()).for_each(|i| self.part(i, vertices, |row, _| lengths[row] += 1));
        lengths
    }

    /// Puts the rows of these vertices, which start as `starts` says, into their place.
    fn fill(&self, vertices: &Range<usize>, starts: &[usize], entries: &mut [(u32, Vector3<f64>)]) {
        let mut next: Vec<usize> = starts.iter().map(|start| start - starts[0]).collect();
        for i in 0..self.functions().len() {
            self.part(i, vertices, |row, d| {
                entries[next[row]] = (i as u32, d);
                next[row] += 1;
            });
        }
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

/// Where rows of these lengths start, and where the last one ends.
fn starts(mut lengths: Vec<usize>) -> Vec<usize> {
    let mut end = 0;
    for length in &mut lengths {
        end += std::mem::replace(length, end);
    }
    lengths.push(end);
    lengths
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
            let progressive = ProgressiveMesh::new(made.mesh.clone(), &made.points).unwrap();
            let options = BasisOptions { function, amplitudes, coefficients: 30 };
            let basis = Basis::new(progressive, &made.points, &options).unwrap();
            let n = basis.vertex_count();
            let parts = [0..1, 1..1, 1..300, 300..n].map(|vertices| basis.rows(vertices));
            let rows: Vec<_> = parts.iter().flat_map(Rows::iter).collect();
            assert_eq!(rows.len(), n);
            assert!(rows.iter().copied().eq(basis.all_rows().iter()));
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
