//! The loop's end of timecode: takes the newest sample, and has the simulation do what the follower says.

use std::sync::Arc;

use bench_dragon_ipc::Request;
use crossbeam::queue::ArrayQueue;

use super::simulation::Simulation;
use crate::timecode::{Event, Follower, FollowerSettings, Inbox};

/// News that wait to be told; nobody need be quick.
const MOST_NEWS: usize = 64;

/// What a server follows timecode with. What it does from tick to tick neither locks nor allocates.
#[derive(Debug)]
pub struct Following {
    follower: Follower,
    inbox: Inbox,
    news: Arc<ArrayQueue<TimecodeNews>>,
}

/// What happened to the timecode, and where the show was then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimecodeNews {
    /// What happened.
    pub event: Event,
    /// Show time in seconds.
    pub sim_time_s: f64,
}

impl Following {
    /// Follows what comes into an inbox.
    pub fn new(settings: FollowerSettings, inbox: Inbox) -> Self {
        Self { follower: Follower::new(settings), inbox, news: Arc::new(ArrayQueue::new(MOST_NEWS)) }
    }

    /// Where the news are, for a thread that tells them.
    pub fn news(&self) -> Arc<ArrayQueue<TimecodeNews>> {
        Arc::clone(&self.news)
    }

    /// Steers the tick that is due now, one of so many a second. Returns the time scale from it on.
    pub(super) fn steer(&mut self, simulation: &mut Simulation, due_ns: u64, rate_hz: u32) -> f64 {
        if let Some(sample) = self.inbox.take() {
            self.follower.hear(sample);
        }
        let show = simulation.show();
        let (order, event) = self.follower.steer(due_ns, show);
        if let Some(event) = event {
            // Where nobody has told the others yet, the oldest gives way.
            self.news.force_push(TimecodeNews { event, sim_time_s: show.sim_time_s });
        }
        if let Some(sim_time_s) = order.seek_s {
            self.follower.note_seek(simulation.request(Request::Seek { sim_time_s }).is_ok());
        }
        simulation.set_stands(order.stands);
        simulation.set_tick(order.time_scale / f64::from(rate_hz));
        order.time_scale
    }
}
