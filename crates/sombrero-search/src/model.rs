//! A mesh file as the method sees it: one point a position, and a manifold mesh over the points.

use nalgebra::Point3;
use sombrero_basis::{Basis, BasisError, BasisOptions};
use sombrero_mesh::repair::Repaired;
use sombrero_mesh::{BoundingBox, Soup, Weld, repair};
use sombrero_progressive::ProgressiveMesh;
use std::sync::OnceLock;

/// Stored vertices, joined to points, made a manifold mesh.
///
/// Three kinds of vertices appear, and this type is where they meet: *stored* vertices are those of the
/// file; *points* are stored vertices of equal position, joined; *mesh* vertices are points, some of them
/// copied so that the surface is a manifold, those without a face left out. Watermarks move points, so
/// whatever was joined in the file stays joined.
#[derive(Debug, Clone)]
pub struct Model {
    /// The point of each stored vertex.
    point_of: Vec<u32>,
    soup: Soup,
    /// Made when first asked for: suspects need none.
    repaired: OnceLock<Repaired>,
    bounds: OnceLock<Option<BoundingBox>>,
}

impl Model {
    /// Joins; never fails. A soup without a usable face gives a model without faces.
    pub fn new(stored: &Soup) -> Self {
        let weld = Weld::new(&stored.points);
        let in_range = |corners: &&[u32; 3]| corners.iter().all(|&v| (v as usize) < stored.points.len());
        let kept: Vec<[u32; 3]> = stored.triangles.iter().filter(in_range).copied().collect();
        let triangles = weld.triangles(&kept);
        let soup = Soup::new(weld.points, triangles);
        Self { point_of: weld.point_of, soup, repaired: OnceLock::new(), bounds: OnceLock::new() }
    }

    /// Points and triangles over points.
    pub fn soup(&self) -> &Soup {
        &self.soup
    }

    /// The manifold mesh and what was done to get it: repaired when first asked for, which never fails.
    pub fn repaired(&self) -> &Repaired {
        self.repaired.get_or_init(|| repair(&self.soup))
    }

    /// Lets go of the manifold mesh, which is as large as all else, until it is asked for again.
    pub(crate) fn forget_repaired(&mut self) {
        self.bounding_box();
        self.repaired.take();
    }

    /// The points alone, for those who need no more.
    pub(crate) fn into_soup(self) -> Soup {
        self.soup
    }

    /// The point of each stored vertex.
    pub fn point_of_stored(&self) -> &[u32] {
        &self.point_of
    }

    /// The bounding box of the vertices that have a face; `None` without a face.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        *self.bounds.get_or_init(|| BoundingBox::of(&self.repaired().points))
    }

    /// The largest side of the bounding box, the unit of relative lengths; 0 without a face.
    pub fn largest_side(&self) -> f64 {
        self.bounding_box().map_or(0.0, |b| b.largest_side())
    }

    /// The progressive mesh that the basis comes from.
    pub fn progressive(&self) -> ProgressiveMesh {
        let Repaired { mesh, points, .. } = self.repaired();
        ProgressiveMesh::new(mesh.clone(), points).expect("repaired points are finite")
    }

    /// The basis over points.
    ///
    /// # Errors
    /// [`BasisError`] when the mesh cannot carry that many coefficients.
    pub fn basis(&self, options: &BasisOptions) -> Result<Basis, BasisError> {
        self.basis_of(&mut self.progressive(), options)
    }

    /// [`basis`](Self::basis), given the model's progressive mesh.
    ///
    /// # Errors
    /// As [`basis`](Self::basis).
    ///
    /// # Panics
    /// When `progressive` is that of a larger model.
    pub fn basis_of(
        &self,
        progressive: &mut ProgressiveMesh,
        options: &BasisOptions,
    ) -> Result<Basis, BasisError> {
        let Repaired { points, source, .. } = self.repaired();
        Ok(Basis::new(progressive, points, options)?.on_points(source, self.soup.points.len()))
    }

    /// Positions of stored vertices from positions of points.
    ///
    /// # Panics
    /// When `points` is shorter than the model's points.
    pub fn stored_from_points(&self, points: &[Point3<f64>]) -> Vec<Point3<f64>> {
        self.point_of.iter().map(|&p| points[p as usize]).collect()
    }

    /// Positions of points from those of stored vertices of a file with the same connectivity: the mean of
    /// the vertices that are one point here.
    ///
    /// # Panics
    /// When `stored` is shorter than the model's stored vertices.
    pub fn points_from_stored(&self, stored: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let mut sums = vec![(nalgebra::Vector3::zeros(), 0.0); self.soup.points.len()];
        for (&point, position) in self.point_of.iter().zip(stored) {
            let (sum, count) = &mut sums[point as usize];
            *sum += position.coords;
            *count += 1.0;
        }
        sums.into_iter().map(|(sum, count)| Point3::from(sum / count)).collect()
    }
}
