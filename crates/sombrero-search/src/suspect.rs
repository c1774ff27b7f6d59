//! A suspect as the search takes it.

use crate::model::Model;
use nalgebra::Point3;
use sombrero_mesh::Soup;
use sombrero_spatial::splats;

/// A surface, and what is known of its correspondence with the original.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// Points and triangles in the suspect's own coordinates.
    pub soup: Soup,
    /// Where each point of the original's [`Model`] is on the suspect, in the suspect's coordinates, or
    /// `None` for a point that is missing; the whole is `None` when no correspondence is known.
    pub correspondence: Option<Vec<Option<Point3<f64>>>>,
    /// Whether it is a point cloud, and the triangles stand for its points one by one.
    pub cloud: bool,
}

impl Suspect {
    /// Vertices and triangles as a file stores them. Their correspondence is known when there are as many vertices as
    /// in the original's file and the same triangles in the same order. Vertices without any triangle are a point cloud.
    pub fn new(stored: &Soup, model: &Model, original_triangles: &[[u32; 3]]) -> Self {
        if stored.triangles.is_empty()
            && let Some(soup) = splats(&stored.points)
        {
            return Self { soup, correspondence: None, cloud: true };
        }
        let same =
            stored.points.len() == model.point_of_stored().len() && stored.triangles == original_triangles;
        let found = || model.points_from_stored(&stored.points).into_iter().map(Some).collect();
        Self { soup: Model::new(stored).into_soup(), correspondence: same.then(found), cloud: false }
    }
}
