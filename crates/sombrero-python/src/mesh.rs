//! Arrays as the file that they stand for: binary PLY with coordinates of 64 bits, vertices and triangles in their order.

use crate::error::of_kind;
use numpy::{Element, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sombrero::io::{Document, Format, Limits, Soup, encode};
use sombrero::nalgebra::Point3;

/// The file that arrays stand for; `what` they are is said in errors.
#[pyfunction]
pub(crate) fn ply<'py>(
    py: Python<'py>,
    vertices: &Bound<'py, PyUntypedArray>,
    faces: &Bound<'py, PyUntypedArray>,
    what: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let soup = soup(vertices, faces, what)?;
    let bytes = py.detach(|| file(&soup)).map_err(|message| wrong(py, what, &message))?;
    Ok(PyBytes::new(py, &bytes))
}

/// Vertices and triangles, copied once.
pub(crate) fn soup(
    vertices: &Bound<'_, PyUntypedArray>,
    faces: &Bound<'_, PyUntypedArray>,
    what: &str,
) -> PyResult<Soup> {
    let py = vertices.py();
    let points = rows::<f64, _>(vertices, Point3::from)?;
    let points = match points {
        Some(points) => points,
        None => rows::<f32, _>(vertices, |row| Point3::from(row.map(f64::from)))?
            .ok_or_else(|| wrong(py, what, &shape("vertices", "float64 or float32", vertices)))?,
    };
    let triangles = [triangles::<i64>, triangles::<i32>, triangles::<u32>, triangles::<u64>];
    for read in triangles {
        if let Some(triangles) = read(faces)? {
            let negative = || {
                wrong(
                    py,
                    what,
                    "faces holds a negative index, or one that no mesh has; number vertices from 0",
                )
            };
            return Ok(Soup::new(points, triangles.into_iter().collect::<Option<_>>().ok_or_else(negative)?));
        }
    }
    Err(wrong(py, what, &shape("faces", "int64, int32, uint64 or uint32", faces)))
}

/// What is wrong with an array.
fn shape(name: &str, types: &str, array: &Bound<'_, PyUntypedArray>) -> String {
    let last = if name == "faces" {
        "(m, 3), one row of vertex numbers a triangle"
    } else {
        "(n, 3), one row a vertex"
    };
    format!(
        "{name} has shape {:?} and type {}; give an array of shape {last}, and type {types}",
        array.shape(),
        array.dtype().str().map_or_else(|_| "unknown".to_owned(), |name| name.to_string())
    )
}

/// The rows of an array of three columns, read where they lie; `None` if it is of another type or shape.
fn rows<T: Element + Copy, R>(
    array: &Bound<'_, PyUntypedArray>,
    row: impl Fn([T; 3]) -> R,
) -> PyResult<Option<Vec<R>>> {
    let Ok(array) = array.cast::<PyArray2<T>>() else { return Ok(None) };
    if array.shape()[1] != 3 {
        return Ok(None);
    }
    let array: PyReadonlyArray2<'_, T> = array.try_readonly()?;
    let view = array.as_array();
    Ok(Some(view.rows().into_iter().map(|r| row([r[0], r[1], r[2]])).collect()))
}

/// The triangles; `None` in the place of one with an index that no mesh has.
fn triangles<T: Element + Copy + TryInto<u32>>(
    array: &Bound<'_, PyUntypedArray>,
) -> PyResult<Option<Vec<Option<[u32; 3]>>>> {
    rows::<T, _>(array, |row| {
        let [a, b, c] = row.map(|index| index.try_into().ok());
        Some([a?, b?, c?])
    })
}

/// The content of the file.
pub(crate) fn file(soup: &Soup) -> Result<Vec<u8>, String> {
    encode(Format::PlyBinaryLittleEndian, soup).map_err(|error| error.to_string())
}

pub(crate) fn wrong(py: Python<'_>, what: &str, message: &str) -> PyErr {
    of_kind(py, "mesh", &format!("{what}: {message}"))
}

/// Vertices `(n, 3)` and triangles `(m, 3)` of such a file.
pub(crate) type Arrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<i64>>);

/// The arrays that a file holds.
pub(crate) fn arrays<'py>(py: Python<'py>, bytes: Vec<u8>) -> PyResult<Arrays<'py>> {
    let read = py.detach(|| Document::parse_within(bytes, None, Limits::unlimited()));
    let document = read.map_err(|error| of_kind(py, "internal", &error.to_string()))?;
    let points: Vec<[f64; 3]> = document.points().iter().map(|p| [p.x, p.y, p.z]).collect();
    let triangles: Vec<[i64; 3]> = document.triangles().iter().map(|t| t.map(i64::from)).collect();
    Ok((table(py, &points)?, table(py, &triangles)?))
}

/// An array of these rows.
fn table<'py, T: Element + Copy>(py: Python<'py>, rows: &[[T; 3]]) -> PyResult<Bound<'py, PyArray2<T>>> {
    numpy::PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), 3])
}
