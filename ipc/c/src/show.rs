//! Opens and closes an instance. C holds a number in place of a pointer, so that a call on a closed client is an error and
//! not an access to freed memory.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;
use core::sync::atomic::AtomicUsize;
use core::sync::atomic::Ordering::Relaxed;
use std::collections::BTreeMap;
use std::os::fd::RawFd;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::Duration;

use bench_dragon_ipc::{BusError, Domain, Instance, Show, SourceState};

use crate::result::{Failure, answer, bd_result_t};

/// A client of one instance of the bus.
///
/// Any thread may use it, also while other threads wait. Each frame goes to one of the threads that read. Close it with
/// `bd_show_close`, from any thread. A forked child must open its own.
#[derive(Debug)]
pub struct bd_show_t {
    _private: (),
}

/// The open clients by their numbers, which are never used again.
static SHOWS: RwLock<BTreeMap<usize, Arc<Show>>> = RwLock::new(BTreeMap::new());

/// Returns the open client of a handle.
pub(crate) fn opened(handle: *const bd_show_t) -> Result<Arc<Show>, Failure> {
    if handle.is_null() {
        return Err(Failure::missing("show"));
    }
    let shows = SHOWS.read().unwrap_or_else(PoisonError::into_inner);
    let closed = || Failure::new(bd_result_t::BD_CLOSED, "the client is closed");
    shows.get(&handle.addr()).map(Arc::clone).ok_or_else(closed)
}

fn open(instance: Option<&str>, name: &str, timeout_ns: u64) -> Result<*mut bd_show_t, Failure> {
    static NUMBER: AtomicUsize = AtomicUsize::new(1);
    let instance = instance.map_or_else(|| Ok(Instance::default()), Instance::new).map_err(BusError::from)?;
    let domain = Domain::new(instance).map_err(BusError::from)?;
    let show = Show::open(&domain, name, Duration::from_nanos(timeout_ns))?;
    let number = NUMBER.fetch_add(1, Relaxed);
    SHOWS.write().unwrap_or_else(PoisonError::into_inner).insert(number, Arc::new(show));
    Ok(core::ptr::without_provenance_mut(number))
}

/// Opens an instance of the bus as a client. `instance` is 1 to 24 characters of a-z, 0-9 and -; NULL is the default,
/// "dragon". `name` has 1 to 128 printable ASCII characters and identifies this client in lists of processes.
///
/// Waits for a server at most `timeout_ns` nanoseconds; 0 does not wait. An open client outlives its server: the frames
/// of the next server follow, with `BD_RESTARTED`.
///
/// `BD_NO_SERVER` if no server appeared in time, `BD_INVALID_ARGUMENT` for a bad name, or another error of `bd_result_t`.
/// `show` is NULL unless the result is `BD_OK`.
///
/// `instance` and `name` are strings in UTF-8 with a terminating zero. They are copied.
#[expect(clippy::missing_safety_doc, reason = "the documentation is that of the C header")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bd_show_open(
    instance: *const c_char,
    name: *const c_char,
    timeout_ns: u64,
    show: Option<&mut MaybeUninit<*mut bd_show_t>>,
) -> bd_result_t {
    answer(|| {
        let show = show.ok_or_else(|| Failure::missing("show"))?.write(core::ptr::null_mut());
        // SAFETY: the caller passes NULL or a string.
        let (instance, name) = unsafe { (text("instance", instance)?, text("name", name)?) };
        let name = name.ok_or_else(|| Failure::missing("name"))?;
        *show = open(instance, name, timeout_ns)?;
        Ok(Some(()))
    })
}

/// Closes a client, from any thread. Every wait of other threads ends with `BD_CLOSED`, and so does every later call on
/// the client. Held frames stay valid until they are released. NULL and a closed client have no effect.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_close(show: *mut bd_show_t) {
    let closed = SHOWS.write().unwrap_or_else(PoisonError::into_inner).remove(&show.addr());
    answer(|| Ok(closed.map(|show| show.close())));
}

/// Whether the source publishes, and if not, why.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_source_state_t {
    /// A source runs, and the newest frame is recent.
    BD_SOURCE_PUBLISHING = 0,
    /// A source runs, but its newest frame is old: the process is suspended, stuck, or still starting.
    BD_SOURCE_HANGING = 1,
    /// The run has ended in order: the last frame that was read has the state `BD_ENDED`.
    BD_SOURCE_ENDED = 2,
    /// No source runs, and the run has not ended in order: the process was killed or has failed.
    BD_SOURCE_LOST = 3,
}

/// Returns in `state` whether the source publishes, and if not, why. Call it after `bd_show_wait` has returned
/// `BD_NOTHING`: frames that were not read yet do not count. `limit_ns` is the age in nanoseconds from which the newest
/// frame is old: several periods of the server.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_source(
    show: *const bd_show_t,
    limit_ns: u64,
    state: Option<&mut MaybeUninit<bd_source_state_t>>,
) -> bd_result_t {
    answer(|| {
        let state = state.ok_or_else(|| Failure::missing("state"))?;
        state.write(match opened(show)?.source_state(Duration::from_nanos(limit_ns))? {
            SourceState::Publishing => bd_source_state_t::BD_SOURCE_PUBLISHING,
            SourceState::Hanging { .. } => bd_source_state_t::BD_SOURCE_HANGING,
            SourceState::Ended => bd_source_state_t::BD_SOURCE_ENDED,
            SourceState::Lost => bd_source_state_t::BD_SOURCE_LOST,
        });
        Ok(Some(()))
    })
}

/// Returns in `descriptor` a file descriptor that is readable when a frame may be unread, for `poll`, `epoll` and event
/// loops. It also becomes readable when the client is closed. Call `bd_show_next` until it returns `BD_NOTHING`: that
/// makes the descriptor unreadable again. Do not read or close it. It ends with the client.
///
/// The first call starts a thread that sleeps until frames arrive. The server is not affected.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_descriptor(
    show: *const bd_show_t,
    descriptor: Option<&mut MaybeUninit<RawFd>>,
) -> bd_result_t {
    answer(|| {
        let descriptor = descriptor.ok_or_else(|| Failure::missing("descriptor"))?;
        descriptor.write(opened(show)?.descriptor()?);
        Ok(Some(()))
    })
}

/// Returns a string of the caller.
///
/// # Safety
/// `string` is NULL or points to bytes up to a zero, which do not change while the result is used.
unsafe fn text<'a>(argument: &str, string: *const c_char) -> Result<Option<&'a str>, Failure> {
    if string.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller keeps this function's contract.
    let string = unsafe { CStr::from_ptr(string) };
    let invalid =
        |_| Failure::new(bd_result_t::BD_INVALID_ARGUMENT, format!("{argument} is {string:?}, must be UTF-8"));
    string.to_str().map(Some).map_err(invalid)
}
