//! The rows of the element `vertex`: reading positions and putting others in their place.

use nalgebra::{Point3, Vector3};

use super::body::{self, Body};
use super::element::{AXES, Axes, Element, Kind, NORMAL, Property};
use super::scalar::Scalar;
use crate::coordinate;
use crate::decimals::Words;
use crate::error::{ParseError, WriteError};
use crate::splice::Splice;
use crate::text;

/// The coordinate that a property is, and its type.
fn axis(axes: Axes, property: &Property) -> Option<(usize, Scalar)> {
    let axis = axes.iter().position(|name| *name == property.name)?;
    match property.kind {
        Kind::One(scalar) => Some((axis, scalar)),
        Kind::List { .. } => None,
    }
}

/// Whether positions are of a type that cannot take others.
pub(super) fn is_fixed(element: &Element) -> bool {
    element.properties.iter().filter_map(|p| axis(AXES, p)).any(|(_, scalar)| !scalar.is_float())
}

/// Where the rows begin.
#[derive(Debug, Clone)]
pub(super) enum Rows {
    /// They all have the same size, so the first says it all.
    Even { start: usize, size: usize },
    /// One byte offset for each row.
    Each(Vec<usize>),
}

impl Default for Rows {
    fn default() -> Self {
        Self::Each(Vec::new())
    }
}

impl Rows {
    fn start(&self, row: usize) -> Option<usize> {
        match self {
            Self::Even { start, size } => Some(start + row * size),
            Self::Each(starts) => starts.get(row).copied(),
        }
    }
}

/// Reads all rows. Their claim was checked.
pub(super) fn read<'a, B: Body<'a>>(
    body: &mut B,
    element: &Element,
) -> Result<(Vec<Point3<f64>>, Rows), ParseError> {
    let even = B::row_size(element).map(|size| Rows::Even { start: body.at(), size });
    let mut starts = Vec::with_capacity(if even.is_some() { 0 } else { element.count });
    let mut points = Vec::with_capacity(element.count);
    let plan: Vec<_> = element.properties.iter().map(|p| (p.kind, axis(AXES, p))).collect();
    for index in 0..element.count {
        if even.is_none() {
            starts.push(body.at());
        }
        points.push(position(body, element, &plan, index)?);
        body.end_row();
    }
    Ok((points, even.unwrap_or(Rows::Each(starts))))
}

fn position<'a, B: Body<'a>>(
    body: &mut B,
    element: &Element,
    plan: &[(Kind, Option<(usize, Scalar)>)],
    index: usize,
) -> Result<Point3<f64>, ParseError> {
    let mut point = Point3::origin();
    for &(kind, axis) in plan {
        match axis {
            Some((axis, scalar)) => point[axis] = coordinate(body, scalar, element, index)?,
            None => body::skip(body, kind, element, index)?,
        }
    }
    Ok(point)
}

fn coordinate<'a, B: Body<'a>>(
    body: &mut B,
    scalar: Scalar,
    element: &Element,
    index: usize,
) -> Result<f64, ParseError> {
    let span = body::pass(body, scalar, element, index)?;
    Ok(body.value(scalar, span).unwrap_or(f64::NAN))
}

/// What is wrong with a vertex of which a coordinate is no finite number.
pub(super) fn misplaced<'a, B: Body<'a>>(
    mut body: B,
    element: &Element,
    rows: &Rows,
    vertex: usize,
) -> ParseError {
    body.seek(rows.start(vertex).unwrap_or_default());
    for property in &element.properties {
        let Some((_, scalar)) = axis(AXES, property) else {
            if body::skip(&mut body, property.kind, element, vertex).is_err() {
                break;
            }
            continue;
        };
        let Some(span) = body.pass(scalar) else { break };
        match body.value(scalar, span.clone()) {
            Some(value) if value.is_finite() => {}
            Some(_) => break,
            None => return text::misplaced(body.bytes(), [span]),
        }
    }
    ParseError::NonFinite { place: body.place(&element.name, vertex, body.at()..body.at()) }
}

/// The normals of all rows; `None` if they are not stored as three floats each.
pub(super) fn normals<'a, B: Body<'a>>(
    mut body: B,
    element: &Element,
    rows: &Rows,
) -> Option<Vec<Vector3<f64>>> {
    let plan: Vec<_> = element.properties.iter().map(|p| (p.kind, axis(NORMAL, p))).collect();
    let floats =
        |a: usize| plan.iter().filter(|(_, p)| p.is_some_and(|(b, s)| a == b && s.is_float())).count();
    if (0..3).any(|a| floats(a) != 1) {
        return None;
    }
    let normal = |row| {
        body.seek(rows.start(row)?);
        position(&mut body, element, &plan, row).ok().filter(coordinate::is_finite).map(|p| p.coords)
    };
    (0..element.count).map(normal).collect()
}

/// What `body` walks, with new coordinates in the place of those that changed.
pub(super) fn rewrite<'a, B: Body<'a>>(
    mut body: B,
    element: &Element,
    axes: Axes,
    rows: &Rows,
    old: &[Point3<f64>],
    new: &[Point3<f64>],
) -> Result<Vec<u8>, WriteError> {
    let source = body.bytes();
    let mut splice = Splice::new(source);
    for (row, (old, new)) in old.iter().zip(new).enumerate() {
        if text::same(old, new) {
            continue;
        }
        if let Some(start) = rows.start(row) {
            body.seek(start);
            rewrite_row(&mut body, element, axes, &mut splice, row, (old, new))?;
        }
    }
    Ok(splice.finish())
}

/// Where the coordinates stand.
pub(super) fn words<'a, B: Body<'a>>(mut body: B, element: &Element, rows: &Rows) -> Words {
    let mut coordinates = Vec::with_capacity(3 * element.count);
    for row in 0..element.count {
        let Some(start) = rows.start(row) else { continue };
        body.seek(start);
        let (first, mut is_placed) = (coordinates.len(), true);
        for property in &element.properties {
            match axis(AXES, property) {
                Some((_, scalar)) => {
                    let span = body.pass(scalar);
                    let value = span.clone().and_then(|span| body.value(scalar, span));
                    is_placed &= value.is_some_and(f64::is_finite);
                    coordinates.extend(span);
                }
                None if body::skip(&mut body, property.kind, element, row).is_err() => break,
                None => {}
            }
        }
        if !is_placed {
            // The numbers of what has no position stay as they are.
            coordinates.truncate(first);
        }
    }
    Words { coordinates, ..Words::default() }
}

fn rewrite_row<'a, B: Body<'a>>(
    body: &mut B,
    element: &Element,
    axes: Axes,
    splice: &mut Splice<'_>,
    row: usize,
    (old, new): (&Point3<f64>, &Point3<f64>),
) -> Result<(), WriteError> {
    let mut left = axes.len();
    for property in &element.properties {
        let Some((axis, scalar)) = axis(axes, property) else {
            // The row was read before, so this cannot fail; if it did, the coordinates would only stay.
            if body::skip(body, property.kind, element, row).is_err() {
                break;
            }
            continue;
        };
        if let Some(span) = body.pass(scalar)
            && old[axis].to_bits() != new[axis].to_bits()
        {
            check(scalar, axes[axis], row, new[axis])?;
            splice.replace(span, |out| body.push(scalar, new[axis], out));
        }
        left -= 1;
        if left == 0 {
            break;
        }
    }
    Ok(())
}

/// Whether the property's type can take `value`. Text is held to its declared type too: readers go by it.
fn check(scalar: Scalar, property: &'static str, vertex: usize, value: f64) -> Result<(), WriteError> {
    match scalar {
        Scalar::F64 => Ok(()),
        Scalar::F32 => coordinate::narrow(vertex, value).map(drop),
        _ => Err(WriteError::IntegerCoordinates { vertex, property }),
    }
}
