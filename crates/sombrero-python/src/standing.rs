//! What is read once for any number of suspects.

use crate::call::{Given, desk};
use crate::error::of_failure;
use crate::mesh;
use crate::work;
use pyo3::prelude::*;
use sombrero_cli::{Desk, Detecting, Failure, Searching};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

/// A command that stands ready: `detect` with original and key in memory, or `search` with its catalogue open. Any number of
/// threads may ask at once.
#[pyclass(frozen, module = "sombrero._native")]
pub(crate) struct Standing(Kind);

enum Kind {
    Detect(Box<Detecting>),
    Search(Box<Searching>),
}

impl Kind {
    fn new(arguments: Vec<OsString>, desk: &Desk) -> Result<Self, Failure> {
        let (command, rest) = arguments.split_first().map_or((None, &[][..]), |(c, rest)| (c.to_str(), rest));
        let rest = rest.iter().cloned();
        match command {
            Some("search") => Ok(Self::Search(Box::new(Searching::new(rest, desk)?))),
            _ => Ok(Self::Detect(Box::new(Detecting::new(rest, desk)?))),
        }
    }
}

#[pymethods]
impl Standing {
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
        let made = work::run(py, threads, progress, move || Ok(Kind::new(arguments, &desk()?)))?;
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
            let (suspect, page, desk) = (Path::new(&suspect), report.as_deref().map(Path::new), desk()?);
            Ok(match &self.0 {
                Kind::Detect(detecting) => detecting.look(suspect, page, &desk),
                Kind::Search(searching) => searching.look(suspect, page, &desk),
            })
        })?;
        let looked = looked.map_err(|(name, message): (String, String)| mesh::wrong(py, &name, &message))?;
        Ok(looked.map_err(|failure| of_failure(py, &failure))?.to_string())
    }
}
