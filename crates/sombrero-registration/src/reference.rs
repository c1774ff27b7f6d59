//! The original, prepared once for any number of suspects.

use std::sync::OnceLock;

use nalgebra::{Point3, Similarity3};

use crate::error::{RegistrationError, Side};
use crate::starts::landmarks::Landmarks;
use crate::surface::lookup::Lookup;
use crate::surface::shape::Shape;
use crate::symmetry::{self, CUBE, ICOSAHEDRON};

/// The unmarked original, prepared once for any number of suspects.
#[derive(Debug, Clone)]
pub struct Reference {
    pub(crate) shape: Shape,
    // Made when a search first asks for them.
    landmarks: OnceLock<Landmarks>,
    lookup: OnceLock<Lookup>,
    symmetries: OnceLock<Vec<Similarity3<f64>>>,
}

impl Reference {
    /// Prepares a surface: O(n log n).
    ///
    /// Vertices that no triangle uses count for nothing.
    ///
    /// # Errors
    /// [`RegistrationError`] when there is no surface with a shape: no triangles, no area, all in one
    /// plane, a coordinate that is not finite, a corner that does not exist.
    pub fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<Self, RegistrationError> {
        let shape = Shape::new(Side::Reference, points, triangles)?;
        let (landmarks, lookup, symmetries) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        Ok(Self { shape, landmarks, lookup, symmetries })
    }

    /// Diagonal of the bounding box, in model units: the length that options are relative to.
    pub fn diagonal(&self) -> f64 {
        self.shape.diagonal
    }

    /// Root mean square distance of points from the surface, as they are, in model units; infinite without points or
    /// with one that is not finite.
    pub fn distance(&self, points: &[Point3<f64>]) -> f64 {
        let unit = |p: &Point3<f64>| Point3::from((p - self.shape.centre) / self.shape.diagonal);
        let points: Vec<Point3<f64>> = points.iter().map(unit).collect();
        let found = self.shape.closest_many(&points, &mut Vec::new());
        let squares: Option<Vec<f64>> = found.into_iter().map(|c| Some(c?.distance().powi(2))).collect();
        let mean = squares.filter(|s| !s.is_empty()).map(|s| s.iter().sum::<f64>() / s.len() as f64);
        mean.map_or(f64::INFINITY, |mean| mean.sqrt() * self.shape.diagonal)
    }

    /// Whether the surface goes onto itself in endlessly many ways, as balls and bodies of revolution do: in more than a cube,
    /// and not as an icosahedron. By a look at all rotations about its centroid.
    pub fn is_endless(&self) -> bool {
        // The identity is none of the symmetries.
        let rotations = self.symmetries().len() + 1;
        rotations > CUBE && rotations != ICOSAHEDRON
    }

    /// The landmarks of the surface, made when they are first asked for.
    pub(crate) fn landmarks(&self) -> &Landmarks {
        made_once(&self.landmarks, || Landmarks::new(&self.shape))
    }

    /// The table of nearest samples, made when it is first asked for.
    pub(crate) fn lookup(&self) -> &Lookup {
        made_once(&self.lookup, || Lookup::new(&self.shape))
    }

    /// The rotations that take the surface to itself, made when they are first asked for.
    pub(crate) fn symmetries(&self) -> &[Similarity3<f64>] {
        made_once::<Vec<_>>(&self.symmetries, || symmetry::symmetries(&self.shape, self.lookup()))
    }
}

/// What `cell` holds, made by `make` where it is empty. Two callers at once both make it: one that waited for the other
/// could be what the other waits for, on a thread that both share.
fn made_once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    match cell.get() {
        Some(value) => value,
        None => {
            let made = make();
            cell.get_or_init(|| made)
        }
    }
}
