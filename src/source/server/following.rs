//! The loop's end of timecode: takes the newest sample, and has the simulation do what the follower says.

use bench_dragon_ipc::{Command, CommandEvent, CommandReply, EventKind, Refusal, Request, Sender, TimecodeKind};
use rtrb::{Consumer, Producer, RingBuffer};
use serde::{Deserialize, Serialize};

use super::schedule::Schedule;
use super::simulation::{Simulation, Steering};
use crate::source::timecode::{Follower, FollowerEvent, FollowerSettings, SampleQueue};

/// News that wait to be reported.
const MOST_NEWS: usize = 64;

/// What a server follows timecode with. What it does from tick to tick neither waits for another thread nor allocates.
#[derive(Debug)]
pub struct TimecodeFollowing {
    pub(super) follower: Follower,
    inbox: SampleQueue,
    news: Producer<TimecodeNews>,
    pub(super) kind: TimecodeKind,
    /// What the timecode was last recorded to have the show do.
    recorded: Option<SteeringRecord>,
    /// Whether the last seek was refused, and recorded so.
    is_seek_refused: bool,
}

/// What a simulation of the run needs to know of the timecode, beside the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SteeringRecord {
    stands: bool,
    /// Whether the timecode says where the show is.
    leads: bool,
    /// The time scale where it does not: otherwise the frames carry it.
    time_scale: Option<f64>,
}

/// What happened to the timecode, and where the show was then: a line of `serve`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimecodeNews {
    /// What happened.
    #[serde(flatten)]
    pub event: FollowerEvent,
    /// Show time in seconds.
    #[serde(rename = "time_s")]
    pub sim_time_s: f64,
    /// Whether an operator's pause or hold keeps the show standing meanwhile.
    #[serde(rename = "stopped")]
    pub is_stopped: bool,
}

impl TimecodeFollowing {
    /// Follows what comes into an inbox. The news are for a thread that tells them.
    pub fn new(settings: FollowerSettings, kind: TimecodeKind, inbox: SampleQueue) -> (Self, Consumer<TimecodeNews>) {
        let (news, to_tell) = RingBuffer::new(MOST_NEWS);
        let follower = Follower::new(settings);
        (Self { follower, inbox, news, kind, recorded: None, is_seek_refused: false }, to_tell)
    }

    /// Takes the newest timecode at the tick that is due now, and hands what changes to `record`.
    /// Returns what the show is to do from this tick on.
    pub(super) fn steer(
        &mut self,
        simulation: &mut Simulation,
        schedule: &Schedule,
        mut record: impl FnMut(CommandEvent),
    ) -> Steering {
        for sample in self.inbox.take() {
            self.follower.hear(sample);
        }
        let show = simulation.show();
        let (order, event) = self.follower.steer(schedule.due_ns(), show);
        if let Some(event) = event {
            // Where as many wait, it is not reported.
            let _ = self.news.push(TimecodeNews { event, sim_time_s: show.sim_time_s, is_stopped: show.is_stopped });
        }
        if let Some(sim_time_s) = order.seek_s {
            let outcome = simulation.motion.request(Request::Seek { sim_time_s });
            self.follower.note_seek(outcome.is_ok());
            // A refused seek is tried again ten times a second: the first try is recorded.
            if !std::mem::replace(&mut self.is_seek_refused, outcome.is_err()) || outcome.is_ok() {
                record(seek_event(sim_time_s, outcome));
            }
        }
        let leads = self.follower.leads();
        let time_scale = (!leads).then_some(order.time_scale);
        let steered = SteeringRecord { stands: order.stands, leads, time_scale };
        if self.recorded.replace(steered) != Some(steered) {
            record(steered.event(order.time_scale));
        }
        Steering { stands: order.stands, time_scale: order.time_scale, rate_hz: schedule.rate_hz() }
    }
}

impl SteeringRecord {
    fn event(self, time_scale: f64) -> CommandEvent {
        let kind = if self.stands { EventKind::Stand } else { EventKind::Follow };
        let values = [f64::from(u8::from(self.leads)), time_scale, 0.0, 0.0];
        CommandEvent { values, ..CommandEvent::plain(kind, Sender::Timecode, 0) }
    }
}

fn seek_event(sim_time_s: f64, outcome: Result<(), Refusal>) -> CommandEvent {
    let command = Command { sender: Sender::Timecode.to_wire(), ..Request::Seek { sim_time_s }.to_wire() };
    let reply = outcome.map_or_else(|refusal| CommandReply::refused(0, 0, refusal), |()| CommandReply::accepted(0, 0));
    CommandEvent::answered(&command, &reply)
}
