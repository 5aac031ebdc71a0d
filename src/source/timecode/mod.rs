//! Timecode: the clock of another machine, which a show follows.
//!
//! A *timecode* is a position that a desk, a sequencer or a player sends over the network about 25 times a second. A
//! [`TimecodeReceiver`] reads it from a socket on a separate thread and decodes it ([`art_net`], [`osc`]). A
//! [`LtcReceiver`](ltc::LtcReceiver) reads it as sound. Both put the samples into a [`SampleQueue`], from which the
//! server's loop takes them without waiting. At each tick a [`Follower`] decides the response of the show.
//!
//! **Contract.** Show time is the timecode's position plus an offset. A show stands until the first timecode, then
//! seeks that position. From then on only the time scale changes, between [`Follower::LEAST_TIME_SCALE`] and
//! [`Follower::GREATEST_TIME_SCALE`]; every tick advances show time by `time_scale / rate`. So show time jumps or goes
//! back only by a seek.
//!
//! **Seeks.** A difference of more than half a second leads to a seek. The seek is handled as a client's: a guarded
//! server refuses it until its travel is proved, and the follower retries it.
//!
//! **Midnight.** Positions repeat every day. The follower uses the day whose show time is nearest to the run, so a show
//! may pass midnight.
//!
//! **Confirmation.** A single stray packet has no effect. The follower accepts the first position, and any unexpected
//! one, only when the next position agrees with it.
//!
//! **Senders.** The receiver follows the first sender until its silence exceeds the timeout, and counts the packets of
//! others. A timecode that repeats a position stands, and the show stands with it. After a silence the timecode is
//! lost: the show reports it and continues at its own pace, unless it stood. An operator's pause and hold always take
//! precedence.
//!
//! **Hostile packets** are counted and dropped: malformed ones, those of other senders, and floods.

pub mod art_net;
pub mod ltc;
pub mod osc;

mod clock;
mod follower;
mod input;
mod packet_filter;
mod receiver;
mod source;

pub use clock::{Clock, FrameRate, Position};
pub use follower::{Follower, FollowerEvent, FollowerOrder, FollowerSettings, ShowPosition};
pub use input::{LtcInput, TimecodeInput};
pub use packet_filter::SenderLock;
pub use receiver::{ReceiverError, SampleQueue, TimecodeCounts, TimecodeReceiver};
pub use source::TimecodeSource;

/// A position with the instant of its arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimecodeSample {
    /// The timecode's position.
    pub position: Position,
    /// Instant of `CLOCK_MONOTONIC` at which it arrived, in nanoseconds.
    pub arrived_ns: u64,
}

/// Error of a packet that should contain a timecode and does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Malformed;
