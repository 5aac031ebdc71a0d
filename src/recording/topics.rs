//! Topics of a recording, and the ROS 2 definitions of their messages for readers without our code. Also the recorded types of
//! the bus.
//!
//! A definition is the text of the message, followed by the texts of all messages that it contains. `rosbag2` writes this form,
//! and MCAP calls it `ros2msg`.
//!
//! **To add a topic** for a type of the bus, add a [`Topic`] with its texts, a variant of [`Recorded`] for reading it back, and
//! the conversion of the type into a [`Message`]. Then subscribe to it in the command `record`, and pass each message to
//! `Recorder::record`.

use std::{
    collections::BTreeMap,
    io::{Seek, Write},
};

use bench_dragon_ipc::{Alert, CommandEvent, FrameHeader, HandleState, IntoBytes as _};
use mcap::{McapResult, Writer};

use super::cdr;

/// Name of the metadata record that carries the configuration: `run_id` and `toml`.
pub(super) const CONFIGURATION: &str = "bench_dragon.configuration";
/// The MCAP profile: ROS 2 messages.
pub(super) const PROFILE: &str = "ros2";
/// The MCAP library name that identifies our recordings.
pub(super) const LIBRARY: &str = concat!("bench-dragon/", env!("CARGO_PKG_VERSION"));
/// Prefix of [`LIBRARY`] in every version.
pub(super) const LIBRARY_FAMILY: &str = "bench-dragon";

/// Topic of a recorded message. A topic's index in `Topic::ALL` decides the number of its channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// All frames.
    Frames,
    /// The poses of the benches, for viewers.
    Poses,
    /// The alerts.
    Alerts,
    /// The record of commands.
    Commands,
}

impl Topic {
    /// Add new topics at the end: readers of damaged files rely on the numbers.
    const ALL: [Self; 4] = [Self::Frames, Self::Poses, Self::Alerts, Self::Commands];

    /// Name of the topic, name of its message type, and full definition of that type.
    const fn texts(self) -> [&'static str; 3] {
        match self {
            Self::Frames => ["/dragon/frames", "bench_dragon_msgs/msg/Frame", FRAME],
            Self::Poses => ["/dragon/poses", "geometry_msgs/msg/PoseArray", POSE_ARRAY],
            Self::Alerts => ["/dragon/alerts", "bench_dragon_msgs/msg/Alert", ALERT],
            Self::Commands => ["/dragon/commands", "bench_dragon_msgs/msg/CommandEvent", COMMAND_EVENT],
        }
    }

    /// Reads a message of the bus back, bit for bit. `None` for a message of another version, and for topics that have no
    /// message of the bus.
    pub(super) fn read(self, message: &[u8]) -> Option<Recorded> {
        match self {
            Self::Frames | Self::Poses => None,
            Self::Alerts => cdr::decode(message).map(Recorded::Alert),
            Self::Commands => cdr::decode(message).map(Recorded::Command),
        }
    }

    /// The name of the topic.
    pub const fn name(self) -> &'static str {
        self.texts()[0]
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
    Alert(Alert),
    /// An event of the record of commands. It may follow the frame of its tick.
    Command(CommandEvent),
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

/// The numbers of a file's channels, one for each topic.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channels([u16; Topic::ALL.len()]);

impl Channels {
    pub(super) fn declare<W: Write + Seek>(writer: &mut Writer<W>) -> McapResult<Self> {
        let mut numbers = [0; Topic::ALL.len()];
        for topic in Topic::ALL {
            let [name, message, definition] = topic.texts();
            let schema = writer.add_schema(message, "ros2msg", definition.as_bytes())?;
            numbers[topic as usize] = writer.add_channel(schema, name, "cdr", &BTreeMap::new())?;
        }
        Ok(Self(numbers))
    }

    pub(super) fn of(self, topic: Topic) -> u16 {
        self.0[topic as usize]
    }
}

const FRAME: &str = "\
# The dragon at one tick. Times are nanoseconds: show time, or CLOCK_MONOTONIC of the recording machine.
uint64 run_id
uint64 tick
int64 sim_time_ns
uint64 scheduled_ns
uint64 published_ns
float64 head_travel_m
float64 head_speed_mps
float64 time_scale
uint32 bench_count
uint32 state
HandleState[] handles
================================================================================
MSG: bench_dragon_msgs/HandleState
# One handle: its position in metres, and its velocity in metres per show second.
float64[3] position_m
float64[3] velocity_mps
";

const ALERT: &str = "\
# An observation of the monitor. Times are nanoseconds of show time.
uint64 run_id
uint64 tick
int64 sim_time_ns
int64 forecast_ns
float64 clearance_m
float64[2] point_m
uint32 kind
uint32 bench_a
uint32 bench_b
uint32 reserved
";

const COMMAND_EVENT: &str = "\
# A command to the source with its outcome, or the start or end of a run. The events of a run are numbered from 0 without a gap.
# tick: first tick of an accepted command, or tick at which it was refused. sim_time_ns: show time at which the source took it.
# wall_ns: nanoseconds since 1970-01-01 00:00 UTC. overruns: releases missed in the run before that tick.
# values, by kind: 2 speed m/s; 3 seek s; 7 grant from m, to m; 8 and 9 whether timecode leads, time scale;
# 10 start s, travel m, speed m/s, end s (NaN: none).
# kind: 0 pause, 1 resume, 2 speed, 3 seek, 4 hold, 5 release, 6 stop, 7 grant, 8 stand, 9 follow, 10 start, 11 end.
# sender: 0 client, 1 ctl, 2 page, 3 watch, 4 zenoh, 5 timecode, 6 guard, 7 signal, 8 server. pid: 0 where not known.
# refusal: 0 if accepted, else the number of the reason. lowest, highest: allowed range of a refused value.
# flags: of a grant bit 0 final; of a start bit 0 held, 1 paused, 2 guarded, 3 follows timecode.
uint64 run_id
uint64 number
uint64 tick
int64 sim_time_ns
int64 wall_ns
uint64 overruns
float64[4] values
float64 lowest
float64 highest
uint32 kind
uint32 sender
uint32 pid
uint32 refusal
uint32 flags
uint32 reserved
";

const POSE_ARRAY: &str = "\
std_msgs/Header header
geometry_msgs/Pose[] poses
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
";
