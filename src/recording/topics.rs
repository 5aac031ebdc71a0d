//! Topics of a recording, and the recorded types of the bus.
//!
//! **To add a topic** for a type of the bus, add a [`Topic`] with its name and [`Definition`], a variant of [`Recorded`] for
//! reading it back, and the conversion of the type into a [`Message`]. Then subscribe to it in the command `record`, and pass
//! each message to `Recorder::record`.

use std::{
    collections::BTreeMap,
    io::{Seek, Write},
};

use bench_dragon_ipc::{Alert, CommandEvent, FrameHeader, HandleState, IntoBytes as _, dragon_names};
use mcap::{McapResult, Writer};

use super::{
    cdr,
    definitions::{
        ALERT, COMMAND_EVENT, Definition, FORMATION_FRAME, FRAME, MARKER_ARRAY, POSE_ARRAY, SCENE_UPDATE, TRANSFORMS,
    },
};

/// Name of the metadata record that carries the configuration: `run_id` and `toml`.
pub(super) const CONFIGURATION: &str = "bench_dragon.configuration";
/// The MCAP profile: ROS 2 messages.
pub(super) const PROFILE: &str = "ros2";
/// The MCAP library name that identifies our recordings.
pub(super) const LIBRARY: &str = concat!("bench-dragon/", env!("CARGO_PKG_VERSION"));
/// Prefix of [`LIBRARY`] in every version.
pub(super) const LIBRARY_FAMILY: &str = "bench-dragon";

/// Topic of a recorded message. A topic's index in `Topic::ALL` decides the order of the channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// All frames.
    Frames,
    /// The poses of the benches, for viewers: a topic for each dragon of a plan.
    Poses,
    /// The alerts.
    Alerts,
    /// The record of commands.
    Commands,
    /// The benches as frames of reference, for viewers.
    Transforms,
    /// The boards, for Foxglove and Lichtblick.
    Boards,
    /// The boards, for `rviz` and every other viewer of ROS.
    Markers,
}

impl Topic {
    /// Add new topics at the end: readers of damaged files rely on the numbers.
    const ALL: [Self; 7] =
        [Self::Frames, Self::Poses, Self::Alerts, Self::Commands, Self::Transforms, Self::Boards, Self::Markers];

    /// Name of the topic, and definition of its messages.
    const fn declaration(self) -> (&'static str, Definition) {
        match self {
            Self::Frames => ("/dragon/frames", FRAME),
            Self::Poses => ("/dragon/poses", POSE_ARRAY),
            Self::Alerts => ("/dragon/alerts", ALERT),
            Self::Commands => ("/dragon/commands", COMMAND_EVENT),
            // Viewers look for frames of reference on this topic only.
            Self::Transforms => ("/tf", TRANSFORMS),
            Self::Boards => ("/dragon/boards", SCENE_UPDATE),
            Self::Markers => ("/dragon/markers", MARKER_ARRAY),
        }
    }

    /// Reads a message of the bus back, bit for bit. `None` for a message of another version, and for topics that have no
    /// message of the bus.
    pub(super) fn read(self, log_time_ns: u64, message: &[u8]) -> Option<Recorded> {
        match self {
            Self::Frames | Self::Poses | Self::Transforms | Self::Boards | Self::Markers => None,
            Self::Alerts => cdr::decode(message).map(|alert| Recorded::Alert(RecordedAlert { log_time_ns, alert })),
            Self::Commands => cdr::decode(message).map(Recorded::Command),
        }
    }

    /// The name of the topic.
    pub const fn name(self) -> &'static str {
        self.declaration().0
    }

    /// Name and definition of the type of the topic's messages.
    pub fn schema(self) -> (&'static str, String) {
        let (_, definition) = self.declaration();
        (definition.name, definition.full_text())
    }

    /// Name of the topic with the poses of one dragon of a plan.
    pub fn poses_of(dragon: &str) -> String {
        format!("/dragon/{dragon}/poses")
    }

    /// The topic with a name; `None` for a foreign name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }
}

/// A message in its recorded form.
#[derive(Clone, Debug)]
pub struct Message {
    /// The topic.
    pub topic: Topic,
    /// Number of the message. Its low 32 bits become the sequence number.
    pub number: u64,
    /// Publish time: Unix time at which the message was sent, in nanoseconds. `None`: the publish time equals the log time.
    pub sent_ns: Option<i64>,
    /// Bytes of the fields in the order of the topic's definition. A type of the bus has the same order in shared memory.
    pub fields: Vec<u8>,
}

impl From<&Alert> for Message {
    fn from(alert: &Alert) -> Self {
        Self { topic: Topic::Alerts, number: alert.tick, sent_ns: None, fields: alert.as_bytes().to_vec() }
    }
}

impl From<&CommandEvent> for Message {
    fn from(event: &CommandEvent) -> Self {
        let (number, sent_ns, fields) = (event.number, Some(event.wall_ns), event.as_bytes().to_vec());
        Self { topic: Topic::Commands, number, sent_ns, fields }
    }
}

/// An item of a recording: a frame, or a message between frames.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Recorded {
    /// A frame.
    Frame(RecordedFrame),
    /// An alert.
    Alert(RecordedAlert),
    /// An event of the record of commands. It may follow the frame of its tick.
    Command(CommandEvent),
}

/// An alert as it was on the bus, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedAlert {
    /// Unix time at which the recorder received the alert, in nanoseconds.
    pub log_time_ns: u64,
    /// The alert.
    pub alert: Alert,
}

/// A frame as it was on the bus, bit for bit.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// Unix time at which the frame was sent, in nanoseconds.
    pub log_time_ns: u64,
    /// State of the whole dragon.
    pub header: FrameHeader,
    /// The handles.
    pub handles: Vec<HandleState>,
}

/// Number of messages of each topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct MessageCounts([u64; Topic::ALL.len()]);

impl MessageCounts {
    pub(super) fn of(self, topic: Topic) -> u64 {
        self.0[topic as usize]
    }

    pub(super) fn count(&mut self, topic: Topic) {
        self.0[topic as usize] += 1;
    }

    pub(super) fn add(&mut self, Self(others): Self) {
        self.0.iter_mut().zip(others).for_each(|(count, other)| *count += other);
    }
}

/// Names of the dragons whose channels a description needs: none for the short form for one dragon. With cues, that dragon has the
/// frames of a plan, and a number as its name.
pub fn channel_names(toml: &str) -> Vec<String> {
    let names = dragon_names(toml);
    if names.is_empty() && toml.lines().any(|line| line == "[[cues]]") {
        return vec!["1".to_owned()];
    }
    names.into_iter().map(str::to_owned).collect()
}

/// The numbers of a file's channels: one for each topic; of a plan, one for the poses of each dragon.
#[derive(Clone, Debug)]
pub(super) struct Channels {
    numbers: [u16; Topic::ALL.len()],
    poses: Vec<u16>,
}

impl Channels {
    /// Declares the channels of a plan of dragons with these names; without names, those of the short form for one dragon.
    pub(super) fn declare<W: Write + Seek>(writer: &mut Writer<W>, dragons: &[String]) -> McapResult<Self> {
        let mut add = |name: &str, definition: &Definition| {
            let schema = writer.add_schema(definition.name, "ros2msg", definition.full_text().as_bytes())?;
            writer.add_channel(schema, name, "cdr", &BTreeMap::new())
        };
        let (mut numbers, mut poses) = ([0; Topic::ALL.len()], Vec::new());
        for topic in Topic::ALL {
            let (name, definition) = topic.declaration();
            match topic {
                Topic::Poses if !dragons.is_empty() => {
                    for dragon in dragons {
                        poses.push(add(&Topic::poses_of(dragon), &definition)?);
                    }
                }
                Topic::Frames if !dragons.is_empty() => numbers[topic as usize] = add(name, &FORMATION_FRAME)?,
                _ => numbers[topic as usize] = add(name, &definition)?,
            }
        }
        if dragons.is_empty() {
            poses.push(numbers[Topic::Poses as usize]);
        }
        Ok(Self { numbers, poses })
    }

    /// The channel of a topic; of the poses, that of a dragon.
    pub(super) fn of(&self, topic: Topic, dragon: usize) -> u16 {
        match topic {
            Topic::Poses => self.poses[dragon],
            _ => self.numbers[topic as usize],
        }
    }
}
