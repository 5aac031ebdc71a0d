//! The module `bench_dragon._bus`: the crate [`bench_dragon_ipc`] for the Python package `bench_dragon`.
//!
//! It has the client of an instance, the frames that the client lends, and the errors. Structures pass as their bytes in
//! shared memory; the package has their fields. Every call that may wait lets other Python threads run, and looks for
//! signals ten times a second.

mod errors;
mod frame;
mod show;

use std::path::PathBuf;

use bench_dragon_ipc::{Domain, Instance};
use pyo3::prelude::*;

/// Returns the root path of an instance's domain and the prefix of its names in shared memory.
#[pyfunction]
fn domain(py: Python<'_>, instance: &str) -> PyResult<(PathBuf, String)> {
    let domain = Instance::new(instance).and_then(Domain::new).map_err(|error| errors::raised(py, &error.into()))?;
    Ok((domain.root().to_owned(), domain.prefix()))
}

#[pymodule]
fn _bus(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<show::Show>()?;
    module.add_class::<frame::Frame>()?;
    module.add_function(wrap_pyfunction!(domain, module)?)
}
