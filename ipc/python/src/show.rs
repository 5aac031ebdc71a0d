//! The client of an instance.

use std::cell::Cell;
use std::os::fd::{IntoRawFd, RawFd};
use std::time::{Duration, Instant};

use bench_dragon_ipc::{BusError, CommandReply, Domain, Instance, IntoBytes as _, Request, SourceState};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::raised;
use crate::frame::Frame;

/// Longest wait between two looks for signals. A signal that arrives just before a wait does not end it.
const SLICE: Duration = Duration::from_millis(100);

/// A client of one instance. Timeouts are nanoseconds; `None` waits without a limit.
#[pyclass(frozen, module = "bench_dragon._bus")]
#[derive(Debug)]
pub(crate) struct Show {
    bus: bench_dragon_ipc::Show,
}

#[pymethods]
impl Show {
    #[new]
    #[pyo3(signature = (instance, name, timeout_ns))]
    fn open(py: Python<'_>, instance: &str, name: &str, timeout_ns: Option<u64>) -> PyResult<Self> {
        let domain = Instance::new(instance).and_then(Domain::new).map_err(|error| raised(py, &error.into()))?;
        let open = |slice| match bench_dragon_ipc::Show::open(&domain, name, slice) {
            Ok(bus) => Ok(Some(Self { bus })),
            Err(error) if error.is_absent() && slice == SLICE => Ok(None),
            Err(error) => Err(error),
        };
        Ok(waiting(py, timeout_ns, open)?.expect("the last attempt opens or fails"))
    }

    fn receive(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        // Not worth the time to let other threads run: it never waits.
        Ok(self.bus.receive().map_err(|error| raised(py, &error))?.map(Frame::from))
    }

    fn latest(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        Ok(self.bus.latest().map_err(|error| raised(py, &error))?.map(Frame::from))
    }

    fn wait(&self, py: Python<'_>, timeout_ns: Option<u64>) -> PyResult<Option<Frame>> {
        Ok(waiting(py, timeout_ns, |slice| self.bus.wait(slice))?.map(Frame::from))
    }

    fn wait_until_due(&self, py: Python<'_>, timeout_ns: Option<u64>, spin_ns: u64) -> PyResult<Option<Frame>> {
        let spin = Duration::from_nanos(spin_ns);
        Ok(waiting(py, timeout_ns, |slice| self.bus.wait_until_due(slice, spin))?.map(Frame::from))
    }

    #[getter]
    fn lost(&self) -> u64 {
        self.bus.lost()
    }

    /// Returns run and TOML text of the latest description.
    fn description(&self, py: Python<'_>, timeout_ns: Option<u64>) -> PyResult<Option<(u64, String)>> {
        let read = |slice| retry_absent(slice, self.bus.description(slice));
        Ok(waiting(py, timeout_ns, read)?.map(|description| (description.run_id, description.toml)))
    }

    /// Returns the bytes of the latest status.
    fn status<'py>(&self, py: Python<'py>, timeout_ns: Option<u64>) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let read = |slice| retry_absent(slice, self.bus.status(slice));
        Ok(waiting(py, timeout_ns, read)?.map(|status| PyBytes::new(py, status.as_bytes())))
    }

    /// Returns the bytes of the oldest unread alert.
    fn alert<'py>(&self, py: Python<'py>, timeout_ns: Option<u64>) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let read = |slice| retry_absent(slice, self.bus.alert(slice));
        Ok(waiting(py, timeout_ns, read)?.map(|alert| PyBytes::new(py, alert.as_bytes())))
    }

    /// Returns the bytes of the oldest unread event of a command.
    fn command_event<'py>(&self, py: Python<'py>, timeout_ns: Option<u64>) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let read = |slice| retry_absent(slice, self.bus.command_event(slice));
        Ok(waiting(py, timeout_ns, read)?.map(|event| PyBytes::new(py, event.as_bytes())))
    }

    /// Sends a command and returns the tick from which it holds.
    fn call(&self, py: Python<'_>, kind: u32, value: f64, timeout_ns: Option<u64>) -> PyResult<u64> {
        let request = match kind {
            0 => Request::Pause,
            1 => Request::Resume,
            2 => Request::Speed { speed_mps: value },
            3 => Request::Seek { show_time_s: value },
            4 => Request::Hold,
            5 => Request::Release,
            6 => Request::Stop,
            12 => Request::Pace { factor: value },
            13 => Request::Go,
            _ => unreachable!("the package sends these kinds only"),
        };
        let timeout = timeout_ns.map_or(Duration::MAX, Duration::from_nanos);
        let reply = py.detach(|| self.call_until_signal(request, timeout))?.map_err(|error| raised(py, &error))?;
        Ok(reply.tick)
    }

    /// Returns the name of the source's state.
    fn source(&self, py: Python<'_>, limit_ns: u64) -> PyResult<&'static str> {
        let state = self.bus.source_state(Duration::from_nanos(limit_ns));
        state.map(SourceState::name).map_err(|error| raised(py, &error))
    }

    fn descriptor(&self, py: Python<'_>) -> PyResult<RawFd> {
        self.bus.descriptor().map_err(|error| raised(py, &error))
    }

    fn descriptor_copy(&self, py: Python<'_>) -> PyResult<RawFd> {
        self.bus.descriptor_copy().map(IntoRawFd::into_raw_fd).map_err(|error| raised(py, &error))
    }

    fn close(&self, py: Python<'_>) {
        py.detach(|| self.bus.close());
    }
}

impl Show {
    /// Calls the server, and looks for signals meanwhile. The outer error is the exception of a signal's handler.
    fn call_until_signal(&self, request: Request, timeout: Duration) -> PyResult<Result<CommandReply, BusError>> {
        let (looked, raised) = (Cell::new(Instant::now()), Cell::new(None));
        let is_given_up = || {
            if looked.get().elapsed() >= SLICE {
                looked.set(Instant::now());
                raised.set(signal_error());
            }
            let error = raised.take();
            let is_raised = error.is_some();
            raised.set(error);
            is_raised
        };
        let outcome = self.bus.call_unless(request, timeout, is_given_up);
        raised.take().map_or(Ok(outcome), Err)
    }
}

/// Returns the exception of a signal's handler, if a signal has arrived.
fn signal_error() -> Option<PyErr> {
    Python::attach(|py| -> PyResult<()> { py.check_signals() }).err()
}

/// Calls `read` with one slice of the timeout after the other, until it returns a value. Other Python threads run during a
/// slice; between two, Python handles signals.
fn waiting<Value: Send>(
    py: Python<'_>,
    timeout_ns: Option<u64>,
    read: impl Fn(Duration) -> Result<Option<Value>, BusError> + Sync,
) -> PyResult<Option<Value>> {
    let timeout = timeout_ns.map_or(Duration::MAX, Duration::from_nanos);
    let begun = Instant::now();
    loop {
        let left = timeout.saturating_sub(begun.elapsed());
        let value = py.detach(|| read(left.min(SLICE))).map_err(|error| raised(py, &error))?;
        py.check_signals()?;
        if value.is_some() || left <= SLICE && timeout <= begun.elapsed() {
            return Ok(value);
        }
    }
}

/// Tries again without a server, except in the last slice.
fn retry_absent<Value>(slice: Duration, outcome: Result<Option<Value>, BusError>) -> Result<Option<Value>, BusError> {
    match outcome {
        Err(error) if error.is_absent() && slice == SLICE => Ok(None),
        outcome => outcome,
    }
}
