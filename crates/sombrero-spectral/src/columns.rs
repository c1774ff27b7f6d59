//! What each field does at each vertex, field by field: the columns of a matrix, one behind the other.

use crate::together::Here;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Vertices that one task takes.
const CHUNK: usize = 1 << 14;

/// Columns of displacements in model units, in vertex order; vertices that stand still are not in them.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    lengths: Vec<usize>,
    vertices: Vec<u32>,
    vectors: Vec<Vector3<f64>>,
}

/// The places of a column that one task fills.
type Part<'a> = std::iter::Zip<std::slice::IterMut<'a, u32>, std::slice::IterMut<'a, Vector3<f64>>>;

impl Columns {
    /// Of what each of so many fields does at each vertex, times a factor, given the field and the vertex.
    ///
    /// # Panics
    /// When a field is not below `fields`.
    pub fn new(at: &[&Here], fields: usize, factor: impl Fn(u32, u32) -> f64 + Sync) -> Self {
        let count = |at: &[&Here]| {
            let mut counts = vec![0; fields];
            at.iter().copied().flatten().for_each(|(i, _)| counts[*i as usize] += 1);
            counts
        };
        let counts: Vec<Vec<usize>> = at.par_chunks(CHUNK).map(count).collect();
        let lengths: Vec<usize> = (0..fields).map(|i| counts.iter().map(|counts| counts[i]).sum()).collect();
        let total = lengths.iter().sum();
        let mut vertices = vec![0; total];
        // By many threads, since what is new memory is made when it is first written to.
        let mut vectors: Vec<Vector3<f64>> = rayon::iter::repeat_n(Vector3::zeros(), total).collect();
        let fill = |(chunk, (at, mut parts)): (usize, (&[&Here], Vec<Part<'_>>))| {
            for (v, here) in ((chunk * CHUNK) as u32..).zip(at) {
                for (i, d) in *here {
                    if let Some((vertex, vector)) = parts[*i as usize].next() {
                        (*vertex, *vector) = (v, d * factor(*i, v));
                    }
                }
            }
        };
        at.par_chunks(CHUNK).zip(parts(&counts, &mut vertices, &mut vectors)).enumerate().for_each(fill);
        Self { lengths, vertices, vectors }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.lengths.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.lengths.is_empty()
    }

    /// Each column's vertices with their displacements.
    pub fn iter(&self) -> impl Iterator<Item = impl Iterator<Item = (u32, Vector3<f64>)>> {
        let mut end = 0;
        self.lengths.iter().map(move |length| {
            let column = end..end + length;
            end = column.end;
            let vertices = self.vertices[column.clone()].iter().copied();
            vertices.zip(self.vectors[column].iter().copied())
        })
    }

    /// How many entries each has, and the vertices and displacements of all.
    pub fn into_parts(self) -> (Vec<usize>, Vec<u32>, Vec<Vector3<f64>>) {
        (self.lengths, self.vertices, self.vectors)
    }

    /// Whether all displacements are numbers.
    pub(crate) fn are_finite(&self) -> bool {
        self.vectors.par_iter().all(|d| d.iter().all(|x| x.is_finite()))
    }
}

/// For each chunk its part of each column; `counts` says how long it is.
fn parts<'a>(
    counts: &[Vec<usize>],
    mut vertices: &'a mut [u32],
    mut vectors: &'a mut [Vector3<f64>],
) -> Vec<Vec<Part<'a>>> {
    let mut parts: Vec<Vec<Part<'a>>> =
        counts.iter().map(|counts| Vec::with_capacity(counts.len())).collect();
    for i in 0..counts.first().map_or(0, Vec::len) {
        for (counts, parts) in counts.iter().zip(&mut parts) {
            let (here, rest) = std::mem::take(&mut vertices).split_at_mut(counts[i]);
            let (there, others) = std::mem::take(&mut vectors).split_at_mut(counts[i]);
            (vertices, vectors) = (rest, others);
            parts.push(here.iter_mut().zip(there));
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_rows_turned() {
        let d = |v: usize, i: u32| Vector3::new(v as f64, f64::from(i), 1.0);
        let fields_of = |v: usize| (0..5_u32).filter(move |i| (v * 7 + *i as usize).is_multiple_of(3));
        let rows: Vec<Vec<(u32, Vector3<f64>)>> =
            (0..3 * CHUNK + 5).map(|v| fields_of(v).map(|i| (i, d(v, i))).collect()).collect();
        let at: Vec<&Here> = rows.iter().map(Vec::as_slice).collect();
        let columns = Columns::new(&at, 5, |i, _| f64::from(i + 1));
        assert_eq!(columns.len(), 5);
        for (i, column) in (0..).zip(columns.iter()) {
            let expected = (0..rows.len()).filter(|v| fields_of(*v).any(|k| k == i));
            assert!(column.eq(expected.map(|v| (v as u32, d(v, i) * f64::from(i + 1)))));
        }
        assert!(Columns::new(&[], 0, |_, _| 1.0).is_empty());
    }
}
