//! Signed distance: negative inside.
//!
//! At the closest point c of p the sign is that of (p - c) · n, with the right normal n (Bærentzen, Aanæs 2005): that
//! of the face, or the sum of those beside the edge, or around the vertex the sum weighted by the angles
//! of the faces there, whichever c lies on.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::Edges;
use sombrero_mesh::geometry::area_vector;
use sombrero_spatial::{Closest, Surface};

/// Queries answered at a time, to keep the answers' memory small.
const CHUNK: usize = 1 << 18;

/// The distance at one point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Negative inside.
    pub(super) distance: f64,
    /// Whether the closest point lies where the surface ends.
    pub(super) on_rim: bool,
}

pub(super) struct SignedDistance {
    surface: Surface,
    of_faces: Vec<Vector3<f64>>,
    of_edges: Vec<Vector3<f64>>,
    of_vertices: Vec<Vector3<f64>>,
    rim_vertices: Vec<bool>,
    edges: Edges,
}

impl SignedDistance {
    /// Prepares the normals of faces whose corners are different.
    pub(super) fn new(points: &[Point3<f64>], triangles: Vec<[u32; 3]>) -> Self {
        let edges = Edges::new(points.len(), &triangles);
        let mut of_faces = Vec::with_capacity(triangles.len());
        let mut of_edges = vec![Vector3::zeros(); edges.len()];
        let mut of_vertices = vec![Vector3::zeros(); points.len()];
        let mut rim_vertices = vec![false; points.len()];
        for (corners, sides) in triangles.iter().zip(edges.of_side.chunks_exact(3)) {
            let places = corners.map(|v| points[v as usize]);
            let [a, b, c] = &places;
            let normal = area_vector(a, b, c).try_normalize(0.0).unwrap_or_default();
            of_faces.push(normal);
            for k in 0..3 {
                of_edges[sides[k] as usize] += normal;
                of_vertices[corners[k] as usize] += normal * angle(&places, k);
                if edges.sides[sides[k] as usize] == 1 {
                    rim_vertices[corners[k] as usize] = true;
                    rim_vertices[corners[(k + 1) % 3] as usize] = true;
                }
            }
        }
        let surface = Surface::new(points, &triangles);
        Self { surface, of_faces, of_edges, of_vertices, rim_vertices, edges }
    }

    /// The distances at `points`; infinite where there is none.
    pub(super) fn at(&self, points: &[Point3<f64>]) -> Vec<Sample> {
        let beyond = Sample { distance: f64::INFINITY, on_rim: false };
        let chunk = |points: &[Point3<f64>]| -> Vec<Sample> {
            let answers = self.surface.closest_many(points);
            points.iter().zip(answers).map(|(p, c)| c.map_or(beyond, |c| self.sample(p, &c))).collect()
        };
        points.chunks(CHUNK).flat_map(chunk).collect()
    }

    fn sample(&self, p: &Point3<f64>, closest: &Closest) -> Sample {
        let (normal, on_rim) = self.feature(closest);
        let inside = (p - closest.point).dot(&normal) < 0.0;
        let distance = closest.distance();
        Sample { distance: if inside { -distance } else { distance }, on_rim }
    }

    /// The normal of the face, edge or vertex that the point lies on, and whether that is on a rim.
    fn feature(&self, closest: &Closest) -> (Vector3<f64>, bool) {
        let face = closest.face as usize;
        let [a, b, c] = closest.barycentric.map(|weight| weight > 0.0);
        let edge = |k: usize| {
            let edge = self.edges.of_side[3 * face + k] as usize;
            (self.of_edges[edge], self.edges.sides[edge] == 1)
        };
        let vertex = |k: usize| {
            let v = self.surface.triangles()[face][k] as usize;
            (self.of_vertices[v], self.rim_vertices[v])
        };
        match [a, b, c] {
            [true, true, false] => edge(0),
            [false, true, true] => edge(1),
            [true, false, true] => edge(2),
            [true, false, false] => vertex(0),
            [false, true, false] => vertex(1),
            [false, false, true] => vertex(2),
            _ => (self.of_faces[face], false),
        }
    }
}

/// The angle of a triangle at corner `k`.
fn angle(places: &[Point3<f64>; 3], k: usize) -> f64 {
    let [u, v] = [1, 2].map(|i| places[(k + i) % 3] - places[k]);
    libm::atan2(u.cross(&v).norm(), u.dot(&v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    proptest! {
        #[test]
        fn the_sign_around_a_cube_is_right(p in prop::array::uniform3(-2.0..2.0)) {
            let cube = shapes::cube();
            let bounds = cube.bounding_box().unwrap();
            let p = Point3::from(p);
            let sample = SignedDistance::new(&cube.points, cube.triangles).at(&[p])[0];
            let inside = (0..3).all(|k| bounds.min[k] < p[k] && p[k] < bounds.max[k]);
            prop_assert_eq!(sample.distance < 0.0, inside);
            prop_assert!(!sample.on_rim);
        }
    }

    #[test]
    fn behind_a_rim_samples_say_so() {
        let sheet = Soup::new(
            vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)],
            vec![[0, 1, 2]],
        );
        let distance = SignedDistance::new(&sheet.points, sheet.triangles);
        let probes = [[0.2, 0.2, 1.0], [0.2, 0.2, -1.0], [-1.0, 0.5, 0.5], [-1.0, -1.0, 0.0]];
        let samples = distance.at(&probes.map(Point3::from));
        assert_eq!([1.0, -1.0], [samples[0].distance, samples[1].distance]);
        assert_eq!([false, false, true, true], [0, 1, 2, 3].map(|i: usize| samples[i].on_rim));
    }

    use sombrero_mesh::Soup;
}
