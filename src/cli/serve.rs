//! `serve` and `show`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::value::{catch_up, cpu, finite, listen_address, priority, rate, readers, spin, time_scale};
use super::{BusArgs, ConfigArgs, FormatArgs, TimecodeArgs};
use crate::config::Priority;

/// How a server paces.
#[derive(Clone, Debug, Args)]
pub(crate) struct PaceArgs {
    /// Frames a second.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = rate)]
    pub(crate) rate: Option<u32>,
    /// Show seconds per wall-clock second, 0.001 to 1000.
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = time_scale)]
    pub(crate) time_scale: Option<f64>,
    /// Wall-clock seconds that a show jumps at once when releases were missed, 0 to 10; a longer standstill is made up slowly.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = catch_up)]
    pub(crate) catch_up: Option<f64>,
    /// Show time in seconds to start at [default: the run's start].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) start_at: Option<f64>,
    /// Show time in seconds to end at.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) until: Option<f64>,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArgs,
}

/// What a server asks of the kernel to keep its schedule.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct RealTimeArgs {
    /// Keep the server's loop on this processor.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = cpu)]
    pub(crate) cpu: Option<u32>,
    /// Run the server's loop as other, fifo:N or rr:N, N from 1 to 99, and lock its memory unless as other.
    #[arg(long, value_name = "POLICY", value_parser = priority)]
    pub(crate) priority: Option<Priority>,
    /// Microseconds before each release from which on the server's loop does not sleep but spins, 0 to 1000.
    #[arg(long, value_name = "MICROSECONDS", allow_negative_numbers = true, value_parser = spin)]
    pub(crate) spin_us: Option<u32>,
}

/// Arguments of `show`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ShowArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) pace: PaceArgs,
    #[command(flatten)]
    pub(crate) timecode: TimecodeArgs,
    /// Folder for the recording and summary.json, without those of an earlier show [default: show-DATE-TIME in the current folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    /// Let a restarted server walk on at once, instead of standing held until `ctl release`.
    #[arg(long)]
    pub(crate) auto_resume: bool,
    /// Keep benches from touching: the head rests before they would, and the show ends there.
    #[arg(long)]
    pub(crate) guard: bool,
    /// Exit with status 3 where benches touched.
    #[arg(long)]
    pub(crate) fail_on_contact: bool,
    /// Serve the page on which the show is seen and steered, and print its address; port 0 takes a free one.
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "127.0.0.1:8223",
        value_parser = listen_address
    )]
    pub(crate) view: Option<SocketAddr>,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of `serve`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) pace: PaceArgs,
    #[command(flatten)]
    pub(crate) timecode: TimecodeArgs,
    /// Stand held at the start, until `ctl release`.
    #[arg(long)]
    pub(crate) held: bool,
    /// Move the head only where `monitor --guard` has proved the way free.
    #[arg(long)]
    pub(crate) guarded: bool,
    /// Stand paused at the start, or once the hold is lifted.
    #[arg(long, hide = true)]
    pub(crate) paused: bool,
    /// Begin once this many readers are connected, after ten seconds at the latest.
    #[arg(long, value_name = "COUNT", default_value_t = 0, allow_negative_numbers = true, value_parser = readers)]
    pub(crate) readers: usize,
    /// Travel in metres to start at, where the speed was changed on the way.
    #[arg(long, value_name = "METRES", hide = true, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) start_travel: Option<f64>,
    /// Speed in m/s to start with, where it was changed on the way.
    #[arg(long, value_name = "MPS", hide = true, value_parser = finite)]
    pub(crate) start_speed: Option<f64>,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}
