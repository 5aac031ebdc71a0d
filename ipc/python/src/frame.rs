//! A frame that stays in shared memory.

use bench_dragon_ipc::{Continuity, HandleState, IntoBytes as _, LentFrame};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

/// The owner of a frame. numpy arrays over its handles keep a reference to it, and so keep the frame held.
#[pyclass(frozen, module = "bench_dragon._bus")]
#[derive(Debug)]
pub(crate) struct Frame {
    lent: LentFrame,
}

impl From<LentFrame> for Frame {
    fn from(lent: LentFrame) -> Self {
        Self { lent }
    }
}

#[pymethods]
impl Frame {
    /// A copy of the header's bytes.
    fn header<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.lent.header().as_bytes())
    }

    /// The number of the relation to the previously received frame, and the number of frames lost between the two.
    fn continuity(&self) -> (u8, u64) {
        match self.lent.continuity() {
            Continuity::First => (0, 0),
            Continuity::Next => (1, 0),
            Continuity::Lost(frames) => (2, frames),
            Continuity::Restarted => (3, 0),
        }
    }

    /// Position of a handle in metres, without an array. A negative number counts from the last handle.
    fn position(&self, handle: isize) -> PyResult<(f64, f64, f64)> {
        let [x, y, z] = self.handle(handle)?.position_m;
        Ok((x, y, z))
    }

    /// Velocity of a handle in metres per show second, likewise.
    fn velocity(&self, handle: isize) -> PyResult<(f64, f64, f64)> {
        let [x, y, z] = self.handle(handle)?.velocity_mps;
        Ok((x, y, z))
    }

    /// numpy's protocol, <https://numpy.org/doc/stable/reference/arrays.interface.html>: the handles as an array of shape
    /// (N + 1, 2, 3), position and velocity of each. `True` means read-only.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        const _: () = assert!(size_of::<HandleState>() == 6 * size_of::<f64>());
        let handles = self.lent.handles();
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", "<f8")?;
        interface.set_item("shape", (handles.len(), 2, 3))?;
        interface.set_item("data", (handles.as_ptr().addr(), true))?;
        Ok(interface)
    }
}

impl Frame {
    fn handle(&self, handle: isize) -> PyResult<&HandleState> {
        let handles = self.lent.handles();
        let index = if handle < 0 { handle.checked_add_unsigned(handles.len()) } else { Some(handle) };
        let found = index.and_then(|index| handles.get(usize::try_from(index).ok()?));
        found.ok_or_else(|| {
            PyIndexError::new_err(format!("handle is {handle}, the frame has {} handles", handles.len()))
        })
    }
}
