//! The columns of N: displacement fields over the vertices of the original, a combination N β of which is solved for.

use crate::deformation::Deformation;
use crate::warp::Warp;
use nalgebra::{Point3, Vector3};
use sombrero_mesh::{BoundingBox, Soup};

/// The fields of one nuisance over the vertices of the original.
///
/// Their values are computed where they are needed: a few products for each, while all of them would take twenty times
/// the memory of the mesh.
#[derive(Debug, Clone)]
pub(crate) struct Fields<'a> {
    deformation: Deformation,
    original: &'a Soup,
    frame: Frame,
    /// Those of the Legendre polynomials in x, y and z, for each scalar field.
    exponents: Vec<[usize; 3]>,
    /// Fields that are given vertex by vertex.
    modes: Vec<&'a Vec<Vector3<f64>>>,
    warp: Option<&'a Warp>,
    /// τ of the warp, in largest sides.
    pub(crate) spread: f64,
}

/// Standard deviation of what the smooth fields move beforehand, in largest sides.
const DEFORMATION: f64 = 0.1;
/// That of the warp's nodes at first.
const SPREAD: f64 = 0.002;
/// And the least that it counts as.
const LEAST_SPREAD: f64 = 1e-7;

/// One point's ψ: at most the lattice's 64.
type Scalars = [f64; 64];

impl<'a> Fields<'a> {
    pub(crate) fn new(
        original: &'a Soup,
        deformation: Deformation,
        modes: Vec<&'a Vec<Vector3<f64>>>,
        warp: Option<&'a Warp>,
    ) -> Self {
        let frame = Frame::new(original, deformation == Deformation::Similarity);
        Self { deformation, original, frame, exponents: deformation.exponents(), modes, warp, spread: SPREAD }
    }

    /// How many columns N has: the sparse ones first.
    pub(crate) fn columns(&self) -> usize {
        let smooth = if self.deformation == Deformation::Similarity { 7 } else { 3 * self.exponents.len() };
        self.sparse() + smooth + self.modes.len()
    }

    /// How many of them are the warp's, with few entries in each row.
    pub(crate) fn sparse(&self) -> usize {
        self.warp.map_or(0, Warp::columns)
    }

    /// The standard deviation that column i's unknown has beforehand, for an original of this largest side.
    pub(crate) fn prior_deviation(&self, i: usize, side: f64) -> f64 {
        if i < self.sparse() {
            self.spread.max(LEAST_SPREAD) * side
        } else if i + self.modes.len() < self.columns() {
            DEFORMATION * side
        } else {
            // How much of a mode there is is a number of the order of one whatever the units are.
            1.0
        }
    }

    /// The terms of the sparse columns of n · N at the point of a face with these weights.
    pub(crate) fn sparse_row(
        &self,
        corners: [u32; 3],
        weights: [f64; 3],
        n: &Vector3<f64>,
        term: impl FnMut(usize, f64),
    ) {
        if let Some(warp) = self.warp {
            warp.row(corners, weights, n, term);
        }
    }

    /// The other columns of n · N at the point of a face with these weights: one row.
    pub(crate) fn row(&self, corners: [u32; 3], weights: [f64; 3], n: &Vector3<f64>, row: &mut [f64]) {
        let mut psi: Scalars = [0.0; 64];
        for (&v, weight) in corners.iter().zip(weights).filter(|(_, weight)| *weight != 0.0) {
            for (sum, value) in psi.iter_mut().zip(self.at(v)) {
                *sum += weight * value;
            }
        }
        let (smooth, modes) = row.split_at_mut(row.len() - self.modes.len());
        if self.deformation == Deformation::Similarity {
            let x = Vector3::new(psi[1], psi[2], psi[3]);
            let turn = x.cross(n);
            smooth.copy_from_slice(&[n.x, n.y, n.z, turn.x, turn.y, turn.z, x.dot(n)]);
        } else {
            for (out, psi) in smooth.chunks_exact_mut(3).zip(psi) {
                out.iter_mut().zip(n.iter()).for_each(|(out, n)| *out = psi * n);
            }
        }
        for (out, mode) in modes.iter_mut().zip(&self.modes) {
            *out = corners.iter().zip(weights).map(|(&v, weight)| mode[v as usize].dot(n) * weight).sum();
        }
    }

    /// N β at a vertex, in model units.
    pub(crate) fn displacement(&self, vertex: u32, beta: &[f64]) -> Vector3<f64> {
        let psi = self.at(vertex);
        let (warp, dense) = beta.split_at(self.sparse());
        let (smooth, modes) = dense.split_at(dense.len() - self.modes.len());
        let warped = self.warp.map_or(Vector3::zeros(), |field| field.displacement(vertex, warp));
        let shaken: Vector3<f64> = match smooth {
            &[a, b, c, i, j, k, scale] if self.deformation == Deformation::Similarity => {
                let x = Vector3::new(psi[1], psi[2], psi[3]);
                Vector3::new(a, b, c) + Vector3::new(i, j, k).cross(&x) + x * scale
            }
            smooth => {
                let terms = smooth.chunks_exact(3).zip(psi);
                terms.map(|(c, psi)| Vector3::new(c[0], c[1], c[2]) * psi).sum()
            }
        };
        warped
            + shaken
            + modes.iter().zip(&self.modes).map(|(b, mode)| mode[vertex as usize] * *b).sum::<Vector3<f64>>()
    }

    /// ψ at a vertex; zero beyond the fields that there are.
    fn at(&self, vertex: u32) -> Scalars {
        let [x, y, z] = self.frame.unit(&self.original.points[vertex as usize]).map(legendre);
        let mut psi = [0.0; 64];
        for (psi, &[i, j, k]) in psi.iter_mut().zip(&self.exponents) {
            *psi = x[i] * y[j] * z[k];
        }
        psi
    }
}

/// The bounding box as the cube [-1, 1]³; one scale for all axes where shape matters (similarity).
#[derive(Debug, Clone)]
struct Frame {
    centre: Point3<f64>,
    half: Vector3<f64>,
}

impl Frame {
    fn new(original: &Soup, uniform: bool) -> Self {
        let around = original.bounding_box();
        let centre = around.map_or(Point3::origin(), |b| nalgebra::center(&b.min, &b.max));
        let sides = around.map_or(Vector3::zeros(), |b: BoundingBox| b.sides());
        let largest = if sides.max() > 0.0 { sides.max() / 2.0 } else { 1.0 };
        // A flat box gets some depth, so that points of a copy beside it stay in range.
        let half =
            if uniform { Vector3::repeat(largest) } else { (sides / 2.0).map(|s| s.max(0.05 * largest)) };
        Self { centre, half }
    }

    fn unit(&self, p: &Point3<f64>) -> [f64; 3] {
        // Vertices without a face may lie anywhere; the fields say nothing about them.
        (p - self.centre).component_div(&self.half).map(|x| x.clamp(-2.0, 2.0)).into()
    }
}

/// P_0 to P_3 at x.
fn legendre(x: f64) -> [f64; 4] {
    [1.0, x, (3.0 * x * x - 1.0) / 2.0, (5.0 * x * x - 3.0) * x / 2.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::smoothing_modes;
    use sombrero_shapes as shapes;

    const ALL: [(Deformation, usize); 6] = [
        (Deformation::Similarity, 7),
        (Deformation::Affine, 12),
        (Deformation::Quadratic, 30),
        (Deformation::Cubic, 60),
        (Deformation::Lattice, 192),
        // But for its nodes.
        (Deformation::Warp, 60),
    ];

    #[test]
    fn columns_are_as_many_as_said() {
        let soup = shapes::sphere(2);
        for (deformation, columns) in ALL {
            let modes = smoothing_modes(&soup);
            let count = |modes| Fields::new(&soup, deformation, modes, None).columns();
            assert_eq!(
                (count(vec![]), count(modes.iter().collect())),
                (columns, columns + 4),
                "{deformation:?}"
            );
        }
    }

    /// The row of a vertex times β is n · (N β) there.
    #[test]
    fn rows_and_displacements_are_one_field() {
        let soup = shapes::bumpy_sphere(200);
        for (deformation, _) in ALL {
            let modes = smoothing_modes(&soup);
            let fields = Fields::new(&soup, deformation, modes.iter().collect(), None);
            let beta: Vec<f64> = (0..fields.columns()).map(|i| (i as f64 * 0.7).sin()).collect();
            let n = Vector3::new(0.3, -0.5, 0.8);
            let t = soup.triangles[11];
            let weights = [0.2, 0.5, 0.3];
            let mut row = vec![0.0; fields.columns()];
            fields.row(t, weights, &n, &mut row);
            let by_row: f64 = row.iter().zip(&beta).map(|(a, b)| a * b).sum();
            let moved: Vector3<f64> =
                t.iter().zip(weights).map(|(&v, w)| fields.displacement(v, &beta) * w).sum();
            assert!((by_row - n.dot(&moved)).abs() < 1e-12, "{deformation:?}");
        }
    }

    /// A small rotation about any centre is in the span of the similarity's columns.
    #[test]
    fn a_small_similarity_is_in_the_span() {
        let soup = shapes::part(2);
        let fields = Fields::new(&soup, Deformation::Similarity, vec![], None);
        let omega = Vector3::new(0.3, -0.2, 0.1);
        let frame = Frame::new(&soup, true);
        let turn = omega * frame.half.x;
        let beta = [0.0, 0.0, 0.0, turn.x, turn.y, turn.z, 0.0];
        for (v, p) in (0..).zip(&soup.points) {
            let expected = omega.cross(&(p - frame.centre));
            assert!((fields.displacement(v, &beta) - expected).norm() < 1e-12);
        }
    }
}
