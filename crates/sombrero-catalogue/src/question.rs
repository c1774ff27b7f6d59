//! A suspect, made ready to be asked about.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::describe::{Described, described};
use crate::error::ShapeError;
use crate::pieces::{Piece, pieces};

/// Landmarks of a piece.
const COUNT: usize = 100;
/// Rungs of the ladder above and below that of equal areas: sizes may differ by a factor of 1.16^4 = 1.81 either way.
pub(crate) const MORE: usize = 4;

/// A suspect's landmarks, described once for any number of catalogues. The whole asks on its own, and each part that hangs
/// together as well.
#[derive(Debug, Clone)]
pub struct Question {
    pub(crate) pieces: Vec<Described>,
    shapes: Vec<Piece>,
}

impl Question {
    /// Describes a surface: some 100 milliseconds. Vertices at equal positions count as one.
    ///
    /// # Errors
    /// [`ShapeError`] when it is no surface.
    pub fn of(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<Self, ShapeError> {
        let shapes = pieces(points, triangles)?;
        let pieces = shapes.par_iter().map(|piece| described(piece, COUNT, MORE)).collect();
        Ok(Self { pieces, shapes })
    }

    /// How many parts ask on their own; 0 when the whole hangs together.
    pub fn parts(&self) -> usize {
        self.shapes.len() - 1
    }

    /// Points and triangles of a part, by [`Candidate::part`](crate::Candidate::part): largest first.
    pub fn part(&self, index: usize) -> Option<(&[Point3<f64>], &[[u32; 3]])> {
        self.shapes.get(index.checked_add(1)?).map(|piece| (&piece.points[..], &piece.triangles[..]))
    }
}
