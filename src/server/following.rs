//! The loop's end of timecode: takes the newest sample, and has the simulation do what the follower says.

use bench_dragon_ipc::Request;
use rtrb::{Consumer, Producer, RingBuffer};

use super::simulation::Simulation;
use crate::timecode::{Event, Follower, FollowerSettings, Inbox};

/// News that wait to be told; nobody need be quick.
const MOST_NEWS: usize = 64;

/// What a server follows timecode with. What it does from tick to tick neither waits for another thread nor allocates.
#[derive(Debug)]
pub struct Following {
    follower: Follower,
    inbox: Inbox,
    news: Producer<TimecodeNews>,
}

/// What happened to the timecode, and where the show was then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimecodeNews {
    /// What happened.
    pub event: Event,
    /// Show time in seconds.
    pub sim_time_s: f64,
    /// Whether an operator's pause or hold keeps the show standing meanwhile.
    pub is_stopped: bool,
}

impl Following {
    /// Follows what comes into an inbox. The news are for a thread that tells them.
    pub fn new(settings: FollowerSettings, inbox: Inbox) -> (Self, Consumer<TimecodeNews>) {
        let (news, to_tell) = RingBuffer::new(MOST_NEWS);
        (Self { follower: Follower::new(settings), inbox, news }, to_tell)
    }

    /// Whether it is the timecode that says where the show is.
    pub(super) fn leads(&self) -> bool {
        self.follower.leads()
    }

    /// Steers the tick that is due now, one of so many a second. Returns the time scale from it on.
    pub(super) fn steer(&mut self, simulation: &mut Simulation, due_ns: u64, rate_hz: u32) -> f64 {
        for sample in self.inbox.take() {
            self.follower.hear(sample);
        }
        let show = simulation.show();
        let (order, event) = self.follower.steer(due_ns, show);
        if let Some(event) = event {
            // Where nobody has told the others yet, it goes untold.
            let _ = self.news.push(TimecodeNews { event, sim_time_s: show.sim_time_s, is_stopped: show.is_stopped });
        }
        if let Some(sim_time_s) = order.seek_s {
            self.follower.note_seek(simulation.request(Request::Seek { sim_time_s }).is_ok());
        }
        simulation.set_stands(order.stands);
        simulation.set_tick(order.time_scale / f64::from(rate_hz));
        order.time_scale
    }
}
