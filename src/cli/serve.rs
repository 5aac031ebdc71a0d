//! `serve` and `show`, with the flags that they share.

use std::net::SocketAddr;
use std::path::PathBuf;

use bench_dragon_ipc::service::MAX_READERS;
use clap::{Args, ValueHint};

use super::flags::{BusArgs, ConfigArgs, FormatArgs, finite, listen_address, within};
use crate::config::{CATCH_UP_S, CPU, Priority, RATE_HZ, SPIN_US, TIME_SCALE};
use crate::source::timecode::{FrameRate, TimecodeSource};

/// How a server paces.
#[derive(Clone, Debug, Args)]
pub(crate) struct PaceArgs {
    /// Frames a second.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = within(RATE_HZ))]
    pub(crate) rate: Option<u32>,
    /// Show seconds per wall-clock second, 0.001 to 1000.
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = within(TIME_SCALE))]
    pub(crate) time_scale: Option<f64>,
    /// Wall-clock seconds that a show jumps at once when releases were missed, 0 to 10; a longer standstill is made up slowly.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = within(CATCH_UP_S))]
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
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = within(CPU))]
    pub(crate) cpu: Option<u32>,
    /// Run the server's loop as other, fifo:N or rr:N, N from 1 to 99, and lock its memory unless as other.
    #[arg(long, value_name = "POLICY")]
    pub(crate) priority: Option<Priority>,
    /// Microseconds before each release from which on the server's loop does not sleep but spins, 0 to 1000.
    #[arg(long, value_name = "MICROSECONDS", allow_negative_numbers = true, value_parser = within(SPIN_US))]
    pub(crate) spin_us: Option<u32>,
}

/// Which run is published, and how.
#[derive(Clone, Debug, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) pace: PaceArgs,
    #[command(flatten)]
    pub(crate) timecode: TimecodeArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct ShowArgs {
    #[command(flatten)]
    pub(crate) run: RunArgs,
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

#[derive(Clone, Debug, Args)]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    pub(crate) run: RunArgs,
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
    #[arg(long, value_name = "COUNT", default_value_t = 0, allow_negative_numbers = true, value_parser = within(0..=MAX_READERS))]
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

/// Which timecode to follow, and how.
#[derive(Clone, Debug, Args)]
pub(crate) struct TimecodeArgs {
    /// Follow timecode: osc:[ADDRESS:]PORT[/MESSAGE] or artnet[:ADDRESS[:PORT]]; this machine's without an address.
    #[arg(long = "timecode", value_name = "SOURCE")]
    pub(crate) source: Option<TimecodeSource>,
    /// Show time minus the timecode's position [default: 0].
    #[arg(long = "timecode-offset", value_name = "SECONDS", requires = "source", allow_negative_numbers = true, value_parser = within(-1e6..=1e6))]
    pub(crate) offset_s: Option<f64>,
    /// Silence after which a timecode is lost and the show goes on by itself [default: 1].
    #[arg(long = "timecode-timeout", value_name = "SECONDS", requires = "source", allow_negative_numbers = true, value_parser = within(0.1..=3600.0))]
    pub(crate) timeout_s: Option<f64>,
    /// Frames a second of OSC messages that do not tell: 24, 25, 29.97 (drop-frame) or 30 [default: 25].
    #[arg(long = "timecode-fps", value_name = "FPS", requires = "source", value_parser = frame_rate)]
    pub(crate) frame_rate: Option<FrameRate>,
}

fn frame_rate(text: &str) -> Result<FrameRate, String> {
    text.parse().ok().and_then(FrameRate::of).ok_or_else(|| "must be 24, 25, 29.97 or 30".to_owned())
}
