//! What a reader gives: the geometry of a file, and a layout that knows where in the file it stands.

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::Point3;
use sombrero_mesh::{Place, Soup};

use crate::attributes::Attributes;
use crate::decimals::{Decimals, Filling, Words};
use crate::error::{ParseError, Place as Spot, WriteError};
use crate::format::Format;
use crate::polygon::Polygon;

/// What a reader finds in a file.
#[derive(Debug, Clone)]
pub(crate) struct Parsed {
    pub(crate) format: Format,
    /// Polygons split as fans; coordinates need not be finite.
    pub(crate) soup: Soup,
    /// Which triangles are of one polygon, in order.
    pub(crate) polygons: Vec<Polygon>,
    /// Vertices that stand nowhere, in order; no reader fills this in.
    pub(crate) unplaced: Vec<u32>,
    pub(crate) attributes: Vec<String>,
    pub(crate) layout: Arc<dyn Layout>,
    /// Triangles that further instances of a mesh add to those of `soup`.
    pub(crate) repeated_triangles: u64,
    /// Further places of vertices, as many as are worth following.
    pub(crate) places: Vec<Place>,
    /// Whether points or lines are drawn.
    pub(crate) draws_loose: bool,
    /// What is unusual, in sentences.
    pub(crate) notes: Vec<String>,
    /// Why positions cannot move, if they cannot.
    pub(crate) fixed: Option<String>,
    /// The files that this one refers to: those that hold geometry, in the order of mention, then others.
    pub(crate) companions: Vec<Companion>,
}

impl Parsed {
    /// A file of one part in which nothing is unusual.
    pub(crate) fn new(
        format: Format,
        soup: Soup,
        attributes: Attributes,
        layout: impl Layout + 'static,
    ) -> Self {
        Self {
            format,
            soup,
            polygons: Vec::new(),
            unplaced: Vec::new(),
            attributes: attributes.into_names(),
            layout: Arc::new(layout),
            repeated_triangles: 0,
            places: Vec::new(),
            draws_loose: false,
            notes: Vec::new(),
            fixed: None,
            companions: Vec::new(),
        }
    }
}

/// Where a file's positions stand, in the terms of its format.
pub(crate) trait Layout: Debug + Send + Sync {
    /// The file with other positions, one for each point of the original, all finite.
    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        how: &Rewrite,
    ) -> Result<Rewritten, WriteError>;

    /// What is wrong with a vertex whose coordinates are no finite numbers, in the file that was read.
    fn misplaced(&self, _bytes: &[u8], vertex: usize) -> ParseError {
        ParseError::NonFinite { place: Spot::Element { name: "vertex".into(), index: vertex } }
    }

    /// The distance between neighbouring numbers where each vertex stands, in model units; empty where it is small.
    fn steps(&self, _soup: &Soup) -> Vec<f32> {
        Vec::new()
    }

    /// Where the numbers of a text file stand that positions decide; `None` for another file, and for one that is more
    /// than one text.
    fn words(&self, _original: &Original<'_>) -> Option<Words> {
        None
    }

    /// The file with its stored normals turned as the faces turn that go to `points`; positions stay.
    ///
    /// `None` where there are no normals, and for a format that turns them together with positions.
    fn turn_normals(
        &self,
        _original: &Original<'_>,
        _points: &[Point3<f64>],
    ) -> Result<Option<Vec<u8>>, WriteError> {
        Ok(None)
    }
}

/// A file as it was read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Original<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) soup: &'a Soup,
    pub(crate) companions: &'a [Companion],
}

/// A file that belongs to another one: a buffer that a glTF keeps beside itself.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Companion {
    /// Its name, relative to the folder of the file it belongs to.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
    /// Whether positions, normals or indices of meshes that are shown stand in it.
    pub holds_geometry: bool,
}

/// How a document with other positions is written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Rewrite {
    /// Turn stored normals (and tangents) as the faces around them turned. Default: they are data and stay.
    pub renew_normals: bool,
    /// The name (without extension) that the file will have. Buffers that a glTF keeps in files beside itself
    /// then are such files again, named after this. Default: none, so all is in one file.
    pub stem: Option<String>,
    /// How the coordinates of a text file are spelled. Default: exactly, and only those that changed.
    pub decimals: Decimals,
    /// What numbers are filled up with that stay and have fewer decimals than the file is written with. Default: zeros.
    pub filling: Option<Filling>,
}

impl Rewrite {
    /// These choices with normals and tangents turned, or not.
    pub fn with_renewed_normals(self, renew_normals: bool) -> Self {
        Self { renew_normals, ..self }
    }

    /// These choices with coordinates of text files spelled so.
    pub fn with_decimals(self, decimals: Decimals) -> Self {
        Self { decimals, ..self }
    }

    /// These choices with digits instead of zeros at the end of numbers that stay.
    pub fn with_filling(self, filling: Filling) -> Self {
        Self { filling: Some(filling), ..self }
    }

    /// These choices for a file of this name, without extension.
    pub fn with_stem(self, stem: impl Into<String>) -> Self {
        Self { stem: Some(stem.into()), ..self }
    }
}

/// A document with other positions, to be written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Rewritten {
    /// The file.
    pub bytes: Vec<u8>,
    /// The files that belong beside it. Only a glTF with [`Rewrite::stem`] has any.
    pub companions: Vec<Companion>,
}

impl From<Vec<u8>> for Rewritten {
    fn from(bytes: Vec<u8>) -> Self {
        Self { bytes, companions: Vec::new() }
    }
}
