//! The original, prepared once for any number of suspects.

use std::sync::OnceLock;

use nalgebra::{Point3, Similarity3};

use crate::error::{RegistrationError, Side};
use crate::landmarks::Landmarks;
use crate::lookup::Lookup;
use crate::shape::Shape;
use crate::symmetry;

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

    /// How far points lie from the surface as they are, root mean square, in model units; infinite without points or
    /// with one that is not finite.
    pub fn distance(&self, points: &[Point3<f64>]) -> f64 {
        let unit = |p: &Point3<f64>| Point3::from((p - self.shape.centre) / self.shape.diagonal);
        let points: Vec<Point3<f64>> = points.iter().map(unit).collect();
        let found = self.shape.closest_many(&points, &mut Vec::new());
        let squares: Option<Vec<f64>> = found.into_iter().map(|c| Some(c?.distance().powi(2))).collect();
        let mean = squares.filter(|s| !s.is_empty()).map(|s| s.iter().sum::<f64>() / s.len() as f64);
        mean.map_or(f64::INFINITY, |mean| mean.sqrt() * self.shape.diagonal)
    }

    /// Whoever asks first makes them. Two who ask at once both do: one that waited for the other could be what
    /// the other waits for, on a thread that both share.
    pub(crate) fn landmarks(&self) -> &Landmarks {
        match self.landmarks.get() {
            Some(landmarks) => landmarks,
            None => {
                let made = Landmarks::new(&self.shape);
                self.landmarks.get_or_init(|| made)
            }
        }
    }

    /// Likewise.
    pub(crate) fn lookup(&self) -> &Lookup {
        match self.lookup.get() {
            Some(lookup) => lookup,
            None => {
                let made = Lookup::new(&self.shape);
                self.lookup.get_or_init(|| made)
            }
        }
    }

    /// Likewise.
    pub(crate) fn symmetries(&self) -> &[Similarity3<f64>] {
        match self.symmetries.get() {
            Some(symmetries) => symmetries,
            None => {
                let made = symmetry::symmetries(&self.shape, self.lookup());
                self.symmetries.get_or_init(|| made)
            }
        }
    }
}
