//! The command, called from Python.

use crate::error::of_failure;
use crate::mesh::{self, Arrays};
use crate::work;
use numpy::PyUntypedArray;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::Value;
use sombrero::io::Soup;
use sombrero_cli::Desk;
use std::collections::BTreeMap;
use std::ffi::OsString;

/// Runs the command as a shell does: `arguments` with its name first, to standard output and error. Gives the exit status.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| sombrero_cli::status(arguments))
}

/// Arrays of a mesh: vertices and faces.
pub(crate) type Given<'py> = (Bound<'py, PyUntypedArray>, Bound<'py, PyUntypedArray>);

/// What is in memory, by the names that arguments have for it.
pub(crate) fn desk(
    meshes: &BTreeMap<String, Given<'_>>,
    files: BTreeMap<String, Vec<u8>>,
) -> PyResult<impl FnOnce() -> Result<Desk, (String, String)> + Send + use<>> {
    let mut soups: Vec<(String, Soup)> = Vec::with_capacity(meshes.len());
    for (name, (vertices, faces)) in meshes {
        soups.push((name.clone(), mesh::soup(vertices, faces, name)?));
    }
    // The files are made where no interpreter waits for them.
    Ok(move || {
        let mut desk = Desk::default();
        for (name, soup) in soups {
            let file = mesh::file(&soup).map_err(|message| (name.clone(), message))?;
            desk = desk.with_file(name, file);
        }
        Ok(files.into_iter().fold(desk, |desk, (name, content)| desk.with_file(name, content)))
    })
}

/// What was written to memory: meshes as arrays, other files as they are.
type Written<'py> = (BTreeMap<String, Arrays<'py>>, BTreeMap<String, Bound<'py, PyBytes>>);

/// The command's answers to `arguments` (without its name), as a JSON list, and what it wrote to memory.
#[pyfunction]
#[pyo3(signature = (arguments, meshes, files, out_meshes, out_files, threads, progress))]
#[expect(clippy::too_many_arguments, reason = "called from one place, in Python, by name")]
pub(crate) fn answers<'py>(
    py: Python<'py>,
    arguments: Vec<OsString>,
    meshes: BTreeMap<String, Given<'py>>,
    files: BTreeMap<String, Vec<u8>>,
    out_meshes: Vec<String>,
    out_files: Vec<String>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, Written<'py>)> {
    let desk = desk(&meshes, files)?;
    let outputs: Vec<String> = out_meshes.iter().chain(&out_files).cloned().collect();
    let done = work::run(py, threads, progress, move || {
        let desk = outputs.into_iter().fold(desk()?, Desk::with_output);
        Ok((sombrero_cli::answers(arguments, &desk), desk))
    })?;
    let (answered, desk) = done.map_err(|(name, message)| mesh::wrong(py, &name, &message))?;
    let json = Value::Array(answered.map_err(|failure| of_failure(py, &failure))?).to_string();
    let (mut written_meshes, mut written_files) = Written::default();
    for name in out_meshes {
        if let Some(content) = desk.take(&name) {
            written_meshes.insert(name, mesh::arrays(py, content)?);
        }
    }
    for name in out_files {
        if let Some(content) = desk.take(&name) {
            written_files.insert(name, PyBytes::new(py, &content));
        }
    }
    Ok((json, (written_meshes, written_files)))
}
