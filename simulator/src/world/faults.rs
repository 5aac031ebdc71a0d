//! The faults of a scenario take effect.

use super::{Event, START_NS, World};
use crate::fault::{FaultKind, Operator, Part, flurry};
use crate::guard::GuardProcess;

/// Windows in which the bus or a process is bad, each up to an instant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Windows {
    pub(super) clock_stands_until: u64,
    pub(super) clock_stood_at: u64,
    pub(super) requests_lost_until: u64,
    pub(super) requests_late: (u64, u64),
    pub(super) replies_lost_until: u64,
    pub(super) frames_lost_until: u64,
    pub(super) proofs_slow: (u64, u64),
    pub(super) disk_full_until: u64,
    pub(super) disk_slow: (u64, u64),
}

impl World<'_> {
    pub(super) fn fail(&mut self, kind: FaultKind) {
        self.steady_ns = self.now_ns;
        self.counts.faults += 1;
        if let Some(duration_ns) = kind.disturbs_ns() {
            self.watch.disturb(self.now_ns + duration_ns);
        }
        let until = |duration_ns: u64| self.now_ns + duration_ns;
        match kind {
            FaultKind::Kill(part) => self.kill(part),
            FaultKind::Stop(Part::Server, ns) => {
                let until = until(ns);
                self.server.iter_mut().for_each(|server| server.stopped_until_ns = server.stopped_until_ns.max(until));
            }
            FaultKind::Stop(Part::Guard, ns) => {
                let until = until(ns);
                self.guards.iter_mut().for_each(|guard| guard.stopped_until_ns = guard.stopped_until_ns.max(until));
            }
            FaultKind::Stop(Part::Recorder, ns) => {
                let until = until(ns);
                let recorder = self.recorder.iter_mut();
                recorder.for_each(|recorder| recorder.stopped_until_ns = recorder.stopped_until_ns.max(until));
            }
            FaultKind::KillInWrite(bytes) => {
                self.recorder.iter().for_each(|recorder| recorder.process.kill_after(bytes));
            }
            FaultKind::FullDisk(bytes, ns) => {
                self.windows.disk_full_until = until(ns);
                self.recordings.disk.limit(Some(bytes));
            }
            FaultKind::SlowDisk(factor, ns) => self.windows.disk_slow = (until(ns), factor),
            FaultKind::PowerLoss => self.lose_power(),
            FaultKind::FreshObserver => self.begin_observer(),
            FaultKind::Overrun(ns) => self.server.iter_mut().for_each(|server| server.busy_ns = ns),
            FaultKind::ClockStands(ns) => {
                (self.windows.clock_stood_at, self.windows.clock_stands_until) = (self.now_ns, until(ns));
            }
            FaultKind::LoseRequests(ns) => self.windows.requests_lost_until = until(ns),
            FaultKind::DelayRequests(ns, later_ns) => self.windows.requests_late = (until(ns), later_ns),
            FaultKind::LoseReplies(ns) => self.windows.replies_lost_until = until(ns),
            FaultKind::LoseFrames(ns) => self.windows.frames_lost_until = until(ns),
            FaultKind::SlowProofs(ns, longer_ns) => self.windows.proofs_slow = (until(ns), longer_ns),
            FaultKind::SecondGuard(ns) => {
                let life = self.life();
                self.guards.push(GuardProcess::new(life, true));
                self.after(START_NS, Event::GuardJoins(life));
                self.after(START_NS + ns, Event::ForeignEnds(life));
            }
            FaultKind::Command(Operator::Tool, request) => self.begin_call(request, false),
            FaultKind::Command(Operator::Desk(desk), request) => self.submit(desk, request),
            FaultKind::Flurry(desk, seed, count) => {
                for request in flurry(seed, count, self.scenario.times_s()) {
                    self.submit(desk, request);
                }
            }
            FaultKind::Timecode(fault) => self.fail_timecode(fault),
        }
    }

    pub(super) fn kill(&mut self, part: Part) {
        match part {
            Part::Server if self.server.is_some() => {
                self.drop_server();
                self.plan_restart(Part::Server);
            }
            Part::Server => {}
            Part::Recorder => self.kill_recorder(),
            Part::Guard => {
                let own = self.guards.iter().find(|guard| !guard.is_foreign).map(|guard| guard.life);
                if let Some(life) = own {
                    self.end_guard(life);
                }
            }
        }
    }

    pub(super) fn plan_restart(&mut self, part: Part) {
        // A show that gives up after too many restarts is over.
        if !self.is_over && !self.supervisor.note_end(part, self.now_ns) {
            self.drop_server();
            self.is_over = true;
        }
    }
}
