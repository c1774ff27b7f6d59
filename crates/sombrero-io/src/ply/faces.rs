//! The rows of `face` and `tristrips`.

use super::body::{self, Body};
use super::element::{Element, Kind, is_corners};
use super::scalar::Scalar;
use crate::error::ParseError;
use crate::polygon::{self, Faces};

/// What a list of indices draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Polygon,
    /// Several strips with -1 between them.
    Strip,
}

/// Reads all rows and appends their triangles. Their claim was checked.
pub(super) fn read<'a, B: Body<'a>>(
    body: &mut B,
    element: &Element,
    vertices: usize,
    shape: Shape,
    faces: &mut Faces,
) -> Result<(), ParseError> {
    let Some(list) = element.properties.iter().position(is_corners) else {
        // The header allows this only where there are no rows.
        return body::skip_rows(body, element);
    };
    // Most faces are triangles, but a claim of many may also be of empty ones.
    faces.triangles.reserve(element.count.min((body.bytes().len() - body.at()) / 6));
    let mut corners = Vec::new();
    for index in 0..element.count {
        for (i, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List { count, item } if i == list => {
                    let size = body::length(body, count, element, index)?;
                    let row = Row { element, index, vertices, shape };
                    row.read(body, size, item, &mut corners, faces)?;
                }
                kind => body::skip(body, kind, element, index)?,
            }
        }
        body.end_row();
    }
    Ok(())
}

struct Row<'a> {
    element: &'a Element,
    index: usize,
    vertices: usize,
    shape: Shape,
}

impl Row<'_> {
    fn read<'a, B: Body<'a>>(
        &self,
        body: &mut B,
        size: u64,
        item: Scalar,
        corners: &mut Vec<u32>,
        faces: &mut Faces,
    ) -> Result<(), ParseError> {
        corners.clear();
        for _ in 0..size {
            let corner = body::whole(body, item, self.element, self.index)?;
            match u32::try_from(corner) {
                Ok(corner) if (corner as usize) < self.vertices => corners.push(corner),
                _ if corner == -1 && self.shape == Shape::Strip => {
                    polygon::strip(corners, &mut faces.triangles);
                    corners.clear();
                }
                _ => return Err(self.out_of_range(body, corner)),
            }
        }
        match self.shape {
            Shape::Polygon => faces.push(corners),
            Shape::Strip => polygon::strip(corners, &mut faces.triangles),
        }
        Ok(())
    }

    fn out_of_range<'a, B: Body<'a>>(&self, body: &B, index: i64) -> ParseError {
        let place = body.place(&self.element.name, self.index, body.at()..body.at());
        ParseError::IndexOutOfRange { place, index, first: 0, count: self.vertices }
    }
}
