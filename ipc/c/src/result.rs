//! What a call came to, and the text of what went wrong.

use core::ffi::{CStr, c_char};
use std::any::Any;
use std::cell::RefCell;
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};

use bench_dragon_ipc::{BusError, DomainError};

/// What a call came to. More may follow; treat a number that you do not know as `BD_FAILED`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_result_t {
    /// Done.
    BD_OK = 0,
    /// Nothing new, or nothing came in time. Not an error.
    BD_NOTHING = 1,
    /// No server runs on the instance, or none has answered. Try again later.
    BD_NO_SERVER = 2,
    /// The server refused the command; the reply says why.
    BD_REFUSED = 3,
    /// An argument is NULL or out of range.
    BD_INVALID_ARGUMENT = 4,
    /// As many frames as allowed are held: release one.
    BD_TOO_MANY_FRAMES = 5,
    /// As many clients as the bus allows are connected.
    BD_TOO_MANY_CLIENTS = 6,
    /// The server is of another version, whose data have another layout.
    BD_VERSION_MISMATCH = 7,
    /// This user may not use the instance: run as the user who runs the server.
    BD_PERMISSION_DENIED = 8,
    /// `/dev/shm` is full or cannot be used.
    BD_SHARED_MEMORY = 9,
    /// This process may not open as many files as it needs.
    BD_TOO_FEW_FILES = 10,
    /// The instance's directory is not usable.
    BD_DIRECTORY = 11,
    /// Anything else.
    BD_FAILED = 12,
}

/// Why a call failed.
#[derive(Debug)]
pub(crate) struct Failure {
    result: bd_result_t,
    text: String,
}

impl Failure {
    pub(crate) fn new(result: bd_result_t, text: impl Into<String>) -> Self {
        Self { result, text: text.into() }
    }

    /// Whether there may be a server later.
    pub(crate) fn is_absence(&self) -> bool {
        self.result == bd_result_t::BD_NO_SERVER
    }

    /// An argument that has to be there is not.
    pub(crate) fn missing(argument: &str) -> Self {
        Self::new(bd_result_t::BD_INVALID_ARGUMENT, format!("{argument} is NULL, must not be"))
    }
}

impl From<BusError> for Failure {
    fn from(error: BusError) -> Self {
        let result = match &error {
            error if error.is_absent() => bd_result_t::BD_NO_SERVER,
            BusError::NoAnswer { .. } => bd_result_t::BD_NO_SERVER,
            BusError::VersionMismatch { .. } => bd_result_t::BD_VERSION_MISMATCH,
            BusError::SharedMemoryFull { .. } | BusError::SharedMemoryUnusable { .. } => bd_result_t::BD_SHARED_MEMORY,
            BusError::TooFewFiles { .. } => bd_result_t::BD_TOO_FEW_FILES,
            BusError::TooManyClients { .. } => bd_result_t::BD_TOO_MANY_CLIENTS,
            BusError::Domain(DomainError::InvalidInstance { .. }) => bd_result_t::BD_INVALID_ARGUMENT,
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

/// The text of the last call of this thread that came to anything but `BD_OK` and `BD_NOTHING`: one line, UTF-8, never NULL,
/// empty where none has. Valid until the next such call of this thread.
#[unsafe(no_mangle)]
pub extern "C" fn bd_last_error() -> *const c_char {
    LAST_ERROR.try_with(|text| text.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// The version of this library, as "0.1.0". Valid for ever.
#[unsafe(no_mangle)]
pub extern "C" fn bd_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    const TEXT: &CStr = match CStr::from_bytes_with_nul(VERSION.as_bytes()) {
        Ok(text) => text,
        Err(_) => panic!("a version has no zero in it"),
    };
    TEXT.as_ptr()
}

/// Does a call's work and tells what it came to: `BD_OK` with something, `BD_NOTHING` without. Keeps the text of a failure,
/// and makes one of a panic.
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

/// Gives back what C has had.
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
    // A thread that is ending has nobody left to ask for it.
    let _ = LAST_ERROR.try_with(|last| last.replace(line));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last_error() -> String {
        // SAFETY: the pointer is that of this thread's text, which nothing replaces meanwhile.
        unsafe { CStr::from_ptr(bd_last_error()) }.to_str().expect("texts are UTF-8").to_owned()
    }

    #[test]
    fn a_panic_is_an_error_with_its_text() {
        assert_eq!(answer(|| panic!("the {}\nfell", "sky")), bd_result_t::BD_FAILED);
        assert_eq!(last_error(), "a defect of bench_dragon: the sky fell");
    }

    #[test]
    fn what_succeeds_or_finds_nothing_leaves_the_last_error_alone() {
        assert_eq!(answer(|| Err(Failure::missing("frame"))), bd_result_t::BD_INVALID_ARGUMENT);
        assert_eq!((answer(|| Ok(Some(()))), answer(|| Ok(None))), (bd_result_t::BD_OK, bd_result_t::BD_NOTHING));
        assert_eq!(last_error(), "frame is NULL, must not be");
    }

    #[test]
    fn a_text_is_of_its_own_thread() {
        assert_eq!(answer(|| Err(Failure::missing("dragon"))), bd_result_t::BD_INVALID_ARGUMENT);
        let elsewhere = std::thread::spawn(last_error).join().expect("it does not panic");
        assert_eq!((elsewhere.as_str(), last_error().as_str()), ("", "dragon is NULL, must not be"));
    }
}
