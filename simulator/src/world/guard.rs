//! The monitor's process and the guard's thread.

use std::hash::Hash as _;

use super::{Event, MS_NS, World};
use crate::fault::Part;
use crate::guard::{Findings, GuardProcess, GuardStep};
use crate::promises::Promise;

/// Longest time of a usual proof of the guard.
const PROOF_NS: u64 = 30 * MS_NS;

impl<'a> World<'a> {
    /// Whether this process may act now. A stopped one gets the event when it continues.
    pub(super) fn guard_at(&mut self, life: u64, event: Event) -> Option<&mut GuardProcess<'a>> {
        let now_ns = self.now_ns;
        let guard = self.guards.iter_mut().find(|guard| guard.life == life)?;
        if guard.stopped_until_ns > now_ns {
            self.agenda.add(guard.stopped_until_ns, event);
            return None;
        }
        Some(guard)
    }

    pub(super) fn join_guard(&mut self, life: u64) {
        // `guard.lock` allows one guard per instance.
        let is_taken = self.guards.iter().any(|guard| guard.has_joined && guard.life != life);
        let is_locked = is_taken && self.scenario.is_guarded();
        let has_server = self.server.is_some();
        let Some(guard) = self.guard_at(life, Event::GuardJoins(life)) else { return };
        if is_locked {
            return self.end_guard(life);
        }
        guard.has_joined = has_server;
        if has_server {
            self.watch.monitored_ns = self.now_ns;
        } else {
            self.after(20 * MS_NS, Event::GuardJoins(life));
        }
    }

    pub(super) fn read_frames(&mut self, life: u64) {
        let scenario = self.scenario;
        let Some(guard) = self.guard_at(life, Event::Frames(life)) else { return };
        let Findings { faults, alerts, unswept, read, report } = guard.read(scenario);
        self.watch.monitored_ns = self.now_ns;
        self.watch.take_report(report);
        self.watch.alerts.extend_from_slice(&alerts);
        if let Some(recorder) = self.recorder.as_mut().filter(|recorder| recorder.has_joined) {
            recorder.alerts.extend(&alerts);
        }
        alerts.len().hash(&mut self.trace);
        for read in &read {
            self.promises.take_read(read, self.now_ns);
        }
        let is_late = read.iter().any(|read| read.is_reported_late);
        self.promises.require(Promise::ContactIsReported, self.now_ns, !is_late, || {
            "a contact is reported where the boards overlap, and not where they touch".to_owned()
        });
        self.promises.require(Promise::ContactIsReported, self.now_ns, unswept == 0, || {
            format!("{unswept} frames are not swept, of a dragon whose sweep needs little work")
        });
        self.promises
            .require(Promise::NoFalseFault, self.now_ns, faults == 0, || "a frame is called faulty".to_owned());
        if self.scenario.is_guarded() {
            self.work(life);
        }
    }

    pub(super) fn work(&mut self, life: u64) {
        let status = self.status.clone();
        let Some(guard) = self.guard_at(life, Event::Work(life)) else { return };
        let step = guard.work(status.as_deref());
        let rests = self.newest.as_ref().filter(|header| {
            crate::guard::is_held(header)
                && self.guards.iter().any(|guard| guard.life == life && guard.is_final(header))
        });
        if let Some(header) = rests {
            self.promises.take_final_rest(header, self.now_ns);
        }
        if let GuardStep::Ask(request, number) = step {
            let (until, longer_ns) = self.windows.proofs_slow;
            let longer_ns = if until > self.now_ns { longer_ns } else { 0 };
            let proof_ns = self.scenario.latency_ns(self.now_ns, 40, PROOF_NS) + longer_ns;
            self.after(proof_ns, Event::GuardSends(life, number, request));
        }
    }

    /// An operator ends the monitor that he has started. A stopped one ends when it continues. Its last report is a sign of life.
    pub(super) fn end_foreign_guard(&mut self, life: u64) {
        let Some(guard) = self.guard_at(life, Event::ForeignEnds(life)) else { return };
        if guard.has_joined {
            self.watch.monitored_ns = self.now_ns;
        }
        self.end_guard(life);
    }

    pub(super) fn end_guard(&mut self, life: u64) {
        let Some(place) = self.guards.iter().position(|guard| guard.life == life) else { return };
        let guard = self.guards.remove(place);
        // A foreign monitor ends in order, and the show's by a kill.
        if guard.is_foreign {
            self.watch.take_report(guard.report.clone().take_last());
        }
        ("guard ends", life).hash(&mut self.trace);
        if !guard.is_foreign {
            self.plan_restart(Part::Guard);
        }
    }
}
