//! What a file tells of its vertices beside their positions: where else they are shown, and how finely they are stored.

use nalgebra::{Matrix3, Point3, Vector3};
use std::ops::Range;

/// Further places of vertices, and the grid that each stands on. Of a bare mesh all is empty.
///
/// ```
/// use nalgebra::{Matrix3, Point3, Vector3};
/// use sombrero_mesh::{Place, Scene};
///
/// // Vertices 0 to 3 are shown a second time, one unit to the right.
/// let copy = Place { vertices: 0..4, linear: Matrix3::identity(), shift: Vector3::x() };
/// assert_eq!(copy.at(&Point3::new(0.5, 1.0, 0.0)), Point3::new(1.5, 1.0, 0.0));
/// let scene = Scene { places: vec![copy], ..Scene::default() };
/// assert!(scene.steps.is_empty());
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Where some of the vertices are shown once more. Where they are shown first, their positions say.
    pub places: Vec<Place>,
    /// For each vertex the largest distance between neighbouring numbers that its coordinates could have been, in model
    /// units; empty where numbers are so fine that this does not matter.
    pub steps: Vec<f32>,
    /// Whether points or lines are drawn, of vertices that may have no face. Otherwise nothing shows such vertices.
    pub draws_loose: bool,
}

/// A further place of some vertices: an affine map of the position where they are shown first.
///
/// ```text
/// place = linear · position + shift
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The vertices, by number.
    pub vertices: Range<u32>,
    /// What becomes of directions.
    pub linear: Matrix3<f64>,
    /// Where the origin goes, in model units.
    pub shift: Vector3<f64>,
}

impl Place {
    /// Where a vertex at `position` is shown here.
    pub fn at(&self, position: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.linear * position.coords + self.shift)
    }
}
