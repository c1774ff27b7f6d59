//! An affine map of points and of the normals that go with them.
//!
//! Points move by x' = L x + t. A normal is the cross product of two tangents, and
//! (L a) × (L b) = cof(L) (a × b) with the cofactor matrix cof(L) = det(L) L⁻ᵀ.

use nalgebra::{Matrix3, Point3, Similarity3, Vector3};

/// x' = L x + t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AffineMap {
    pub(crate) linear: Matrix3<f64>,
    pub(crate) shift: Vector3<f64>,
    cofactor: Matrix3<f64>,
}

impl AffineMap {
    pub(crate) fn new(linear: Matrix3<f64>, shift: Vector3<f64>) -> Self {
        let [x, y, z] = [0, 1, 2].map(|k| linear.column(k).into_owned());
        let cofactor = Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)]);
        Self { linear, shift, cofactor }
    }

    pub(crate) fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.linear * p.coords + self.shift)
    }

    /// The direction of a normal, whose length is nothing in particular.
    pub(crate) fn normal(&self, n: &Vector3<f64>) -> Vector3<f64> {
        self.cofactor * n
    }

    /// First `first`, then this.
    pub(crate) fn after(&self, first: &Self) -> Self {
        Self::new(self.linear * first.linear, self.linear * first.shift + self.shift)
    }

    /// The map back; `None` when this one is singular.
    pub(crate) fn inverse(&self) -> Option<Self> {
        let inverse = self.linear.try_inverse().filter(|m| m.iter().all(|x| x.is_finite()))?;
        Some(Self::new(inverse, -(inverse * self.shift)))
    }
}

impl From<&Similarity3<f64>> for AffineMap {
    fn from(s: &Similarity3<f64>) -> Self {
        let rotation = s.isometry.rotation.to_rotation_matrix().into_inner();
        Self::new(rotation * s.scaling(), s.isometry.translation.vector)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_normal() {
        let linear = Matrix3::new(1.0, 0.3, -0.2, 0.1, 1.4, 0.5, -0.3, 0.2, 0.8);
        let map = AffineMap::new(linear, Vector3::new(1.0, 2.0, 3.0));
        let (a, b) = (Vector3::new(1.0, 2.0, -0.5), Vector3::new(0.3, -1.0, 2.0));
        let expected = (linear * a).cross(&(linear * b));
        assert!((map.normal(&a.cross(&b)) - expected).norm() < 1e-12);
        let p = Point3::new(4.0, -5.0, 6.0);
        let back = map.inverse().unwrap();
        assert!((back.point(&map.point(&p)) - p).norm() < 1e-12);
        assert!((back.after(&map).point(&p) - p).norm() < 1e-12);
    }

    #[test]
    fn a_similarity_is_one() {
        let s = Similarity3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.4, -0.2, 1.0), 2.5);
        let p = Point3::new(4.0, -5.0, 6.0);
        assert!((AffineMap::from(&s).point(&p) - s * p).norm() < 1e-12);
        assert!(AffineMap::new(Matrix3::zeros(), Vector3::zeros()).inverse().is_none());
    }
}
