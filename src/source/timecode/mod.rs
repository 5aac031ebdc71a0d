//! Timecode: the clock of another machine, which a show follows.
//!
//! A *timecode* is a position that a desk, a sequencer or a player sends over the network some 25 times a second. A
//! [`TimecodeReceiver`] takes it off a socket on a thread of its own, decodes it ([`art_net`], [`osc`]) and leaves the newest one
//! in an [`SampleQueue`], where the server's loop takes it without waiting for anybody. From tick to tick a [`Follower`] says what the show is to do about it.
//!
//! **The contract.** Show time is the timecode's position plus an offset. A show stands until the first timecode, then is
//! repositioned there. From then on it follows by its pace: every tick advances show time by `time_scale / rate`, and what
//! changes is the time scale, between [`Follower::LEAST_TIME_SCALE`] and [`Follower::GREATEST_TIME_SCALE`]; so show time
//! never jumps, and never goes back, but by a seek. A seek makes good a difference of more than half a second. It goes the way
//! of a client's, so a guard refuses what is not proved, and it is tried again. Of the positions that are a day apart, that of
//! a timecode is the one nearest to the run, so a show may pass midnight.
//!
//! **Two agree.** One packet that is astray moves nothing: the first position, and any that is not where the timecode should be by
//! then, are believed when the next one agrees with them.
//!
//! **Who sends.** The first sender that is heard is followed until it has been silent for long enough to be lost; others are
//! counted. A sender that repeats a position stands, and the show with it. One that falls silent is lost: the show goes on at
//! its own pace, unless it stood, and says so. An operator's pause and hold come first, always.
//!
//! **What is hostile** is counted and dropped: what is malformed, what comes from others, what comes too fast.

pub mod art_net;
pub mod osc;

mod clock;
mod follower;
mod packet_filter;
mod receiver;
mod source;

pub use clock::{Clock, FrameRate, Position};
pub use follower::{Follower, FollowerEvent, FollowerOrder, FollowerSettings, ShowPosition};
pub use packet_filter::SenderLock;
pub use receiver::{ReceiverError, SampleQueue, TimecodeCounts, TimecodeReceiver};
pub use source::TimecodeSource;

/// A position that arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimecodeSample {
    /// The timecode's position.
    pub position: Position,
    /// Instant of `CLOCK_MONOTONIC` at which it arrived, in nanoseconds.
    pub arrived_ns: u64,
}

/// That a packet which should be a timecode is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Malformed;
