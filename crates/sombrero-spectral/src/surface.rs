//! A triangle mesh with what the quadratic forms ask of it: normals, areas, and pairs of faces that share an edge.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::{BoundingBox, Facets, PlanarRegions, hinges};
pub(crate) use sombrero_mesh::{Hinge, Rings};

/// Points and triangles, with normals and areas beside the triangles.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) points: Vec<Point3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) facets: Facets,
    pub(crate) hinges: Vec<Hinge>,
    /// The largest side of the bounding box.
    pub(crate) side: f64,
    /// The sum of all areas.
    pub(crate) area: f64,
}

impl Surface {
    pub(crate) fn new(points: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        let facets = Facets::new(&points, &triangles);
        let hinges = hinges(points.len(), &triangles);
        let side = BoundingBox::of(&points).map_or(0.0, |b| b.largest_side());
        let area = facets.areas.iter().sum();
        Self { points, triangles, facets, hinges, side, area }
    }

    /// Its planar regions; `side` is the length that says what is flat.
    pub(crate) fn planar(&self, side: f64) -> PlanarRegions {
        PlanarRegions::of(&self.points, &self.triangles, side, &self.facets, &self.hinges)
    }

    pub(crate) fn corners(&self, face: usize) -> [Point3<f64>; 3] {
        self.triangles[face].map(|v| self.points[v as usize])
    }

    /// A third of the area of the faces around each vertex.
    pub(crate) fn vertex_areas(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.points.len()];
        for (corners, area) in self.triangles.iter().zip(&self.facets.areas) {
            corners.iter().for_each(|&v| sums[v as usize] += area / 3.0);
        }
        sums
    }

    /// Normals of the vertices, by area; zero where there are none.
    pub(crate) fn vertex_normals(&self) -> Vec<Vector3<f64>> {
        let mut sums = vec![Vector3::zeros(); self.points.len()];
        for (corners, (n, area)) in
            self.triangles.iter().zip(self.facets.normals.iter().zip(&self.facets.areas))
        {
            corners.iter().for_each(|&v| sums[v as usize] += n * *area);
        }
        sums.iter().map(|n| n.try_normalize(0.0).unwrap_or_default()).collect()
    }
}
