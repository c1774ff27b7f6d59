//! A surface brought into isotropic position: what is left of an affine map then is a rotation.
//!
//! The moments of a *surface* do not follow an affine map, since its area elements grow by |cof(L) n|, which
//! depends on the normal. The position in which centroid and covariance by area are 0 and 1 does: it is a
//! fixed point of
//!
//! ```text
//! L ← C^(-1/2) L,   C the covariance of the surface moved by L,
//! ```
//!
//! that is Tyler's iteration for a scatter matrix (1987, `tyler1987`) with areas as weights. Two surfaces that an
//! affine map makes one have the same fixed point up to a rotation.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use crate::refinement::affine_map::AffineMap;
use crate::surface::sample::Sample;

const ITERATIONS: usize = 100;
/// Anisotropy at which the iteration stops.
const TOLERANCE: f64 = 1e-4;

/// The map to isotropic position, in which the samples' RMS distance from the origin is `radius`; `None` for a
/// surface too flat for it. The samples stand for equal areas.
pub(crate) fn position(samples: &[Sample], radius: f64) -> Option<AffineMap> {
    let mut map = AffineMap::new(Matrix3::identity(), Vector3::zeros());
    for _ in 0..ITERATIONS {
        let (mean, covariance) = moments(samples, &map);
        let eigen = SymmetricEigen::new(covariance);
        let (least, most) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
        if !(least > 1e-12 * most && most.is_finite()) {
            return None;
        }
        let root = eigen.eigenvalues.map(|x| radius / (3.0 * x).sqrt());
        let whiten = eigen.eigenvectors * Matrix3::from_diagonal(&root) * eigen.eigenvectors.transpose();
        map = AffineMap::new(whiten, -(whiten * mean)).after(&map);
        if most - least <= TOLERANCE * most {
            break;
        }
    }
    Some(map)
}

/// Centroid and covariance by area of the moved surface.
fn moments(samples: &[Sample], map: &AffineMap) -> (Vector3<f64>, Matrix3<f64>) {
    let (mut area, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for sample in samples {
        let (x, w) = (map.point(&sample.point).coords, map.normal(&sample.face_normal).norm());
        area += w;
        first += x * w;
        second += x * x.transpose() * w;
    }
    let mean = first / area;
    (mean, second / area - mean * mean.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Side;
    use crate::surface::sample::samples;
    use crate::surface::shape::Shape;
    use sombrero_shapes as shapes;

    #[test]
    fn affine_images_differ_by_a_rotation() {
        for soup in
            [shapes::part(3), shapes::bust(16), shapes::bumpy_sphere(1500), shapes::open_sheet(24, 16)]
        {
            let shape = Shape::new(Side::Reference, &soup.points, &soup.triangles).unwrap();
            let some: Vec<_> = samples(&shape, 3000).into_iter().map(Sample::with_unit_normal).collect();
            let linear = Matrix3::new(1.0, 0.3, -0.2, 0.1, 1.4, 0.5, -0.3, 0.2, 0.8);
            let bent = AffineMap::new(linear, Vector3::new(1.0, 2.0, 3.0));
            // The same samples with areas that the map has changed: as many as the weights ask for would do.
            let moved: Vec<_> = soup.points.iter().map(|p| bent.point(p)).collect();
            let moved = Shape::new(Side::Suspect, &moved, &soup.triangles).unwrap();
            let others: Vec<_> = samples(&moved, 3000).into_iter().map(Sample::with_unit_normal).collect();
            let (a, b) = (position(&some, 1.0).unwrap(), position(&others, 1.0).unwrap());
            // From one unit frame to the other.
            let frame = linear * (shape.diagonal / moved.diagonal);
            let rotation = b.linear * frame * a.linear.try_inverse().unwrap();
            let error = (rotation.transpose() * rotation - Matrix3::identity()).norm();
            assert!(error < 0.08, "{error}");
        }
    }
}
