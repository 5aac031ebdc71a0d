//! What a recording holds: its topics, and their ROS 2 message definitions as any reader without our code needs them.
//!
//! A definition is the text of the message followed by the texts of all that it contains, the form that `rosbag2`
//! writes and MCAP calls `ros2msg`.

use std::{
    collections::BTreeMap,
    io::{Seek, Write},
};

use mcap::{McapResult, Writer};

/// Topic of the frames, every one of them.
pub const FRAMES: &str = "/dragon/frames";
/// Topic of the bench poses, for the viewers.
pub const POSES: &str = "/dragon/poses";
/// Topic of the alerts.
pub const ALERTS: &str = "/dragon/alerts";
/// Topic of the record of commands.
pub const COMMANDS: &str = "/dragon/commands";

/// Name of the metadata record that carries the configuration: `run_id` and `toml`.
pub const CONFIGURATION: &str = "bench_dragon.configuration";
/// The MCAP profile: ROS 2 messages.
pub const PROFILE: &str = "ros2";
/// The MCAP library name by which a recording is known as ours.
pub const LIBRARY: &str = concat!("bench-dragon/", env!("CARGO_PKG_VERSION"));
/// What [`LIBRARY`] begins with in every version.
pub const LIBRARY_FAMILY: &str = "bench-dragon";

/// What a message is. A topic's place in [`Topic::ALL`] decides on the number of its channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topic {
    Frames,
    Poses,
    Alerts,
    Commands,
}

impl Topic {
    /// New topics come last: readers of damaged files rely on the numbers.
    const ALL: [Self; 4] = [Self::Frames, Self::Poses, Self::Alerts, Self::Commands];

    /// The topic of a name; `None` where it is none of ours.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|topic| topic.texts()[0] == name)
    }

    /// Name of the topic, name of its message type, and that type's full definition.
    const fn texts(self) -> [&'static str; 3] {
        match self {
            Self::Frames => [FRAMES, "bench_dragon_msgs/msg/Frame", FRAME],
            Self::Poses => [POSES, "geometry_msgs/msg/PoseArray", POSE_ARRAY],
            Self::Alerts => [ALERTS, "bench_dragon_msgs/msg/Alert", ALERT],
            Self::Commands => [COMMANDS, "bench_dragon_msgs/msg/CommandEvent", COMMAND_EVENT],
        }
    }
}

/// The numbers of a file's channels, one for each topic.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channels([u16; Topic::ALL.len()]);

impl Channels {
    /// Declares all channels in a file.
    pub(super) fn declare<W: Write + Seek>(writer: &mut Writer<W>) -> McapResult<Self> {
        let mut numbers = [0; Topic::ALL.len()];
        for topic in Topic::ALL {
            let [name, message, definition] = topic.texts();
            let schema = writer.add_schema(message, "ros2msg", definition.as_bytes())?;
            numbers[topic as usize] = writer.add_channel(schema, name, "cdr", &BTreeMap::new())?;
        }
        Ok(Self(numbers))
    }

    /// The channel of a topic.
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
# One hinge: where it is, and its velocity in metres per show second.
float64[3] position_m
float64[3] velocity_mps
";

const ALERT: &str = "\
# What the monitor has seen. Times are nanoseconds of show time.
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
# A command to the source with its outcome, or the start or the end of a run. A run's events are numbered from 0 without a hole.
# tick: from which an accepted command holds, or at which it was refused. sim_time_ns: show time at which it was taken.
# wall_ns: nanoseconds since 1970-01-01 00:00 UTC. overruns: releases missed in the run before that tick.
# values, by kind: 2 speed m/s; 3 seek s; 7 grant from m, to m; 8 and 9 whether timecode leads, time scale;
# 10 start s, travel m, speed m/s, end s (NaN: none).
# kind: 0 pause, 1 resume, 2 speed, 3 seek, 4 hold, 5 release, 6 stop, 7 grant, 8 stand, 9 follow, 10 start, 11 end.
# sender: 0 client, 1 ctl, 2 page, 3 watch, 4 zenoh, 5 timecode, 6 guard, 7 signal, 8 server. pid: 0 where not known.
# refusal: 0 where accepted, else the number of the reason; lowest and highest: the range of a refused value.
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
