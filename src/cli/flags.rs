//! Flags that several subcommands share, and the parsers of their values. The error of a wrong value states what is allowed.

use std::fmt::Display;
use std::net::SocketAddr;
use std::ops::{Add, RangeInclusive};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use bench_dragon_geometry::number::Number;
use bench_dragon_ipc::service::MAX_READERS;
use bench_dragon_ipc::{Domain, DomainError, Instance};
use clap::{Args, ValueEnum, ValueHint};

use crate::recording::ShowInterval;
use crate::source::ExpectedReaders;

/// Format of the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Text for people.
    #[default]
    Text,
    /// JSON for programs, with stable keys.
    Json,
}

/// The flag that names the instance.
#[derive(Clone, Debug, Args)]
pub(crate) struct BusArgs {
    /// Name of the instance: 1 to 24 characters of a-z, 0-9 and -.
    #[arg(long, value_name = "NAME", default_value_t, value_parser = instance, global = true)]
    pub(crate) instance: Instance,
}

impl BusArgs {
    /// The bus of the instance.
    pub(crate) fn domain(&self) -> Result<Domain, DomainError> {
        Domain::new(self.instance.clone())
    }
}

/// The flag for readers that sleep by the clock.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct SpinArgs {
    /// Sleep by the clock until this many microseconds before each frame is due, then look for it in a busy loop, at most until as
    /// long after it; 0 to 1000. The server then need not wake this reader.
    #[arg(long, value_name = "MICROSECONDS", allow_negative_numbers = true, value_parser = within(0..=1000_u32))]
    pub(crate) spin_us: Option<u32>,
}

impl SpinArgs {
    /// Length of each half of the busy loop; `None` without the flag.
    pub(crate) fn spin(self) -> Option<Duration> {
        self.spin_us.map(|spin_us| Duration::from_micros(spin_us.into()))
    }
}

/// The flag for the output's format.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct FormatArgs {
    /// Format of the output.
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t, global = true)]
    pub(crate) format: Format,
}

/// The flag that names the configuration.
#[derive(Clone, Debug, Args)]
pub(crate) struct ConfigArgs {
    /// Configuration file, in TOML [default: the paper's dragon].
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
}

/// The flags that select frames of a recording by show time.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct IntervalArgs {
    /// Use only frames from this show time on, in seconds [default: the first].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = nanoseconds)]
    from: Option<i64>,
    /// Use only frames up to this show time, in seconds [default: the last].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = nanoseconds)]
    to: Option<i64>,
}

impl IntervalArgs {
    /// Returns the interval.
    ///
    /// # Errors
    /// An interval that ends before it begins.
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

/// The readers for which a source waits.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct ReaderArgs {
    /// Wait for this many connected readers, 0 to 24, before the first frame.
    #[arg(long, value_name = "COUNT", default_value_t = 0, allow_negative_numbers = true, value_parser = within(0..=MAX_READERS))]
    pub(crate) readers: usize,
    #[command(flatten)]
    pub(crate) wait: ReaderWaitArgs,
}

impl ReaderArgs {
    pub(crate) fn expected(self) -> ExpectedReaders {
        ExpectedReaders { count: self.readers, wait: Duration::from_secs(self.wait.reader_wait) }
    }
}

/// The longest wait for readers.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct ReaderWaitArgs {
    /// Longest time in seconds to wait for readers before the first frame, 0 to 25.
    #[arg(long, value_name = "SECONDS", default_value_t = 10, allow_negative_numbers = true, value_parser = within(0..=25_u64))]
    pub(crate) reader_wait: u64,
}

/// The flags of a process that `show` or `plan` starts.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct ChildArgs {
    /// End this process when its parent, the process with this id, ends.
    #[arg(long, value_name = "PID", hide = true, global = true)]
    pub(crate) parent: Option<u32>,
    /// Print the progress of a long answer as lines of stderr.
    #[arg(long, hide = true, global = true)]
    pub(crate) report_progress: bool,
}

/// An error in the arguments that only the subcommand itself, not the parser, can find.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct BadInput(pub(crate) String);

/// Greatest time for [`nanoseconds`], in seconds. Its nanoseconds, and some beyond, are exact integers in an `f64`.
const MAX_STEPPED_S: f64 = 1_000_000.0;

fn instance(name: &str) -> Result<Instance, String> {
    Instance::new(name).map_err(|_| format!("must be 1 to {} of a-z, 0-9 and -", Instance::MAX_LEN))
}

pub(crate) fn listen_address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| "must be an address and a port, as in 127.0.0.1:8223 or [::]:8223".to_owned())
}

pub(crate) fn finite(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| value.is_finite());
    // Adding 0 removes the sign of a negative zero, here and below.
    value.map(|value| value + 0.0).ok_or_else(|| "must be a finite number".to_owned())
}

/// Reads seconds with at most nine decimals. Returns them in nanoseconds.
pub(crate) fn nanoseconds(text: &str) -> Result<i64, String> {
    let refusal = || format!("must be from -{MAX_STEPPED_S} to {MAX_STEPPED_S}, with at most nine decimals");
    let value: f64 = text.parse().map_err(|_| refusal())?;
    let whole_ns = (value * 1e9).round();
    // Both operands are exact, so the quotient is rounded once, like a decimal that is parsed.
    let is_whole = value.abs() <= MAX_STEPPED_S && whole_ns / 1e9 == value;
    if is_whole { Ok(whole_ns as i64) } else { Err(refusal()) }
}

/// Reads a number within a range.
pub(crate) fn within<V>(allowed: RangeInclusive<V>) -> impl Fn(&str) -> Result<V, String> + Clone
where
    V: FromStr + PartialOrd + Display + Clone + Add<Output = V> + Default,
{
    move |text| {
        let value = text.parse().ok().filter(|value| allowed.contains(value));
        let unsigned = value.map(|value| value + V::default());
        unsigned.ok_or_else(|| format!("must be from {} to {}", allowed.start(), allowed.end()))
    }
}

/// Reads a count of at least 1.
pub(crate) fn count() -> impl Fn(&str) -> Result<u64, String> + Clone {
    within(1..=u64::MAX)
}

/// Reads a step between times, in seconds. Returns it in nanoseconds; `must_be` describes the allowed steps in the error.
pub(crate) fn step(text: &str, lowest_ns: i64, must_be: &str) -> Result<i64, String> {
    let step_ns = nanoseconds(text).ok().filter(|step_ns| *step_ns >= lowest_ns);
    step_ns.ok_or_else(|| format!("must be {must_be} {MAX_STEPPED_S}, with at most nine decimals"))
}
