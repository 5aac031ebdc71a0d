//! The looks of the supervisor at its children.

use super::{Event, MS_NS, World};
use crate::fault::Part;
use crate::promises::Promise;
use crate::scenario::SECOND_NS;
use crate::supervisor::ChildState;

/// Period at which the show looks at its children and the bus.
pub(super) const LOOK_NS: u64 = 50 * MS_NS;
/// Longest delay before a restart.
const LONGEST_BACKOFF_NS: u64 = 30 * SECOND_NS;

impl World<'_> {
    pub(super) fn look(&mut self) {
        self.after(LOOK_NS, Event::Look);
        self.look_at_desks();
        if self.is_over {
            return self.begin_next_show();
        }
        if let Some(header) = self.newest.filter(|_| self.has_news) {
            self.supervisor.seen.see_frame(&header);
        }
        if let Some(status) = &self.status {
            self.supervisor.seen.see_status(**status);
        }
        let now_ns = self.now_ns;
        let own = self.guards.iter().find(|guard| !guard.is_foreign);
        let stopped = |until_ns: u64| until_ns > now_ns;
        let server_stopped = self.server.as_ref().is_some_and(|server| stopped(server.stopped_until_ns));
        let guard_stopped = own.is_some_and(|guard| stopped(guard.stopped_until_ns));
        let children = [
            ChildState {
                part: Part::Server,
                runs: self.server.is_some(),
                is_stopped: server_stopped,
                is_heard: std::mem::take(&mut self.has_news),
            },
            ChildState {
                part: Part::Guard,
                runs: own.is_some(),
                is_stopped: guard_stopped,
                is_heard: own.is_some_and(|guard| guard.has_joined) && !guard_stopped,
            },
            self.look_at_recorder(),
        ];
        for part in self.supervisor.look(now_ns, children) {
            let [server, guard, recorder] = children;
            let heard_ns = self.newest.map_or(0, |header| header.published_ns);
            let is_healthy = match part {
                Part::Server => !server.is_stopped && now_ns - heard_ns < 5 * SECOND_NS - LOOK_NS,
                Part::Guard => !guard.is_stopped && guard.is_heard,
                Part::Recorder => !recorder.is_stopped && recorder.is_heard,
            };
            self.hung_ns[part as usize] = now_ns;
            self.promises.require(Promise::HealthyChildLives, now_ns, !is_healthy, || format!("{part:?} is killed"));
            self.kill(part);
        }
        for part in [Part::Server, Part::Guard, Part::Recorder] {
            if !self.is_over && self.supervisor.is_due(part, now_ns) {
                self.start(part);
            }
        }
        for (place, child) in children.into_iter().enumerate() {
            if !child.runs || !child.is_stopped {
                self.hung_ns[place] = now_ns;
            }
            let hung_ns = now_ns - self.hung_ns[place];
            self.promises.require(Promise::HungChildEnds, now_ns, hung_ns <= 6 * SECOND_NS, || {
                format!("{:?} is stopped for {hung_ns} ns", child.part)
            });
        }
        let has_guard = self.guards.iter().any(|guard| !guard.is_foreign);
        let has_recorder = self.recorder.is_some() || self.supervisor.is_recorder_away();
        for (place, runs) in [self.server.is_some(), has_guard, has_recorder].into_iter().enumerate() {
            if runs || self.is_over {
                self.lived_ns[place] = now_ns;
            }
            let missing_ns = now_ns - self.lived_ns[place];
            let returns = missing_ns <= LONGEST_BACKOFF_NS + SECOND_NS;
            self.promises.require(Promise::DeadChildReturns, now_ns, returns, || {
                format!("child {place} is missing for {missing_ns} ns")
            });
        }
    }

    /// After a show that has ended, another one begins, unless the faults are over.
    pub(super) fn begin_next_show(&mut self) {
        self.end_recorder();
        let own: Vec<u64> = self.guards.iter().filter(|guard| !guard.is_foreign).map(|guard| guard.life).collect();
        self.guards.retain(|guard| !own.contains(&guard.life));
        // All children are new.
        (self.hung_ns, self.lived_ns) = ([self.now_ns; 3], [self.now_ns; 3]);
        self.begin_show();
    }
}
