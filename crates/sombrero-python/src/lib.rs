//! What the Python package `sombrero` cannot do in Python: call the command with files in memory, on threads of its own, and
//! tell how far it is. How it looks from Python is written in Python, in the folder `python`.

mod call;

mod error;
mod mesh;
mod standing;
mod work;

use pyo3::prelude::*;

/// The compiled part of sombrero.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(call::main, module)?)?;
    module.add_function(wrap_pyfunction!(call::answers, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::ply, module)?)?;
    module.add_class::<standing::Standing>()
}
