//! A suspect, made ready to be asked about.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::{Facets, Soup};
use sombrero_spatial::Surface;

use crate::describe::{Described, described};
use crate::error::ShapeError;
use crate::pieces::{Piece, pieces};

/// Landmarks of a piece.
const COUNT: usize = 128;
/// Rungs of the ladder above and below that of equal areas: sizes may differ by a factor of 1.16^3 = 1.56 either way.
pub(crate) const MORE: usize = 3;

/// A suspect's landmarks, described once for any number of catalogues. The whole asks on its own, and each part that hangs
/// together as well.
#[derive(Debug, Clone)]
pub struct Question {
    pub(crate) pieces: Vec<Asked>,
}

/// A piece of a suspect.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    pub(crate) described: Described,
    /// In the unit of the description.
    pub(crate) surface: Surface,
    /// Of its faces.
    pub(crate) normals: Vec<Vector3<f64>>,
    /// Of the whole suspect's area.
    pub(crate) share: f64,
    piece: Piece,
}

impl Question {
    /// Describes a surface: some 100 milliseconds. Vertices at equal positions count as one.
    ///
    /// # Errors
    /// [`ShapeError`] when it is no surface.
    pub fn of(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<Self, ShapeError> {
        let pieces = pieces(points, triangles)?;
        let whole = pieces.first().map_or(1.0, |piece| piece.size);
        let asked = |piece: Piece| {
            let share = (piece.size / whole).powi(2);
            let described = described(&piece, COUNT, MORE);
            let unit = |p: &Point3<f64>| Point3::from((p - described.centroid) / described.size);
            let points: Vec<_> = piece.points.iter().map(unit).collect();
            let normals = Facets::new(&points, &piece.triangles).normals;
            Asked { surface: Surface::new(&points, &piece.triangles), normals, share, described, piece }
        };
        Ok(Self { pieces: pieces.into_par_iter().map(asked).collect() })
    }

    /// How many parts ask on their own; 0 when the whole hangs together.
    pub fn parts(&self) -> usize {
        self.pieces.len() - 1
    }

    /// A part of the suspect by its number in [`Candidate::part`](crate::Candidate::part): largest first.
    pub fn part(&self, index: usize) -> Option<Soup> {
        let piece = &self.pieces.get(index.checked_add(1)?)?.piece;
        Some(Soup::new(piece.points.clone(), piece.triangles.clone()))
    }
}
