//! A suspect as detection takes it.

use crate::Model;
use nalgebra::Point3;
use sombrero_io::Document;
use sombrero_mesh::Soup;

/// A surface, and what is known of its correspondence with the original.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// Points and triangles in the suspect's own coordinates.
    pub soup: Soup,
    /// Where each point of the original's [`Model`] is on the suspect, in the suspect's coordinates, or
    /// `None` for a point that is missing; the whole is `None` when no correspondence is known.
    pub correspondence: Option<Vec<Option<Point3<f64>>>>,
}

impl Suspect {
    /// A file. Its correspondence is known when it has as many vertices as the original and the same
    /// triangles in the same order.
    pub fn new(file: &Document, model: &Model, original_triangles: &[[u32; 3]]) -> Self {
        let same =
            file.points().len() == model.point_of_stored().len() && file.triangles() == original_triangles;
        let found = || model.points_from_stored(file.points()).into_iter().map(Some).collect();
        Self { soup: Model::new(&file.soup()).into_soup(), correspondence: same.then(found) }
    }
}
