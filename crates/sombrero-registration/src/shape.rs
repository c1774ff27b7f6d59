//! A surface made ready for registration, in a frame of its own.
//!
//! Inside the crate every surface lives in its *unit frame*: the centre of the bounding box is the origin
//! and the diagonal has length 1. Lengths, angles and the logarithm of a scale are then numbers of one
//! order, and neither huge coordinates nor tiny models cost digits.

use nalgebra::{Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use sombrero_mesh::{BoundingBox, Weld};
use sombrero_spatial::{Closest, Surface};

use crate::error::{RegistrationError, Side};
use crate::moments::Moments;

/// A surface thinner than this fraction of its diagonal is flat.
const THINNEST: f64 = 1e-7;

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
    surface: Surface,
    /// Unit normals; zero for a face without area.
    face_normals: Vec<Vector3<f64>>,
    /// Sums of the area vectors around each vertex, normalised.
    vertex_normals: Vec<Vector3<f64>>,
    boundary: Boundary,
}

/// Which vertices and edges lie on the boundary.
#[derive(Debug, Clone)]
struct Boundary {
    vertices: Vec<bool>,
    /// The edge opposite each corner of each triangle.
    edges: Vec<[bool; 3]>,
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
            surface: Surface::new(&points, &triangles),
            face_normals: area_vectors.iter().map(unit_or_zero).collect(),
            boundary: Boundary::new(points.len(), &triangles),
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
        let face = closest.face as usize;
        let w = closest.barycentric;
        let edge = (0..3).any(|k| w[k] == 0.0 && self.boundary.edges[face][k]);
        let vertex = (0..3).any(|k| w[k] == 1.0 && self.boundary.vertices[self.triangles[face][k] as usize]);
        edge || vertex
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

impl Boundary {
    /// Edges with a single triangle, and their ends.
    fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut sides: Vec<(u32, u32, u32, u8)> = Vec::with_capacity(3 * triangles.len());
        for (face, t) in (0..).zip(triangles) {
            for k in 0..3u8 {
                let (a, b) = (t[(k as usize + 1) % 3], t[(k as usize + 2) % 3]);
                sides.push((a.min(b), a.max(b), face, k));
            }
        }
        sides.sort_unstable();
        let mut boundary = Self { vertices: vec![false; vertices], edges: vec![[false; 3]; triangles.len()] };
        for edge in sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            if let &[(a, b, face, k)] = edge {
                boundary.edges[face as usize][k as usize] = true;
                boundary.vertices[a as usize] = true;
                boundary.vertices[b as usize] = true;
            }
        }
        boundary
    }
}

/// From the unit frames to model units: the similarity that `pose` is between the unit frames.
pub(crate) fn to_model(
    reference: &Shape,
    suspect: &Shape,
    pose: &Similarity3<f64>,
) -> Option<Similarity3<f64>> {
    let scale = pose.scaling() * (reference.diagonal / suspect.diagonal);
    let rotation = pose.isometry.rotation;
    let shift = reference.centre.coords + pose.isometry.translation.vector * reference.diagonal
        - rotation * (suspect.centre.coords * scale);
    similarity(shift, rotation, scale)
}

/// The reverse of [`to_model`].
pub(crate) fn to_unit(
    reference: &Shape,
    suspect: &Shape,
    model: &Similarity3<f64>,
) -> Option<Similarity3<f64>> {
    let scale = model.scaling() * (suspect.diagonal / reference.diagonal);
    let shift = (model * suspect.centre - reference.centre) / reference.diagonal;
    similarity(shift, model.isometry.rotation, scale)
}

/// `None` when a number is not finite or the scale not positive.
fn similarity(shift: Vector3<f64>, rotation: UnitQuaternion<f64>, scale: f64) -> Option<Similarity3<f64>> {
    let finite = shift.iter().chain(rotation.coords.iter()).all(|x| x.is_finite());
    (finite && scale.is_normal() && scale > 0.0)
        .then(|| Similarity3::from_parts(Translation3::from(shift), rotation, scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn only_the_rim_of_a_sheet_is_boundary() {
        let sheet = shapes::open_sheet(6, 4);
        let shape = Shape::new(Side::Reference, &sheet.points, &sheet.triangles).unwrap();
        assert_eq!(shape.boundary.vertices.iter().filter(|b| **b).count(), 2 * (6 + 4));
        assert_eq!(shape.boundary.edges.iter().flatten().filter(|b| **b).count(), 2 * (6 + 4));
        let torus = shapes::torus(12, 8, 2.0, 1.0);
        let shape = Shape::new(Side::Reference, &torus.points, &torus.triangles).unwrap();
        assert!(shape.boundary.vertices.iter().all(|b| !b));
    }

    #[test]
    fn doubled_corners_make_no_boundary() {
        let torus = shapes::torus(12, 8, 2.0, 1.0);
        let points: Vec<_> = torus.triangles.iter().flatten().map(|&v| torus.points[v as usize]).collect();
        let triangles: Vec<_> =
            (0..torus.triangles.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let shape = Shape::new(Side::Suspect, &points, &triangles).unwrap();
        assert!(shape.boundary.vertices.iter().all(|b| !b));
    }

    #[test]
    fn frames_there_and_back() {
        let (a, b) = (shapes::part(1), shapes::bumpy_sphere(200));
        let a = Shape::new(Side::Reference, &a.points, &a.triangles).unwrap();
        let b = Shape::new(Side::Suspect, &b.points, &b.triangles).unwrap();
        let s = Similarity3::new(Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.3, 0.2, -0.9), 0.7);
        let back = to_model(&a, &b, &to_unit(&a, &b, &s).unwrap()).unwrap();
        assert!((back.to_homogeneous() - s.to_homogeneous()).norm() < 1e-12);
    }
}
