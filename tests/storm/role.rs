//! The roles of the storm, and their signs of progress.

use serde_json::Value;

use crate::random::Random;

/// The role of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Role {
    Serve,
    Monitor,
    Record,
    Echo,
    Hz,
    Latency,
    Ctl,
}

impl Role {
    pub(crate) const ALL: [Self; 7] =
        [Self::Serve, Self::Monitor, Self::Record, Self::Echo, Self::Hz, Self::Latency, Self::Ctl];

    /// The command of the role.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Serve => "serve",
            Self::Monitor => "monitor",
            Self::Record => "record",
            Self::Echo => "echo",
            Self::Hz => "hz",
            Self::Latency => "latency",
            Self::Ctl => "ctl",
        }
    }

    /// Returns the arguments of the process with this number.
    pub(crate) fn arguments(self, turn: usize, random: &mut Random) -> Vec<String> {
        let text = match self {
            Self::Serve => "serve --rate 200 --format json",
            Self::Monitor => "monitor --progress 0.02 --format json",
            Self::Record => return vec!["record".into(), recording(turn), "--format".into(), "json".into()],
            Self::Echo => "echo --format json",
            Self::Hz => "hz --format json",
            Self::Latency => "latency --seconds 0.1 --format json",
            Self::Ctl => random.pick(&[
                "ctl pause --format json",
                "ctl resume --format json",
                "ctl speed 0.5 --format json",
                "ctl hold --format json",
                "ctl release --format json",
            ]),
        };
        text.split(' ').map(str::to_owned).collect()
    }

    /// Whether processes of the role end by themselves and are followed by others.
    pub(crate) fn is_brief(self) -> bool {
        matches!(self, Self::Latency | Self::Ctl)
    }

    /// Returns the frames, replies or starts that a line reports.
    pub(crate) fn progress(self, line: &str) -> u64 {
        let count = |name: &str| {
            let value = serde_json::from_str::<Value>(line).unwrap_or_else(|error| panic!("{error}: {line}"));
            value[name].as_u64().unwrap_or_default()
        };
        match self {
            Self::Serve => u64::from(line.contains("\"started\"")),
            // The size of its file is its progress.
            Self::Record => 0,
            Self::Echo | Self::Ctl => 1,
            // Each line has the number of frames so far.
            Self::Monitor | Self::Hz | Self::Latency => count("frames"),
        }
    }
}

/// Returns the name of a recorder's file.
pub(crate) fn recording(turn: usize) -> String {
    format!("recording-{turn}.mcap")
}

/// Returns the run id in a line of a server or a reader.
pub(crate) fn run_id(line: &str) -> Option<u64> {
    let (_, rest) = line.split_once("\"run_id\":")?;
    let digits = rest.find(|character: char| !character.is_ascii_digit()).unwrap_or(rest.len());
    rest[..digits].parse().ok()
}
