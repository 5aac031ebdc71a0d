//! The errors of the bus as exceptions of `bench_dragon.errors`.

use bench_dragon_ipc::{BusError, CommandReply};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Returns the exception for an error.
pub(crate) fn raised(py: Python<'_>, error: &BusError) -> PyErr {
    let text = error.to_string();
    let class = match error {
        BusError::Refused { reply, .. } => return refused(py, text, reply),
        BusError::Closed { .. } | BusError::Inherited { .. } | BusError::InvalidName { .. } => {
            return PyValueError::new_err(text);
        }
        BusError::NoServer { .. } => "NoServer",
        BusError::NoAnswer { .. } => "NoAnswer",
        BusError::HalfMade { .. } => "HalfMade",
        BusError::Domain(_) => "DomainError",
        BusError::PermissionDenied { .. } => "PermissionDenied",
        BusError::VersionMismatch { .. } => "VersionMismatch",
        BusError::TooManyClients { .. } => "TooManyClients",
        BusError::TooManyFrames => "TooManyFramesHeld",
        BusError::SharedMemoryFull { .. } | BusError::SharedMemoryUnusable { .. } | BusError::TooFewFiles { .. } => {
            "OutOfResources"
        }
        _ => "BusError",
    };
    named(py, class).and_then(|class| class.call1((text,))).map_or_else(|error| error, PyErr::from_value)
}

/// Returns the exception for a refused command.
fn refused(py: Python<'_>, text: String, reply: &CommandReply) -> PyErr {
    let values = (text, reply.refusal, reply.run_id, reply.tick, reply.lowest, reply.highest);
    named(py, "Refused").and_then(|class| class.call1(values)).map_or_else(|error| error, PyErr::from_value)
}

/// Returns the class with this name.
fn named<'py>(py: Python<'py>, class: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("bench_dragon.errors")?.getattr(class)
}
