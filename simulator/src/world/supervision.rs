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
        let children = self.child_states();
        self.kill_hung(children);
        for part in [Part::Server, Part::Guard, Part::Recorder] {
            if !self.is_over && self.supervisor.is_due(part, self.now_ns) {
                self.start(part);
            }
        }
        self.check_hung(children);
        self.check_missing();
    }

    /// Server, guard and recorder as the supervisor sees them.
    fn child_states(&mut self) -> [ChildState; 3] {
        let now_ns = self.now_ns;
        let own = self.guards.iter().find(|guard| !guard.is_foreign);
        let guard_stopped = own.is_some_and(|guard| guard.stopped_until_ns > now_ns);
        [
            ChildState {
                part: Part::Server,
                runs: self.server.is_some(),
                is_stopped: self.server.as_ref().is_some_and(|server| server.stopped_until_ns > now_ns),
                is_heard: std::mem::take(&mut self.has_news),
            },
            ChildState {
                part: Part::Guard,
                runs: own.is_some(),
                is_stopped: guard_stopped,
                is_heard: own.is_some_and(|guard| guard.has_joined) && !guard_stopped,
            },
            self.look_at_recorder(),
        ]
    }

    /// Kills the children that the supervisor takes for hung. Promises that these are not healthy.
    fn kill_hung(&mut self, children: [ChildState; 3]) {
        let (now_ns, [server, guard, recorder]) = (self.now_ns, children);
        for part in self.supervisor.look(now_ns, children) {
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
    }

    /// Promises that no child stays stopped.
    fn check_hung(&mut self, children: [ChildState; 3]) {
        let now_ns = self.now_ns;
        for child in children {
            let last_ns = &mut self.hung_ns[child.part as usize];
            if !child.runs || !child.is_stopped {
                *last_ns = now_ns;
            }
            let hung_ns = now_ns - *last_ns;
            self.promises.require(Promise::HungChildEnds, now_ns, hung_ns <= 6 * SECOND_NS, || {
                format!("{:?} is stopped for {hung_ns} ns", child.part)
            });
        }
    }

    /// Promises that no child stays away.
    fn check_missing(&mut self) {
        let now_ns = self.now_ns;
        let has_guard = self.guards.iter().any(|guard| !guard.is_foreign);
        let has_recorder = self.recorder.is_some() || self.supervisor.is_recorder_away();
        let running = [(Part::Server, self.server.is_some()), (Part::Guard, has_guard), (Part::Recorder, has_recorder)];
        for (part, runs) in running {
            let last_ns = &mut self.lived_ns[part as usize];
            if runs || self.is_over {
                *last_ns = now_ns;
            }
            let missing_ns = now_ns - *last_ns;
            let returns = missing_ns <= LONGEST_BACKOFF_NS + SECOND_NS;
            self.promises.require(Promise::DeadChildReturns, now_ns, returns, || {
                format!("{part:?} is missing for {missing_ns} ns")
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
