//! Warps that are finer than the lattice, as a random field of space.
//!
//! White noise at nodes z_j, smoothed by a kernel, is a smooth random field (process convolution; Higdon 2002):
//!
//! ```text
//! u(x) = Σ_j c_j K(|x - z_j| / R),    c_j ~ N(0, τ²) along each axis,    K(r) = (1 - r)⁴₊ (4 r + 1)
//! ```
//!
//! with Wendland's kernel of two continuous derivatives (1995), which reaches few nodes, so that rows are sparse. There
//! are more unknowns than the mark has, so that without a prior they would eat it; τ says how much of them there may be.
//! It follows from the residuals alone, as that which makes them most probable (MacKay, Neural Computation 1992):
//!
//! ```text
//! τ² ← |c|² / γ,    γ = k - s² tr(H⁻¹) / τ²    the number of unknowns that the suspect determines.
//! ```

use nalgebra::{Point3, Vector3};
use nalgebra_sparse::CsrMatrix;
use rayon::prelude::*;
use sombrero_mesh::Soup;
use sombrero_spatial::NearestVertex;
use std::collections::BTreeMap;

/// Edge of the cells that have a node each, in largest sides.
const SPACING: f64 = 0.09;
/// By so much cells grow until there are few enough nodes.
const COARSER: f64 = 1.1;
/// Nodes at most: the unknowns, three for each, are solved for as one dense system.
const MOST_NODES: usize = 400;
/// R in edges of cells.
const REACH: f64 = 3.0;

/// The kernels of all nodes over the vertices of the original.
#[derive(Debug)]
pub(crate) struct Warp {
    /// A row a vertex, a column a node.
    kernels: CsrMatrix<f64>,
}

impl Warp {
    /// The kernels for the vertices of `original` that have a face; `side` is its largest side.
    pub(crate) fn new(original: &Soup, side: f64) -> Self {
        let used = original.used();
        let mut spacing = SPACING * side;
        let mut nodes = nodes(&original.points, &used, spacing);
        while nodes.len() > MOST_NODES {
            spacing *= COARSER;
            nodes = self::nodes(&original.points, &used, spacing);
        }
        let reach = REACH * spacing;
        let near = NearestVertex::new(&nodes);
        let row = |p: &Point3<f64>, used: bool| if used { near.within(p, reach) } else { Vec::new() };
        let rows: Vec<Vec<(u32, f64)>> =
            original.points.par_iter().zip(&used).map(|(p, used)| row(p, *used)).collect();
        let ends = rows.iter().scan(0, |end, row| {
            *end += row.len();
            Some(*end)
        });
        let starts = [0].into_iter().chain(ends).collect();
        let columns = rows.iter().flatten().map(|&(node, _)| node as usize).collect();
        let values = rows.iter().flatten().map(|&(_, distance)| kernel(distance / reach)).collect();
        let kernels = CsrMatrix::try_from_csr_data(rows.len(), nodes.len(), starts, columns, values)
            .expect("rows are ascending and within the nodes");
        Self { kernels }
    }

    /// Unknowns: three a node.
    pub(crate) fn columns(&self) -> usize {
        3 * self.kernels.ncols()
    }

    /// The terms of n · u at the point of a face with these weights, column by column; one may come once for each corner.
    pub(crate) fn row(
        &self,
        corners: [u32; 3],
        weights: [f64; 3],
        n: &Vector3<f64>,
        mut term: impl FnMut(usize, f64),
    ) {
        for (&v, weight) in corners.iter().zip(weights).filter(|(_, weight)| *weight != 0.0) {
            let row = self.kernels.row(v as usize);
            for (&node, kernel) in row.col_indices().iter().zip(row.values()) {
                n.iter().enumerate().for_each(|(axis, n)| term(3 * node + axis, kernel * weight * n));
            }
        }
    }

    /// u at a vertex.
    pub(crate) fn displacement(&self, vertex: u32, c: &[f64]) -> Vector3<f64> {
        let row = self.kernels.row(vertex as usize);
        let of_node = |node: usize| Vector3::from_column_slice(&c[3 * node..][..3]);
        row.col_indices().iter().zip(row.values()).map(|(&node, kernel)| of_node(node) * *kernel).sum()
    }
}

/// The middle of the vertices in each cell of a grid that has some.
fn nodes(points: &[Point3<f64>], used: &[bool], edge: f64) -> Vec<Point3<f64>> {
    let mut cells: BTreeMap<[i64; 3], (Vector3<f64>, f64)> = BTreeMap::new();
    for (p, _) in points.iter().zip(used).filter(|(_, used)| **used) {
        let cell = p.coords.map(|x| (x / edge).floor() as i64);
        let (sum, count) = cells.entry(cell.into()).or_insert((Vector3::zeros(), 0.0));
        *sum += p.coords;
        *count += 1.0;
    }
    cells.into_values().map(|(sum, count)| Point3::from(sum / count)).collect()
}

/// K(r) for 0 ≤ r ≤ 1.
fn kernel(r: f64) -> f64 {
    (1.0 - r).powi(4) * (4.0 * r + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn nodes_are_near_and_few() {
        let soup = shapes::bumpy_sphere(3000);
        let side = soup.bounding_box().unwrap().largest_side();
        let warp = Warp::new(&soup, side);
        assert!(warp.kernels.ncols() > 100 && warp.kernels.ncols() <= MOST_NODES);
        // Every vertex is reached by some, and by few.
        assert!(warp.kernels.row_iter().all(|row| (1..200).contains(&row.nnz())));
    }

    /// The row of a vertex times c is n · u there.
    #[test]
    fn rows_and_displacements_are_one_field() {
        let soup = shapes::bumpy_sphere(300);
        let warp = Warp::new(&soup, 2.0);
        let c: Vec<f64> = (0..warp.columns()).map(|i| (i as f64 * 0.7).sin()).collect();
        let n = Vector3::new(0.3, -0.5, 0.8);
        let (corners, weights) = (soup.triangles[11], [0.2, 0.5, 0.3]);
        let mut by_row = 0.0;
        warp.row(corners, weights, &n, |i, term| by_row += term * c[i]);
        let moved: Vector3<f64> =
            corners.iter().zip(weights).map(|(&v, w)| warp.displacement(v, &c) * w).sum();
        assert!((by_row - n.dot(&moved)).abs() < 1e-12);
    }
}
