//! Waiting for a server that is not there yet.

use std::thread;
use std::time::Duration;

use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::{BusError, Instance};

use crate::command::output::complain;

/// How often a missing server is looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// How long a reader waits for a frame before it looks at the stop flag again.
pub(crate) const WAIT_PERIOD: Duration = Duration::from_millis(100);

/// Opens something of an instance, waiting for as long as nothing is published there. `None` where a signal came first.
pub(crate) fn open_when_there<Port>(
    instance: &Instance,
    stop: &StopFlag,
    mut open: impl FnMut() -> Result<Port, BusError>,
) -> Result<Option<Port>, BusError> {
    let mut told = false;
    while !stop.is_set() {
        match open() {
            Ok(port) => return Ok(Some(port)),
            Err(error) if error.is_absent() => {
                if !told {
                    complain(&format!("waiting for a server on instance {instance}"));
                    told = true;
                }
                thread::sleep(LOOK_PERIOD);
            }
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}
