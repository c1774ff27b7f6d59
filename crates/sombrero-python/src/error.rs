//! Failures as Python's exceptions, whose classes are defined in Python.

use pyo3::prelude::*;
use sombrero_cli::Failure;

/// The exception for a failure of this kind; see [`Failure::kind`].
pub(crate) fn of_kind(py: Python<'_>, kind: &str, message: &str) -> PyErr {
    let made = || {
        let class = py.import("sombrero._errors")?.getattr("of_kind")?;
        class.call1((kind, message))
    };
    made().map_or_else(|error| error, PyErr::from_value)
}

pub(crate) fn of_failure(py: Python<'_>, failure: &Failure) -> PyErr {
    of_kind(py, failure.kind(), failure.message())
}
