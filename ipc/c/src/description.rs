//! Configuration of a run.

use core::ffi::c_char;
use core::mem::MaybeUninit;
use std::ffi::CString;
use std::time::Duration;

use bench_dragon_ipc::Description;

use crate::result::{Failure, answer, bd_result_t, release};
use crate::show::{bd_show_t, opened};

/// Configuration of a run, as the server published it.
#[derive(Clone, Debug)]
pub struct bd_description_t {
    run_id: u64,
    toml: CString,
    dragons: Vec<CString>,
}

impl bd_description_t {
    fn of(description: &Description) -> Result<Self, Failure> {
        let text = |text: &str| {
            CString::new(text).map_err(|_| {
                Failure::new(bd_result_t::BD_VERSION_MISMATCH, "the description contains a zero byte, must be text")
            })
        };
        let dragons = description.dragon_names().into_iter().map(text).collect::<Result<_, _>>()?;
        Ok(Self { run_id: description.run_id, toml: text(&description.toml)?, dragons })
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
pub extern "C" fn bd_show_description(
    show: *const bd_show_t,
    timeout_ns: u64,
    description: Option<&mut MaybeUninit<*mut bd_description_t>>,
) -> bd_result_t {
    answer(|| {
        let description = description.ok_or_else(|| Failure::missing("description"))?.write(core::ptr::null_mut());
        let latest = opened(show)?.description(Duration::from_nanos(timeout_ns))?;
        let latest = latest.as_ref().map(bd_description_t::of).transpose()?;
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

/// Returns the name of dragon `index` of a description, in UTF-8 with a terminating zero. Its poses are those of `dragons[index]` of
/// the header of the run's frames. NULL for NULL, from the number of dragons on, and for a show of one dragon, which has no name.
/// Valid until the description is released.
#[unsafe(no_mangle)]
pub extern "C" fn bd_description_dragon(description: Option<&bd_description_t>, index: usize) -> *const c_char {
    let dragon = description.and_then(|description| description.dragons.get(index));
    dragon.map_or(core::ptr::null(), |name| name.as_ptr())
}

/// Releases a description. NULL has no effect.
#[unsafe(no_mangle)]
pub extern "C" fn bd_description_release(description: Option<Box<bd_description_t>>) {
    release(description);
}
