//! An original and a key, read once for any number of suspects.

use crate::call::{Given, desk};
use crate::error::of_failure;
use crate::mesh;
use crate::work;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

/// `sombrero detect` with original and key in memory. Any number of threads may look at once.
#[pyclass(frozen, module = "sombrero._native")]
pub(crate) struct Detecting(sombrero_cli::Detecting);

#[pymethods]
impl Detecting {
    #[new]
    #[pyo3(signature = (arguments, meshes, files, threads, progress))]
    fn new(
        py: Python<'_>,
        arguments: Vec<OsString>,
        meshes: BTreeMap<String, Given<'_>>,
        files: BTreeMap<String, Vec<u8>>,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let desk = desk(&meshes, files)?;
        let made =
            work::run(py, threads, progress, move || Ok(sombrero_cli::Detecting::new(arguments, &desk()?)))?;
        let made = made.map_err(|(name, message): (String, String)| mesh::wrong(py, &name, &message))?;
        Ok(Self(made.map_err(|failure| of_failure(py, &failure))?))
    }

    /// The answer about one suspect, as JSON.
    #[pyo3(signature = (suspect, meshes, report, threads, progress))]
    fn look(
        &self,
        py: Python<'_>,
        suspect: OsString,
        meshes: BTreeMap<String, Given<'_>>,
        report: Option<OsString>,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        let desk = desk(&meshes, BTreeMap::new())?;
        let looked = work::run(py, threads, progress, move || {
            Ok(self.0.look(Path::new(&suspect), report.as_deref().map(Path::new), &desk()?))
        })?;
        let looked = looked.map_err(|(name, message): (String, String)| mesh::wrong(py, &name, &message))?;
        Ok(looked.map_err(|failure| of_failure(py, &failure))?.to_string())
    }
}
