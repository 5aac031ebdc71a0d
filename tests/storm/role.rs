//! The roles that are killed, and how each shows that it gets on.

use serde_json::Value;

use crate::random::Random;

/// What a process does.
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

    /// The command that it runs.
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

    /// The arguments of its `turn`th process.
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

    /// Whether its processes end by themselves and others follow.
    pub(crate) fn is_brief(self) -> bool {
        matches!(self, Self::Latency | Self::Ctl)
    }

    /// The frames, answers or starts that a line tells of.
    pub(crate) fn progress(self, line: &str) -> u64 {
        let count = |name: &str| {
            let value = serde_json::from_str::<Value>(line).unwrap_or_else(|error| panic!("{error}: {line}"));
            value[name].as_u64().unwrap_or_default()
        };
        match self {
            Self::Serve => u64::from(line.contains("\"started\"")),
            // Its file tells.
            Self::Record => 0,
            Self::Echo | Self::Ctl => 1,
            // Its frames so far, in every line.
            Self::Monitor | Self::Hz | Self::Latency => count("frames"),
        }
    }
}

/// The name of a recorder's file.
pub(crate) fn recording(turn: usize) -> String {
    format!("recording-{turn}.mcap")
}

/// The run that a server or a frame tells of.
pub(crate) fn run_id(line: &str) -> Option<u64> {
    let (_, rest) = line.split_once("\"run_id\":")?;
    let digits = rest.find(|character: char| !character.is_ascii_digit()).unwrap_or(rest.len());
    rest[..digits].parse().ok()
}
