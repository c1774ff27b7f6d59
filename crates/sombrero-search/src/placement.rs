//! Where a suspect, or a part of it, lies on the original.

use nalgebra::{Affine3, Matrix4, Point3, Similarity3};
use sombrero_mesh::Soup;

/// A similarity, perhaps of a mirror image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placement {
    /// Of the suspect or, where it is mirrored, of its reflection.
    pub(crate) similarity: Similarity3<f64>,
    pub(crate) mirrored: bool,
}

impl Placement {
    /// The suspect where it is.
    pub(crate) fn as_it_is() -> Self {
        Self { similarity: Similarity3::identity(), mirrored: false }
    }

    /// The point in the mirror, x = 0.
    pub(crate) fn reflected(p: &Point3<f64>) -> Point3<f64> {
        Point3::new(-p.x, p.y, p.z)
    }

    /// Where a point of the suspect lies.
    pub(crate) fn of(&self, p: &Point3<f64>) -> Point3<f64> {
        if self.mirrored { self.similarity * Self::reflected(p) } else { self.similarity * p }
    }

    /// The same as a map.
    pub(crate) fn map(&self) -> Affine3<f64> {
        let similarity = Affine3::from_matrix_unchecked(self.similarity.to_homogeneous());
        if self.mirrored { similarity * reflection() } else { similarity }
    }
}

/// (x, y, z) → (-x, y, z).
pub(crate) fn reflection() -> Affine3<f64> {
    Affine3::from_matrix_unchecked(Matrix4::from_diagonal(&nalgebra::Vector4::new(-1.0, 1.0, 1.0, 1.0)))
}

/// The mirror image, the same side out.
pub(crate) fn mirror_image(soup: &Soup) -> Soup {
    let points = soup.points.iter().map(Placement::reflected).collect();
    Soup::new(points, soup.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect())
}
