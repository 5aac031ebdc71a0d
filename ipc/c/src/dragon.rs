//! Opens and closes an instance.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;
use std::sync::Arc;

use bench_dragon_ipc::{AlertSubscriber, BusError, CommandClient, Domain, FrameSubscriber, Instance};

use crate::confined::Confined;
use crate::description::DescriptionPort;
use crate::frames::FrameReader;
use crate::patience::look;
use crate::result::{Failure, answer, bd_result_t, release};
use crate::status::StatusPort;

/// Greatest length of a client's name in bytes: the limit of iceoryx2.
const MAX_NAME_LEN: usize = 128;

/// A client of one instance of the bus.
///
/// The frames are opened at once. Every other service is opened at its first use, with a node of its own.
#[derive(Debug)]
pub struct bd_dragon_t {
    pub(crate) origin: Origin,
    frames: Arc<FrameReader>,
    pub(crate) description: Confined<DescriptionPort>,
    pub(crate) status: Confined<StatusPort>,
    pub(crate) alerts: Confined<Option<AlertSubscriber>>,
    pub(crate) commands: Confined<Option<CommandClient>>,
}

/// Domain of the ports and name of the client.
#[derive(Debug)]
pub(crate) struct Origin {
    domain: Domain,
    name: String,
}

impl Origin {
    /// Returns the port in this place, and opens it first if the place is empty.
    pub(crate) fn open<'a, Port>(
        &self,
        place: &'a mut Option<Port>,
        open: impl FnOnce(&Domain, &str) -> Result<Port, BusError>,
    ) -> Result<&'a mut Port, Failure> {
        if place.is_none() {
            *place = Some(open(&self.domain, &self.name)?);
        }
        Ok(place.as_mut().expect("the port was opened above"))
    }
}

impl bd_dragon_t {
    fn open(instance: Option<&str>, name: &str, timeout_ns: u64) -> Result<Self, Failure> {
        let instance = instance.map_or_else(|| Ok(Instance::default()), Instance::new).map_err(BusError::from)?;
        if name.is_empty() || name.len() > MAX_NAME_LEN {
            let text = format!("name is {name:?}, must be 1 to {MAX_NAME_LEN} bytes");
            return Err(Failure::new(bd_result_t::BD_INVALID_ARGUMENT, text));
        }
        let origin = Origin { domain: Domain::new(instance).map_err(BusError::from)?, name: name.to_owned() };
        let open = || Ok(Some(FrameSubscriber::open(&origin.domain, &origin.name)?));
        let subscriber = look(timeout_ns, open)?.expect("the attempt returns a port or a failure");
        Ok(Self {
            origin,
            frames: Arc::new(FrameReader::new(subscriber)),
            description: Confined::new(DescriptionPort::default()),
            status: Confined::new(StatusPort::default()),
            alerts: Confined::new(None),
            commands: Confined::new(None),
        })
    }

    pub(crate) fn frames(&self) -> &Arc<FrameReader> {
        &self.frames
    }
}

/// Opens an instance of the bus as a client. `instance` is 1 to 24 characters of a-z, 0-9 and -; NULL is the default,
/// "dragon". `name` has 1 to 128 bytes and identifies this client in lists of processes.
///
/// Waits for a server at most `timeout_ns` nanoseconds; 0 does not wait. An open dragon outlives its server: the frames
/// of the next server follow, with `BD_RESTARTED`.
///
/// `BD_NO_SERVER` if no server appeared in time, `BD_INVALID_ARGUMENT` for a bad name, or another error of `bd_result_t`.
/// `dragon` is NULL unless the result is `BD_OK`.
///
/// `instance` and `name` are strings in UTF-8 with a terminating zero. They are copied.
#[expect(clippy::missing_safety_doc, reason = "the documentation is that of the C header")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bd_dragon_open(
    instance: *const c_char,
    name: *const c_char,
    timeout_ns: u64,
    dragon: Option<&mut MaybeUninit<*mut bd_dragon_t>>,
) -> bd_result_t {
    answer(|| {
        let dragon = dragon.ok_or_else(|| Failure::missing("dragon"))?.write(core::ptr::null_mut());
        // SAFETY: the caller passes NULL or a string.
        let (instance, name) = unsafe { (text("instance", instance)?, text("name", name)?) };
        let name = name.ok_or_else(|| Failure::missing("name"))?;
        *dragon = Box::into_raw(Box::new(bd_dragon_t::open(instance, name, timeout_ns)?));
        Ok(Some(()))
    })
}

/// Closes a dragon. No other call on it may be running or follow. Held frames stay valid until they are released. NULL
/// has no effect.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_close(dragon: Option<Box<bd_dragon_t>>) {
    release(dragon);
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
