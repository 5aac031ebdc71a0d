//! The arguments of timecode.

use clap::Args;

use super::value::within;
use crate::source::timecode::{FrameRate, TimecodeSource};

/// Which timecode to follow, and how.
#[derive(Clone, Debug, Args)]
pub(crate) struct TimecodeArgs {
    /// Follow timecode: osc:[ADDRESS:]PORT[/MESSAGE] or artnet[:ADDRESS[:PORT]]; this machine's without an address.
    #[arg(long = "timecode", value_name = "SOURCE")]
    pub(crate) source: Option<TimecodeSource>,
    /// Show time minus the timecode's position [default: 0].
    #[arg(
        long = "timecode-offset",
        value_name = "SECONDS",
        requires = "source",
        allow_negative_numbers = true,
        value_parser = offset
    )]
    pub(crate) offset_s: Option<f64>,
    /// Silence after which a timecode is lost and the show goes on by itself [default: 1].
    #[arg(
        long = "timecode-timeout",
        value_name = "SECONDS",
        requires = "source",
        allow_negative_numbers = true,
        value_parser = timeout
    )]
    pub(crate) timeout_s: Option<f64>,
    /// Frames a second of OSC messages that do not tell: 24, 25, 29.97 (drop-frame) or 30 [default: 25].
    #[arg(long = "timecode-fps", value_name = "FPS", requires = "source", value_parser = frame_rate)]
    pub(crate) frame_rate: Option<FrameRate>,
}

fn offset(text: &str) -> Result<f64, String> {
    within(text, &(-1_000_000.0..=1_000_000.0))
}

fn timeout(text: &str) -> Result<f64, String> {
    within(text, &(0.1..=3600.0))
}

fn frame_rate(text: &str) -> Result<FrameRate, String> {
    text.parse().ok().and_then(FrameRate::of).ok_or_else(|| "must be 24, 25, 29.97 or 30".to_owned())
}
