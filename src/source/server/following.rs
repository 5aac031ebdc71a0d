//! The loop's side of timecode: passes samples to the follower, and the follower's orders to the simulation.

use bench_dragon_ipc::{
    Command, CommandEvent, CommandReply, EventKind, Refusal, Request, Sender, TimecodeKind, TimecodeState,
};
use rtrb::{Consumer, Producer, RingBuffer};
use serde::{Deserialize, Serialize};

use super::simulation::Steering;
use crate::source::timecode::{Follower, FollowerEvent, FollowerSettings, SampleQueue, ShowPosition};

/// Greatest number of news that wait to be reported.
const MOST_NEWS: usize = 64;

/// A server's follower of timecode, with its queues. A tick neither waits for another thread nor allocates.
#[derive(Debug)]
pub struct TimecodeFollowing {
    follower: Follower,
    inbox: SampleQueue,
    news: Producer<TimecodeNews>,
    kind: TimecodeKind,
    /// The timecode's effect on the show as last recorded.
    recorded: Option<SteeringRecord>,
    /// Whether the last seek was refused. That refusal is recorded.
    is_seek_refused: bool,
}

/// The facts about the timecode that a simulation of the run needs in addition to the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SteeringRecord {
    stands: bool,
    /// Whether the timecode determines the show time.
    leads: bool,
    /// The time scale where the timecode does not lead. While it leads, the frames contain the time scale.
    time_scale: Option<f64>,
}

/// A change of the timecode, and the show time at that moment. `serve` prints it as one line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimecodeNews {
    /// The change.
    #[serde(flatten)]
    pub event: FollowerEvent,
    /// Show time in seconds.
    #[serde(rename = "time_s")]
    pub show_time_s: f64,
    /// Whether the operator's pause or hold keeps the show standing at that moment.
    #[serde(rename = "stopped")]
    pub is_stopped: bool,
}

impl TimecodeFollowing {
    /// Follows the samples of an inbox. Another thread reports the news from the returned queue.
    pub fn new(settings: FollowerSettings, kind: TimecodeKind, inbox: SampleQueue) -> (Self, Consumer<TimecodeNews>) {
        let (news, to_report) = RingBuffer::new(MOST_NEWS);
        let follower = Follower::new(settings);
        (Self { follower, inbox, news, kind, recorded: None, is_seek_refused: false }, to_report)
    }

    /// The kind of the timecode, and its state.
    pub fn timecode(&self) -> (TimecodeKind, TimecodeState) {
        (self.kind, self.follower.timecode_state())
    }

    /// Takes the newest timecode at the tick that is due at `due_ns`, for a show at this position, and passes changes to `record`.
    /// `seek` moves the show. Returns the timecode's effect on the show from this tick on.
    pub fn steer(
        &mut self,
        due_ns: u64,
        show: ShowPosition,
        seek: &mut dyn FnMut(f64) -> Result<(), Refusal>,
        mut record: impl FnMut(CommandEvent),
    ) -> Steering {
        for sample in self.inbox.take() {
            self.follower.hear(sample);
        }
        let (order, event) = self.follower.steer(due_ns, show);
        if let Some(event) = event {
            // A full queue drops the news.
            let _ = self.news.push(TimecodeNews { event, show_time_s: show.show_time_s, is_stopped: show.is_stopped });
        }
        if let Some(show_time_s) = order.seek_s {
            let outcome = seek(show_time_s);
            self.follower.note_seek(outcome.is_ok());
            // A refused seek is retried ten times a second. Only the first refusal is recorded.
            if !std::mem::replace(&mut self.is_seek_refused, outcome.is_err()) || outcome.is_ok() {
                record(seek_event(show_time_s, outcome));
            }
        }
        let leads = self.follower.leads();
        let time_scale = (!leads).then_some(order.time_scale);
        let steered = SteeringRecord { stands: order.stands, leads, time_scale };
        if self.recorded.replace(steered) != Some(steered) {
            record(steered.event(order.time_scale));
        }
        Steering { stands: order.stands, leads, time_scale: order.time_scale }
    }
}

impl SteeringRecord {
    fn event(self, time_scale: f64) -> CommandEvent {
        let kind = if self.stands { EventKind::Stand } else { EventKind::Follow };
        let values = [f64::from(u8::from(self.leads)), time_scale, 0.0, 0.0];
        CommandEvent { values, ..CommandEvent::plain(kind, Sender::Timecode, 0) }
    }
}

fn seek_event(show_time_s: f64, outcome: Result<(), Refusal>) -> CommandEvent {
    let command = Command { sender: Sender::Timecode.to_wire(), ..Request::Seek { show_time_s }.to_wire() };
    let reply = outcome.map_or_else(|refusal| CommandReply::refused(0, 0, refusal), |()| CommandReply::accepted(0, 0));
    CommandEvent::answered(&command, &reply)
}
