//! Configuration of a run.

use core::ffi::c_char;
use core::mem::MaybeUninit;
use std::ffi::CString;

use bench_dragon_ipc::{Description, DescriptionReader};

use crate::dragon::{Origin, bd_dragon_t};
use crate::patience::look;
use crate::result::{Failure, answer, bd_result_t, release};

/// Configuration of a run, as the server published it.
#[derive(Clone, Debug)]
pub struct bd_description_t {
    run_id: u64,
    toml: CString,
}

/// The reader, and its latest description: the server sends each one once to a reader.
#[derive(Debug, Default)]
pub(crate) struct DescriptionPort {
    reader: Option<DescriptionReader>,
    latest: Option<bd_description_t>,
}

impl DescriptionPort {
    fn latest(&mut self, origin: &Origin) -> Result<Option<bd_description_t>, Failure> {
        if let Some(description) = origin.open(&mut self.reader, DescriptionReader::open)?.poll()? {
            self.latest = Some(bd_description_t::of(description)?);
        }
        Ok(self.latest.clone())
    }
}

impl bd_description_t {
    fn of(description: Description) -> Result<Self, Failure> {
        let toml = CString::new(description.toml).map_err(|_| {
            Failure::new(bd_result_t::BD_VERSION_MISMATCH, "the description contains a zero byte, must be text")
        })?;
        Ok(Self { run_id: description.run_id, toml })
    }
}

/// Returns the latest description in `description`. Waits for the first one at most `timeout_ns` nanoseconds: a server
/// sends it to new readers within a tenth of a second. Later calls return the same description until a new one is
/// published.
///
/// The description is a copy that the caller releases with `bd_description_release`. Compare its run with that of the
/// frames: after a restart, frames may arrive shortly before their description.
///
/// `BD_NOTHING` if none arrived in time, `BD_NO_SERVER` if there is no server.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_description(
    dragon: Option<&bd_dragon_t>,
    timeout_ns: u64,
    description: Option<&mut MaybeUninit<*mut bd_description_t>>,
) -> bd_result_t {
    answer(|| {
        let description = description.ok_or_else(|| Failure::missing("description"))?.write(core::ptr::null_mut());
        let dragon = dragon.ok_or_else(|| Failure::missing("dragon"))?;
        let latest = look(timeout_ns, || dragon.description.lock().latest(&dragon.origin))?;
        Ok(latest.map(|latest| *description = Box::into_raw(Box::new(latest))))
    })
}

/// Returns the run of a description; 0 for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn bd_description_run_id(description: Option<&bd_description_t>) -> u64 {
    description.map_or(0, |description| description.run_id)
}

/// Returns the complete configuration as TOML, in UTF-8 with a terminating zero; NULL for NULL. Valid until the
/// description is released.
#[unsafe(no_mangle)]
pub extern "C" fn bd_description_toml(description: Option<&bd_description_t>) -> *const c_char {
    description.map_or(core::ptr::null(), |description| description.toml.as_ptr())
}

/// Releases a description. NULL has no effect.
#[unsafe(no_mangle)]
pub extern "C" fn bd_description_release(description: Option<Box<bd_description_t>>) {
    release(description);
}
