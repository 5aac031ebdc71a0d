//! Opening an instance, and closing it.

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

/// Longest name of a client in bytes: what iceoryx2 allows.
const MAX_NAME_LEN: usize = 128;

/// A client of one instance of the bus.
///
/// Frames are joined at once. The other services are joined when they are first asked for, each by a node of its own.
#[derive(Debug)]
pub struct bd_dragon_t {
    pub(crate) origin: Origin,
    frames: Arc<FrameReader>,
    pub(crate) description: Confined<DescriptionPort>,
    pub(crate) status: Confined<StatusPort>,
    pub(crate) alerts: Confined<Option<AlertSubscriber>>,
    pub(crate) commands: Confined<Option<CommandClient>>,
}

/// Whose ports to open, and under which name.
#[derive(Debug)]
pub(crate) struct Origin {
    domain: Domain,
    name: String,
}

impl Origin {
    /// The port in this place, opened where there is none yet.
    pub(crate) fn open<'a, Port>(
        &self,
        place: &'a mut Option<Port>,
        open: impl FnOnce(&Domain, &str) -> Result<Port, BusError>,
    ) -> Result<&'a mut Port, Failure> {
        if place.is_none() {
            *place = Some(open(&self.domain, &self.name)?);
        }
        Ok(place.as_mut().expect("opened where there was none"))
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
        let subscriber = look(timeout_ns, open)?.expect("opened, or a failure");
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

/// Opens an instance; NULL is the default one, "dragon". `name` tells this client from others in lists of who is there, 1 to
/// 128 bytes.
///
/// Waits for a server at most `timeout_ns`; `BD_NO_SERVER` where none came. Once open, a dragon outlives its server: frames
/// of the next one follow, with `BD_RESTARTED`. `dragon` is NULL after anything but `BD_OK`.
///
/// `instance` and `name` have to be NULL or strings that end with a zero byte; they are copied.
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
        // SAFETY: the caller gives NULL or a string.
        let (instance, name) = unsafe { (text("instance", instance)?, text("name", name)?) };
        let name = name.ok_or_else(|| Failure::missing("name"))?;
        *dragon = Box::into_raw(Box::new(bd_dragon_t::open(instance, name, timeout_ns)?));
        Ok(Some(()))
    })
}

/// Closes a dragon. No other call on it may be under way or follow. Frames that are held stay valid until they are released.
/// NULL is nothing.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_close(dragon: Option<Box<bd_dragon_t>>) {
    release(dragon);
}

/// A string of the caller's.
///
/// # Safety
/// `string` is NULL or points to bytes up to a zero, which nobody changes while the result is used.
unsafe fn text<'a>(argument: &str, string: *const c_char) -> Result<Option<&'a str>, Failure> {
    if string.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    let string = unsafe { CStr::from_ptr(string) };
    let invalid =
        |_| Failure::new(bd_result_t::BD_INVALID_ARGUMENT, format!("{argument} is {string:?}, must be UTF-8"));
    string.to_str().map(Some).map_err(invalid)
}
