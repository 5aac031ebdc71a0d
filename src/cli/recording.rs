//! The arguments of what reads recordings.

use std::path::PathBuf;

use bench_dragon::number::Number;
use bench_dragon::record::ShowInterval;
use clap::Args;

use super::value::{count, nanoseconds, play_rate, readers};
use super::{BusArgs, FormatArgs};
use crate::command::BadInput;

/// Arguments of `replay`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ReplayArgs {
    /// The recording.
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) interval: IntervalArgs,
    /// Recorded seconds to play per second, 0.01 to 100.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true, value_parser = play_rate)]
    pub(crate) rate: f64,
    /// Play it so many times; without a number, until Ctrl-C.
    #[arg(
        long = "loop",
        value_name = "TIMES",
        num_args = 0..=1,
        allow_negative_numbers = true,
        value_parser = count
    )]
    #[allow(clippy::option_option, reason = "not given, given without a number, given with one")]
    pub(crate) repeat: Option<Option<u64>>,
    /// Begin once this many readers are connected, after ten seconds at the latest.
    #[arg(long, value_name = "COUNT", default_value_t = 0, allow_negative_numbers = true, value_parser = readers)]
    pub(crate) readers: usize,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Which frames of a recording.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct IntervalArgs {
    /// Show time in seconds: only frames from here on.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = nanoseconds)]
    from: Option<i64>,
    /// Show time in seconds: only frames up to here.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = nanoseconds)]
    to: Option<i64>,
}

impl IntervalArgs {
    /// The interval.
    ///
    /// # Errors
    /// One that ends before it begins.
    pub(crate) fn interval(self) -> Result<ShowInterval, BadInput> {
        let ShowInterval { from_ns: first_ns, to_ns: last_ns } = ShowInterval::ALL;
        let interval = ShowInterval { from_ns: self.from.unwrap_or(first_ns), to_ns: self.to.unwrap_or(last_ns) };
        if interval.from_ns <= interval.to_ns {
            return Ok(interval);
        }
        let [from_s, to_s] = [interval.from_ns, interval.to_ns].map(|time_ns| Number(time_ns as f64 / 1e9));
        Err(BadInput(format!("--to is {to_s}, must be at least --from, which is {from_s}")))
    }
}
