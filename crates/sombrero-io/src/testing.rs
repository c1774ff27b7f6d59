//! Short cuts for the tests of every format.

use nalgebra::{Point3, Vector3};

use crate::{Document, ParseError};

/// Parses what must be a mesh.
pub(crate) fn read(bytes: impl AsRef<[u8]>, extension: &str) -> Document {
    Document::parse(bytes.as_ref().to_vec(), Some(extension)).unwrap()
}

/// Parses what must not be one.
pub(crate) fn parse_error(bytes: impl AsRef<[u8]>, extension: &str) -> ParseError {
    Document::parse(bytes.as_ref().to_vec(), Some(extension)).unwrap_err()
}

/// The document with every point moved by an amount that 32-bit floats hold, and the points it should have.
pub(crate) fn moved(document: &Document) -> (Vec<u8>, Vec<Point3<f64>>) {
    let rounded = |p: &Point3<f64>| p.map(|c| f64::from(c as f32));
    let points: Vec<_> =
        document.points().iter().map(|p| rounded(&(p + Vector3::new(0.5, -1.25, 1024.0)))).collect();
    (document.with_points(&points).unwrap(), points)
}

/// The document's points, each put elsewhere.
pub(crate) fn lifted(document: &Document, to: impl Fn(&Point3<f64>) -> Point3<f64>) -> Vec<Point3<f64>> {
    document.points().iter().map(to).collect()
}
