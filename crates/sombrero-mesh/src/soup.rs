//! Positions and triangles with nothing promised about them.

use crate::geometry::area_vector;
use nalgebra::{Point3, Vector3};

/// An indexed set of triangles as a file holds it: possibly dirty, possibly empty.
///
/// It is the plain data that crosses crate borders. [`repair`](crate::repair::repair) makes a
/// halfedge [`Mesh`](crate::Mesh) of it.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Soup {
    /// Vertex positions in model units.
    pub points: Vec<Point3<f64>>,
    /// Corners of each triangle as indices into `points`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Soup {
    /// Joins positions and triangles; nothing is checked.
    pub fn new(points: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        Self { points, triangles }
    }

    /// `used()[v]` tells whether some triangle has `v` as a corner. Indices out of range are passed over.
    pub fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.points.len()];
        for &corner in self.triangles.iter().flatten() {
            if let Some(flag) = used.get_mut(corner as usize) {
                *flag = true;
            }
        }
        used
    }

    /// The soup without the vertices that no triangle uses, and for each vertex that is left the one that it was.
    ///
    /// # Panics
    /// When a corner index is out of range.
    pub fn compacted(self) -> (Self, Vec<u32>) {
        let mut place = vec![0u32; self.points.len()];
        let mut source = Vec::new();
        for (v, _) in self.used().into_iter().enumerate().filter(|(_, used)| *used) {
            place[v] = source.len() as u32;
            source.push(v as u32);
        }
        let triangles = self.triangles.iter().map(|corners| corners.map(|v| place[v as usize])).collect();
        let points = source.iter().map(|&v| self.points[v as usize]).collect();
        (Self { points, triangles }, source)
    }

    /// [`vertex_normals`] of its own.
    ///
    /// # Panics
    /// When a corner index is out of range.
    pub fn vertex_normals(&self) -> Vec<Vector3<f64>> {
        vertex_normals(&self.points, &self.triangles)
    }

    /// The bounding box of the vertices that triangles use; `None` when there are none.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        let used = self.used();
        BoundingBox::of(self.points.iter().zip(used).filter(|(_, used)| *used).map(|(p, _)| p))
    }
}

/// Unit normals of the vertices, triangles weighted by area; zero where there are none or they cancel.
///
/// # Panics
/// When a corner index is out of range.
pub fn vertex_normals(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); points.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|v| &points[v as usize]);
        let area = area_vector(a, b, c);
        corners.iter().for_each(|&v| sums[v as usize] += area);
    }
    sums.into_iter().map(|n: Vector3<f64>| n.try_normalize(0.0).unwrap_or_default()).collect()
}

/// An axis-aligned box, in model units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BoundingBox {
    /// Smallest coordinates.
    pub min: Point3<f64>,
    /// Largest coordinates.
    pub max: Point3<f64>,
}

impl BoundingBox {
    /// The smallest box around `points`; `None` without points.
    pub fn of<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Option<Self> {
        points.into_iter().fold(None, |sofar, p| match sofar {
            None => Some(Self { min: *p, max: *p }),
            Some(b) => Some(Self { min: b.min.inf(p), max: b.max.sup(p) }),
        })
    }

    /// Side lengths.
    pub fn sides(&self) -> Vector3<f64> {
        self.max - self.min
    }

    /// The largest side: the paper's unit of length for noise, distortion and radii.
    pub fn largest_side(&self) -> f64 {
        self.sides().max()
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        self.sides().norm()
    }
}
