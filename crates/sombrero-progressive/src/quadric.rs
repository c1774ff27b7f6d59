//! Quadric error: the sum of squared distances from a point to a set of weighted planes.
//!
//! Q(x) = Σ w (n · x + d)² = xᵀ A x + 2 bᵀ x + c, with A = Σ w n nᵀ, b = Σ w d n, c = Σ w d².
//! (Garland and Heckbert 1997, `REFERENCES.bib` key `garland1997`.)

use nalgebra::{Matrix3, Point3, Vector3};
use sombrero_mesh::geometry::area_vector;
use sombrero_mesh::{FaceId, HalfedgeId, Mesh};
use std::ops::AddAssign;

/// Ten numbers: the upper triangle of A, then b, then c.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Quadric {
    a: [f64; 6],
    b: Vector3<f64>,
    c: f64,
}

impl Quadric {
    /// `weight` times the squared distance to the plane through `point` with unit normal `normal`.
    pub(crate) fn plane(normal: &Vector3<f64>, point: &Point3<f64>, weight: f64) -> Self {
        let (n, d) = (normal, -normal.dot(&point.coords));
        let wn = n * weight;
        Self {
            a: [wn.x * n.x, wn.x * n.y, wn.x * n.z, wn.y * n.y, wn.y * n.z, wn.z * n.z],
            b: wn * d,
            c: weight * d * d,
        }
    }

    /// The error at `x`. Rounding can make it slightly negative.
    #[inline]
    pub(crate) fn at(&self, x: &Point3<f64>) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let ax = Vector3::new(
            xx * x.x + xy * x.y + xz * x.z,
            xy * x.x + yy * x.y + yz * x.z,
            xz * x.x + yz * x.y + zz * x.z,
        );
        x.coords.dot(&(ax + self.b * 2.0)) + self.c
    }

    /// The matrix A and the vector b; the error is smallest where A x = -b.
    pub(crate) fn normal_equations(&self) -> (Matrix3<f64>, Vector3<f64>) {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        (Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz), self.b)
    }
}

impl AddAssign for Quadric {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        for (mine, theirs) in self.a.iter_mut().zip(other.a) {
            *mine += theirs;
        }
        self.b += other.b;
        self.c += other.c;
    }
}

/// Weight of the planes that hold boundary edges in place, relative to the squared edge length.
const BOUNDARY_WEIGHT: f64 = 10.0;

/// The quadric of each vertex of the unsimplified mesh (removed vertices have a zero one).
///
/// It gathers the planes of its faces, each with a third of the face's area, and for each boundary edge at
/// the vertex the plane that stands upright on the edge. Quadrics of large coordinates lose their digits:
/// move the model to the origin first.
pub(crate) fn vertex_quadrics(mesh: &Mesh, points: &[Point3<f64>]) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); mesh.vertex_bound()];
    for f in mesh.faces() {
        let corners = mesh.vertices_of_face(f);
        let [a, b, c] = corners.map(|v| points[v.index()]);
        let normal = area_vector(&a, &b, &c);
        let Some(unit) = normal.try_normalize(0.0) else { continue };
        let quadric = Quadric::plane(&unit, &a, normal.norm() / 6.0);
        corners.into_iter().for_each(|v| quadrics[v.index()] += quadric);
        for h in boundary_sides(mesh, f) {
            let ends = [mesh.tail(h), mesh.tip(h)];
            let [tail, tip] = ends.map(|v| points[v.index()]);
            let Some(upright) = (tip - tail).cross(&unit).try_normalize(0.0) else { continue };
            let quadric =
                Quadric::plane(&upright, &tail, BOUNDARY_WEIGHT * (tip - tail).norm_squared() / 2.0);
            ends.into_iter().for_each(|v| quadrics[v.index()] += quadric);
        }
    }
    quadrics
}

/// The sides of a face that lie on the boundary.
fn boundary_sides(mesh: &Mesh, f: FaceId) -> impl Iterator<Item = HalfedgeId> + '_ {
    let h = mesh.face_halfedge(f);
    [h, mesh.next(h), mesh.prev(h)].into_iter().filter(|h| mesh.face(h.twin()).is_none())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn sums_squared_distances(planes in prop::collection::vec((vector(), vector(), 0.0..2.0f64), 1..8), x in vector()) {
            let x = Point3::from(x);
            let mut quadric = Quadric::default();
            let mut expected = 0.0;
            for (normal, point, weight) in planes {
                let Some(normal) = normal.try_normalize(1e-3) else { continue };
                let point = Point3::from(point);
                quadric += Quadric::plane(&normal, &point, weight);
                expected += weight * normal.dot(&(x - point)).powi(2);
            }
            prop_assert!((quadric.at(&x) - expected).abs() < 1e-12);
        }
    }
}
