//! A surface made ready for registration, in a frame of its own.
//!
//! Inside the crate every surface lives in its *unit frame*: the centre of the bounding box is the origin
//! and the diagonal has length 1. Lengths, angles and the logarithm of a scale are then numbers of one
//! order, and neither huge coordinates nor tiny models cost digits.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::{BoundingBox, Weld};
use sombrero_spatial::{Closest, Rim, Spread, Surface};

use crate::error::{RegistrationError, Side};
use crate::surface::moments::Moments;

/// A surface thinner than this fraction of its diagonal is flat.
const THINNEST: f64 = 1e-7;

/// Weight of a corner up to which a closest point lies on the edge opposite to it. None at all: samples lie anywhere, so
/// a closest point is on an edge because it was clamped to it, which makes the weight exactly 0, or not at all.
const ON_RIM: f64 = 0.0;

/// Points, triangles and all that is computed from them once.
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    /// Centre of the bounding box, in model units.
    pub(crate) centre: Point3<f64>,
    /// Diagonal of the bounding box, in model units.
    pub(crate) diagonal: f64,
    /// Vertices at different positions, in the unit frame.
    pub(crate) points: Vec<Point3<f64>>,
    /// Triangles with three different corners.
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) moments: Moments,
    /// Where samples are taken.
    pub(crate) spread: Spread,
    surface: Surface,
    /// Unit normals; zero for a face without area.
    face_normals: Vec<Vector3<f64>>,
    /// Sums of the area vectors around each vertex, normalised.
    vertex_normals: Vec<Vector3<f64>>,
    rim: Rim,
}

impl Shape {
    /// Checks and prepares a surface: O(n log n).
    pub(crate) fn new(
        side: Side,
        points: &[Point3<f64>],
        triangles: &[[u32; 3]],
    ) -> Result<Self, RegistrationError> {
        let bounds = checked_bounds(side, points, triangles)?;
        // Halves first: the difference of the two ends of the number line would overflow.
        let diagonal = 2.0 * (bounds.max.coords / 2.0 - bounds.min.coords / 2.0).norm();
        if !(diagonal.is_normal() && (1.0 / diagonal).is_normal()) {
            return Err(RegistrationError::NoArea { side });
        }
        let centre = Point3::from(bounds.max.coords / 2.0 + bounds.min.coords / 2.0);
        let unit: Vec<_> = points.iter().map(|p| Point3::from((p - centre) / diagonal)).collect();
        let weld = Weld::new(&unit);
        let mut triangles = weld.triangles(triangles);
        // A corner that comes twice would make its edges look like inner ones.
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        let moments = Moments::new(&weld.points, &triangles);
        if moments.spreads.y <= THINNEST || moments.area <= THINNEST * THINNEST {
            return Err(RegistrationError::NoArea { side });
        }
        if moments.spreads.z <= THINNEST {
            return Err(RegistrationError::Flat { side });
        }
        Ok(Self::prepared(centre, diagonal, weld.points, triangles, moments))
    }

    fn prepared(
        centre: Point3<f64>,
        diagonal: f64,
        points: Vec<Point3<f64>>,
        triangles: Vec<[u32; 3]>,
        moments: Moments,
    ) -> Self {
        let area_vectors: Vec<_> = triangles.iter().map(|&t| area_vector(&points, t)).collect();
        let mut vertex_normals = vec![Vector3::zeros(); points.len()];
        for (t, area_vector) in triangles.iter().zip(&area_vectors) {
            for &v in t {
                vertex_normals[v as usize] += area_vector;
            }
        }
        vertex_normals.iter_mut().for_each(|n| *n = unit_or_zero(n));
        Self {
            spread: Spread::new(&points, &triangles),
            surface: Surface::new(&points, &triangles),
            face_normals: area_vectors.iter().map(unit_or_zero).collect(),
            rim: Rim::new(&triangles),
            vertex_normals,
            centre,
            diagonal,
            points,
            triangles,
            moments,
        }
    }

    /// Closest points to each of `queries`; `faces` holds a guess for each and receives the answer.
    pub(crate) fn closest_many(&self, queries: &[Point3<f64>], faces: &mut Vec<u32>) -> Vec<Option<Closest>> {
        let found = if faces.len() == queries.len() {
            self.surface.closest_many_from(queries, faces)
        } else {
            self.surface.closest_many(queries)
        };
        *faces = found.iter().map(|c| c.map_or(0, |c| c.face)).collect();
        found
    }

    /// Unit normal of a face, zero when it has no area.
    pub(crate) fn face_normal(&self, face: u32) -> Vector3<f64> {
        self.face_normals[face as usize]
    }

    /// Normals of the corners weighted by `barycentric`: smoother than the face's own, and less shaken by
    /// noise on the vertices. Not normalised.
    pub(crate) fn smooth_normal(&self, face: u32, barycentric: [f64; 3]) -> Vector3<f64> {
        let corners = self.triangles[face as usize];
        corners.iter().zip(barycentric).map(|(&v, w)| self.vertex_normals[v as usize] * w).sum()
    }

    /// Whether a closest point lies on the rim of an open surface, where its distance says nothing.
    pub(crate) fn on_boundary(&self, closest: &Closest) -> bool {
        self.rim.holds(closest, ON_RIM)
    }
}

/// The bounding box of the vertices in use, when they all are sound.
fn checked_bounds(
    side: Side,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
) -> Result<BoundingBox, RegistrationError> {
    let mut used = Vec::with_capacity(3 * triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            let Some(point) = points.get(vertex as usize) else {
                let vertices = points.len();
                return Err(RegistrationError::MissingVertex { side, triangle, vertex, vertices });
            };
            if !point.iter().all(|x| x.is_finite()) {
                return Err(RegistrationError::NotFinite { side, vertex: vertex as usize });
            }
            used.push(point);
        }
    }
    BoundingBox::of(used).ok_or(RegistrationError::Empty { side })
}

fn area_vector(points: &[Point3<f64>], triangle: [u32; 3]) -> Vector3<f64> {
    let [a, b, c] = triangle.map(|v| points[v as usize]);
    sombrero_mesh::geometry::area_vector(&a, &b, &c)
}

fn unit_or_zero(v: &Vector3<f64>) -> Vector3<f64> {
    v.try_normalize(0.0).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn doubled_corners_make_no_boundary() {
        let torus = shapes::torus(12, 8, 2.0, 1.0);
        let points: Vec<_> = torus.triangles.iter().flatten().map(|&v| torus.points[v as usize]).collect();
        let triangles: Vec<_> =
            (0..torus.triangles.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let shape = Shape::new(Side::Suspect, &points, &triangles).unwrap();
        let outside = shape.points.iter().map(|p| p * 1.5).collect::<Vec<_>>();
        let closest = shape.closest_many(&outside, &mut Vec::new());
        assert!(closest.into_iter().flatten().all(|c| !shape.on_boundary(&c)));
    }
}
