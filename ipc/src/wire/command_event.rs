//! Events of commands, with sender and outcome: the `bench-dragon/command-events` service.
//!
//! The events of a run are a complete record. The first is the start of the run. Every command follows in the order in
//! which the source handled it, with the tick from which it holds or at which it was refused. A simulation that receives
//! the accepted commands at the same ticks produces the same frames, bit for bit.

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use super::command::{Command, CommandReply, Refusal, Request, Sender};
use super::wire_enum::wire_enum;

/// One event: a command and its outcome, or the start or the end of the run.
///
/// 120 bytes, no padding. Use [`CommandEvent::event_kind`], [`CommandEvent::sent_by`] and [`CommandEvent::outcome`] to read
/// the coded fields.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.CommandEvent.v1")]
pub struct CommandEvent {
    /// Run of the source.
    pub run_id: u64,
    /// Number of the event in its run, from 0, without a gap. A jump means that this reader lost events.
    pub number: u64,
    /// Tick from which an accepted command holds; for a refused command, the tick at which it was refused.
    pub tick: u64,
    /// Show time of the event, at the start of its tick, in nanoseconds.
    pub show_time_ns: i64,
    /// Wall-clock time of the event: nanoseconds since 1970-01-01 00:00 UTC.
    pub wall_ns: i64,
    /// Number of periods that the run missed before this tick.
    pub overruns: u64,
    /// Values of the command in their order; 0 for unused ones. For the third of a speed and of a pace, see
    /// [`CommandEvent::ordered_mps`]; for a start, see [`RunStart`].
    pub values: [f64; 4],
    /// Least allowed value, where a value was out of range.
    pub lowest: f64,
    /// Greatest allowed value, where a value was out of range.
    pub highest: f64,
    /// An [`EventKind`] as its number.
    pub kind: u32,
    /// A [`Sender`] as its number.
    pub sender: u32,
    /// Process id of the sender; 0 if unknown.
    pub pid: u32,
    /// 0 where the command was accepted, else a [`Refusal`] as its number.
    pub refusal: u32,
    /// For a grant, bit 0: the grant is final. For a start, see [`RunStart`]. Else 0.
    pub flags: u32,
    /// Always 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<CommandEvent>() == 120 && align_of::<CommandEvent>() == 8);

wire_enum! {
    /// Kind of an event.
    #[derive(Eq, Hash)]
    EventKind {
        /// Stop walking until `resume`.
        Pause = 0, "pause";
        /// Walk on after `pause`.
        Resume = 1, "resume";
        /// Walk at this speed of the head, in metres per show second, 0 to 10.
        Speed = 2, "speed";
        /// Seek to this show time, in seconds.
        Seek = 3, "seek";
        /// Stop for safety. Only `release` lifts the hold.
        Hold = 4, "hold";
        /// Lift a hold, or start a show that is ready.
        Release = 5, "release";
        /// End the server. The head comes to rest first, and the last frame of the run has the state `ended`.
        Stop = 6, "stop";
        /// The guard has proved a travel, from the first to the second value in metres.
        Grant = 7, "grant";
        /// The timecode that the server follows makes the show stand still. First value: 1 if the timecode determines the
        /// show time, else 0. Second value: the time scale.
        Stand = 8, "stand";
        /// The timecode makes the show run on. Values as for `stand`.
        Follow = 9, "follow";
        /// The run begins. This is always the first event.
        Start = 10, "start";
        /// The run has ended in order. This is the last event, at the last tick of the run.
        End = 11, "end";
        /// Play at this pace: plan time per show time. A replay does not record the commands that it takes.
        Pace = 12, "pace";
        /// Walk on from a cue that waits.
        Go = 13, "go";
        /// The show has reached a cue, by walking or by a seek to it. First value: its number in the configuration, from 0. Second
        /// value: its plan time in seconds.
        Cue = 14, "cue";
    }
}

impl EventKind {
    /// The kinds of commands that clients send.
    pub const OF_CLIENTS: [Self; 9] = [
        Self::Pause,
        Self::Resume,
        Self::Speed,
        Self::Seek,
        Self::Hold,
        Self::Release,
        Self::Stop,
        Self::Pace,
        Self::Go,
    ];

    /// Identifiers, numbers and meanings of these, from which their forms in other languages are generated.
    #[doc(hidden)]
    pub fn meanings_of_clients() -> Vec<(&'static str, u32, &'static str)> {
        let is_sent =
            |(_, number, _): &(&str, u32, &str)| Self::OF_CLIENTS.iter().any(|kind| kind.to_wire() == *number);
        Self::MEANINGS.into_iter().filter(is_sent).collect()
    }
}

impl CommandEvent {
    /// Kind of an event for a command that the source does not support.
    pub const UNKNOWN_KIND: u32 = u32::MAX;

    /// Returns the event of a command and its reply. The source adds the run, the number and the times.
    pub fn answered(command: &Command, reply: &CommandReply) -> Self {
        let [first, second] = command.values;
        let is_known = Request::from_wire(command).is_some();
        Self {
            tick: reply.tick,
            values: [first, second, 0.0, 0.0],
            lowest: reply.lowest,
            highest: reply.highest,
            kind: if is_known { command.kind } else { Self::UNKNOWN_KIND },
            sender: command.sender,
            pid: command.pid,
            refusal: reply.refusal,
            flags: command.flags,
            ..Self::default()
        }
    }

    /// The same event with the speed along the course that the head walks at from now on, if nothing stops it. Only an accepted `speed`
    /// and `pace` record it.
    #[must_use]
    pub fn ordering(mut self, course_mps: f64) -> Self {
        let orders = matches!(self.event_kind(), Some(EventKind::Speed | EventKind::Pace)) && self.refusal == 0;
        if orders {
            self.values[2] = course_mps;
        }
        self
    }

    /// The speed along the course that an event orders, in metres per show second: that of a start, and of an accepted `speed` or `pace`.
    /// `None` for other events.
    pub fn ordered_mps(&self) -> Option<f64> {
        let [value, _, course_mps, _] = self.values;
        let kind = self.event_kind()?;
        let orders = matches!(kind, EventKind::Start | EventKind::Speed | EventKind::Pace) && self.refusal == 0;
        match kind {
            // Earlier versions recorded 0 here.
            EventKind::Speed if orders && course_mps == 0.0 => Some(value),
            EventKind::Pace if course_mps == 0.0 && value != 0.0 => None,
            _ => orders.then_some(course_mps),
        }
    }

    /// Returns the event of an action that the source takes by itself. The source adds the run, the number and the times.
    pub fn plain(kind: EventKind, sender: Sender, tick: u64) -> Self {
        Self { tick, kind: kind.to_wire(), sender: sender.to_wire(), ..Self::default() }
    }

    /// The kind, or `None` for a number that this version does not support.
    pub fn event_kind(&self) -> Option<EventKind> {
        EventKind::from_wire(self.kind)
    }

    /// The kind of sender, or `None` for a number that this version does not support.
    pub fn sent_by(&self) -> Option<Sender> {
        Sender::from_wire(self.sender)
    }

    /// The request of a command's event; `None` for the other events.
    pub fn request(&self) -> Option<Request> {
        let [first, second, ..] = self.values;
        let command = Command {
            kind: self.kind,
            run_id: self.run_id,
            values: [first, second],
            flags: self.flags,
            ..Command::default()
        };
        Request::from_wire(&command)
    }

    /// Returns `Ok` if the command was accepted.
    ///
    /// # Errors
    /// The reason of the refusal; [`Refusal::Unknown`] for a number that this version does not support.
    pub fn outcome(&self) -> Result<(), Refusal> {
        let Self { lowest, highest, refusal, .. } = *self;
        CommandReply { lowest, highest, refusal, ..CommandReply::default() }.outcome().map(|_tick| ())
    }

    /// The start of the run, if this event is a start.
    pub fn run_start(&self) -> Option<RunStart> {
        let [start_s, travel_m, speed_mps, until_s] = self.values;
        (self.event_kind() == Some(EventKind::Start)).then_some(RunStart {
            start_s,
            travel_m,
            speed_mps,
            until_s: (!until_s.is_nan()).then_some(until_s),
            is_held: self.flags & 1 != 0,
            is_paused: self.flags & 2 != 0,
            is_guarded: self.flags & 4 != 0,
            follows_timecode: self.flags & 8 != 0,
            is_ready: self.flags & 16 != 0,
            is_restarted: self.flags & 32 != 0,
            stays: self.flags & 64 != 0,
        })
    }
}

/// State in which a server starts a run, in addition to its configuration.
#[allow(clippy::struct_excessive_bools, reason = "independent bits of the wire")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunStart {
    /// Show time at tick 0 in seconds: the event's first value.
    pub start_s: f64,
    /// Travel at tick 0 in metres: the second value.
    pub travel_m: f64,
    /// Speed to walk at from tick 0 on, in metres per show second: the third value.
    pub speed_mps: f64,
    /// Show time in seconds at which the run ends; `None` for no such limit. The fourth value, with NaN for none.
    pub until_s: Option<f64>,
    /// Whether tick 0 is held: bit 0 of the flags.
    pub is_held: bool,
    /// Whether tick 0 is paused, or becomes paused when the hold is lifted: bit 1.
    pub is_paused: bool,
    /// Whether the head waits for a guard's grants: bit 2.
    pub is_guarded: bool,
    /// Whether the show follows timecode: bit 3.
    pub follows_timecode: bool,
    /// Whether the show waits at its start for its first release: bit 4.
    pub is_ready: bool,
    /// Whether the server was restarted; with [`RunStart::is_held`], this is why the show is held: bit 5.
    pub is_restarted: bool,
    /// Whether the show stands finished at [`RunStart::until_s`], instead of ending: bit 6.
    pub stays: bool,
}

impl RunStart {
    /// Returns the event of this start, in the server's process of this number.
    pub fn event(&self, pid: u32) -> CommandEvent {
        let Self { is_held, is_paused, is_guarded, follows_timecode, is_ready, is_restarted, stays, .. } = *self;
        let bits = [is_held, is_paused, is_guarded, follows_timecode, is_ready, is_restarted, stays];
        CommandEvent {
            values: [self.start_s, self.travel_m, self.speed_mps, self.until_s.unwrap_or(f64::NAN)],
            flags: bits.into_iter().enumerate().map(|(bit, holds)| u32::from(holds) << bit).sum(),
            pid,
            ..CommandEvent::plain(EventKind::Start, Sender::Server, 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_gives_back_the_command_and_its_outcome() {
        let request = Request::Grant { run_id: 7, from_m: 1.0, to_m: 2.5, is_final: true };
        let command = Command { sender: Sender::Guard.to_wire(), pid: 12, ..request.to_wire() };
        let refusal = Refusal::OutOfRange { lowest: 0.0, highest: 2.0 };
        let event =
            CommandEvent { run_id: 7, ..CommandEvent::answered(&command, &CommandReply::refused(7, 41, refusal)) };
        assert_eq!((event.request(), event.outcome(), event.tick), (Some(request), Err(refusal), 41));
        assert_eq!((event.event_kind(), event.sent_by()), (Some(EventKind::Grant), Some(Sender::Guard)));
        assert_eq!(event.run_start(), None);
    }

    #[test]
    fn a_start_is_the_same_after_its_way_over_the_wire() {
        let start = RunStart {
            start_s: 0.1,
            travel_m: -3.0,
            speed_mps: 1.5,
            until_s: None,
            is_held: true,
            is_paused: false,
            is_guarded: true,
            follows_timecode: false,
            is_ready: false,
            is_restarted: true,
            stays: true,
        };
        let event = start.event(9);
        assert_eq!((event.run_start(), event.pid), (Some(start), 9));
        assert_eq!((event.request(), event.sent_by()), (None, Some(Sender::Server)));
    }
}
