//! Results of calls, and the texts of errors.

use core::ffi::{CStr, c_char};
use std::any::Any;
use std::cell::RefCell;
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};

use bench_dragon_ipc::{BusError, DomainError};

/// Result of a call. Later versions may add results; treat an unknown number as `BD_FAILED`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_result_t {
    /// Success.
    BD_OK = 0,
    /// Nothing new is available, or nothing arrived in time. Not an error.
    BD_NOTHING = 1,
    /// No server runs on the instance, or none has replied. Try again later.
    BD_NO_SERVER = 2,
    /// The server refused the command. The reply has the reason.
    BD_REFUSED = 3,
    /// An argument is NULL, out of range or not valid text.
    BD_INVALID_ARGUMENT = 4,
    /// Too many frames are held. Release one.
    BD_TOO_MANY_FRAMES = 5,
    /// The bus has its greatest allowed number of clients.
    BD_TOO_MANY_CLIENTS = 6,
    /// The server is of another version, whose data has another layout.
    BD_VERSION_MISMATCH = 7,
    /// This user may not use the instance. Run as the user who runs the server.
    BD_PERMISSION_DENIED = 8,
    /// `/dev/shm` is full or cannot be used.
    BD_SHARED_MEMORY = 9,
    /// This process may not open as many files as it needs.
    BD_TOO_FEW_FILES = 10,
    /// The instance's directory is not usable.
    BD_DIRECTORY = 11,
    /// Any other error.
    BD_FAILED = 12,
    /// The client is closed.
    BD_CLOSED = 13,
}

/// Error of a call.
#[derive(Debug)]
pub(crate) struct Failure {
    result: bd_result_t,
    text: String,
}

impl Failure {
    pub(crate) fn new(result: bd_result_t, text: impl Into<String>) -> Self {
        Self { result, text: text.into() }
    }

    /// Creates the error for a required argument that is NULL.
    pub(crate) fn missing(argument: &str) -> Self {
        Self::new(bd_result_t::BD_INVALID_ARGUMENT, format!("{argument} is NULL, must not be"))
    }
}

impl From<BusError> for Failure {
    fn from(error: BusError) -> Self {
        let result = match &error {
            error if error.is_absent() => bd_result_t::BD_NO_SERVER,
            BusError::NoAnswer { .. } => bd_result_t::BD_NO_SERVER,
            BusError::Refused { .. } => bd_result_t::BD_REFUSED,
            BusError::VersionMismatch { .. } => bd_result_t::BD_VERSION_MISMATCH,
            BusError::SharedMemoryFull { .. } | BusError::SharedMemoryUnusable { .. } => bd_result_t::BD_SHARED_MEMORY,
            BusError::TooFewFiles { .. } => bd_result_t::BD_TOO_FEW_FILES,
            BusError::Closed { .. } => bd_result_t::BD_CLOSED,
            BusError::TooManyFrames => bd_result_t::BD_TOO_MANY_FRAMES,
            BusError::TooManyClients { .. } => bd_result_t::BD_TOO_MANY_CLIENTS,
            BusError::Inherited { .. }
            | BusError::InvalidName { .. }
            | BusError::Domain(DomainError::InvalidInstance { .. }) => bd_result_t::BD_INVALID_ARGUMENT,
            BusError::PermissionDenied { .. } | BusError::Domain(DomainError::PermissionDenied { .. }) => {
                bd_result_t::BD_PERMISSION_DENIED
            }
            BusError::Domain(_) => bd_result_t::BD_DIRECTORY,
            _ => bd_result_t::BD_FAILED,
        };
        Self::new(result, error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Returns the error text of the last call of this thread whose result was neither `BD_OK` nor `BD_NOTHING`. The text is
/// one line in UTF-8, never NULL, and empty if no call has failed. Valid until the next failing call of this thread.
#[unsafe(no_mangle)]
pub extern "C" fn bd_last_error() -> *const c_char {
    LAST_ERROR.try_with(|text| text.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// Returns the version of this library, such as "0.1.0". Valid until the process ends.
#[unsafe(no_mangle)]
pub extern "C" fn bd_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    const TEXT: &CStr = match CStr::from_bytes_with_nul(VERSION.as_bytes()) {
        Ok(text) => text,
        Err(_) => panic!("the version contains a zero byte"),
    };
    TEXT.as_ptr()
}

/// Does a call's work and returns its result: `BD_OK` with a value, `BD_NOTHING` without. Stores the text of a failure,
/// and converts a panic to a failure.
pub(crate) fn answer(work: impl FnOnce() -> Result<Option<()>, Failure>) -> bd_result_t {
    let outcome = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(broken(panic.as_ref())));
    match outcome {
        Ok(Some(())) => bd_result_t::BD_OK,
        Ok(None) => bd_result_t::BD_NOTHING,
        Err(failure) => {
            keep(&failure.text);
            failure.result
        }
    }
}

/// Releases an object that C holds.
pub(crate) fn release<Lent>(lent: Option<Box<Lent>>) {
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| drop(lent))) {
        keep(&broken(panic.as_ref()).text);
    }
}

fn broken(panic: &(dyn Any + Send)) -> Failure {
    let reason = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let reason = reason.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    Failure::new(bd_result_t::BD_FAILED, format!("a defect of bench_dragon: {reason}"))
}

fn keep(text: &str) {
    let line = CString::new(text.replace(['\0', '\n'], " ")).unwrap_or_default();
    // An ending thread has no storage for the text any more, and no later call that reads it.
    let _ = LAST_ERROR.try_with(|last| last.replace(line));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last_error() -> String {
        // SAFETY: the pointer is to this thread's text, which nothing replaces before it is copied.
        unsafe { CStr::from_ptr(bd_last_error()) }.to_str().expect("texts are UTF-8").to_owned()
    }

    #[test]
    fn a_panic_is_an_error_with_its_text() {
        assert_eq!(answer(|| panic!("the {}\nfell", "sky")), bd_result_t::BD_FAILED);
        assert_eq!(last_error(), "a defect of bench_dragon: the sky fell");
    }

    #[test]
    fn a_call_without_an_error_keeps_the_last_error_text() {
        assert_eq!(answer(|| Err(Failure::missing("frame"))), bd_result_t::BD_INVALID_ARGUMENT);
        assert_eq!((answer(|| Ok(Some(()))), answer(|| Ok(None))), (bd_result_t::BD_OK, bd_result_t::BD_NOTHING));
        assert_eq!(last_error(), "frame is NULL, must not be");
    }

    #[test]
    fn each_thread_has_its_own_error_text() {
        assert_eq!(answer(|| Err(Failure::missing("show"))), bd_result_t::BD_INVALID_ARGUMENT);
        let elsewhere = std::thread::spawn(last_error).join().expect("it does not panic");
        assert_eq!((elsewhere.as_str(), last_error().as_str()), ("", "show is NULL, must not be"));
    }
}
