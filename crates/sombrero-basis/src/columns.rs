//! The columns of Φ: the values of each function where they are not zero.

use crate::BasisFunction;
use crate::radius::radii;
use crate::support::{Outline, Places, Support};
use nalgebra::Point3;
use nalgebra_sparse::CscMatrix;
use rayon::prelude::*;
use sombrero_progressive::ProgressiveMesh;

/// (vertex, φ) in vertex order.
pub(crate) type Column = Vec<(usize, f64)>;

/// The columns of Φ, each computed on its own, so that threads do not change a bit.
pub(crate) fn columns(
    progressive: &ProgressiveMesh,
    points: &[Point3<f64>],
    outlines: &[Outline],
    function: BasisFunction,
    done: impl Fn() + Sync,
) -> Vec<Column> {
    let mesh = progressive.mesh();
    let mut age = vec![0u32; mesh.vertex_bound()];
    for (born, split) in (1u32..).zip((0..progressive.split_count()).filter_map(|i| progressive.split(i))) {
        age[split.vertex.index()] = born;
    }
    let column = |places: &mut Places, outline: &Outline| {
        let support = Support::fill(mesh, points, &age, outline, places);
        let radii = radii(&support);
        let mut column: Column =
            support.interior.iter().zip(radii).map(|(v, r)| (v.index(), function.value(r))).collect();
        column.sort_unstable_by_key(|entry| entry.0);
        done();
        column
    };
    outlines.par_iter().map_init(|| Places::new(mesh.vertex_bound()), column).collect()
}

pub(crate) fn compressed(rows: usize, columns: &[Column]) -> CscMatrix<f64> {
    let lengths: Vec<usize> = columns.iter().map(Vec::len).collect();
    let entries = || columns.iter().flatten();
    CscMatrix::try_from_csc_data(
        rows,
        columns.len(),
        offsets(&lengths).expect("what is in memory can be counted"),
        entries().map(|e| e.0).collect(),
        entries().map(|e| e.1).collect(),
    )
    .expect("each column has its rows once, in order")
}

/// Where each column begins, and where the last one ends; `None` for more entries than can be counted.
pub(crate) fn offsets(lengths: &[usize]) -> Option<Vec<usize>> {
    let mut offsets = vec![0];
    let mut end = 0_usize;
    for &length in lengths {
        end = end.checked_add(length)?;
        offsets.push(end);
    }
    Some(offsets)
}
