//! The description that belongs to a frame.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::bail;
use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::{Description, DescriptionReader};

/// How long a run's description may come after its first frame.
const PATIENCE: Duration = Duration::from_secs(5);
const LOOK_PERIOD: Duration = Duration::from_millis(1);

/// Waits for the description of a run; frames stay in the reader's buffer meanwhile. `None` where a signal came first.
///
/// # Errors
/// Where there is none after five seconds, though there are frames.
pub(crate) fn description_of(
    reader: &DescriptionReader,
    run_id: u64,
    stop: &StopFlag,
) -> anyhow::Result<Option<Description>> {
    let deadline = Instant::now() + PATIENCE;
    while !stop.is_set() {
        match reader.poll()? {
            Some(description) if description.run_id == run_id => return Ok(Some(description)),
            Some(_) => {}
            None if Instant::now() >= deadline => bail!("the source of run {run_id} publishes no description"),
            None => thread::sleep(LOOK_PERIOD),
        }
    }
    Ok(None)
}
