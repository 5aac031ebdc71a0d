//! The source of timecode as text: a protocol of the network, or sound.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use bench_dragon_ipc::TimecodeKind;

use super::TimecodeSource;

/// A source of timecode.
///
/// ```
/// use bench_dragon::source::timecode::{LtcInput, TimecodeInput};
///
/// assert_eq!("ltc:-".parse(), Ok(TimecodeInput::Ltc(LtcInput::Stdin)));
/// assert_eq!("ltc:night.wav".parse(), Ok(TimecodeInput::Ltc(LtcInput::File("night.wav".into()))));
/// let input: TimecodeInput = "artnet".parse()?;
/// assert_eq!(input.to_string(), "artnet:127.0.0.1:6454");
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TimecodeInput {
    /// A protocol of the network.
    Network(TimecodeSource),
    /// Linear timecode, as sound in WAV.
    Ltc(LtcInput),
}

/// Where the sound comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LtcInput {
    /// Standard input.
    Stdin,
    /// A file, which is played at its own pace.
    File(PathBuf),
}

impl TimecodeInput {
    /// Protocol of the timecode, for the status.
    pub fn kind(&self) -> TimecodeKind {
        match self {
            Self::Network(source) => source.kind(),
            Self::Ltc(_) => TimecodeKind::Ltc,
        }
    }
}

impl FromStr for TimecodeInput {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_prefix("ltc:") {
            Some("") => Err("must be ltc:- for stdin, or ltc:FILE.wav".to_owned()),
            Some("-") => Ok(Self::Ltc(LtcInput::Stdin)),
            Some(path) => Ok(Self::Ltc(LtcInput::File(path.into()))),
            None => {
                text.parse().map(Self::Network).map_err(|forms: String| format!("{forms}, or ltc:- or ltc:FILE.wav"))
            }
        }
    }
}

impl fmt::Display for TimecodeInput {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Network(source) => source.fmt(formatter),
            Self::Ltc(input) => write!(formatter, "ltc:{input}"),
        }
    }
}

impl fmt::Display for LtcInput {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stdin => formatter.pad("-"),
            Self::File(path) => path.display().fmt(formatter),
        }
    }
}
