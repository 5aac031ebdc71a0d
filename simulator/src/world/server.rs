//! The server's process and its status.

use std::hash::Hash as _;
use std::rc::Rc;

use bench_dragon_ipc::service::COMMAND_EVENT_BUFFER;
use bench_dragon_ipc::{FrameHeader, GuardState, Request, ShowState, Status};
use zerocopy::IntoBytes as _;

use super::captain::Captain;
use super::{Caller, Event, MESSAGE_NS, MS_NS, START_NS, World};
use crate::fault::Part;
use crate::frame::{BusFrame, hash_header};
use crate::guard::GuardProcess;
use crate::promises::Promise;
use crate::server::{Decided, Server};
use crate::supervisor::Supervisor;

/// Period of the status.
const REPORT_NS: u64 = 100 * MS_NS;

impl World<'_> {
    pub(super) fn begin_show(&mut self) {
        self.supervisor = Supervisor::new(self.scenario, self.now_ns, self.epoch);
        self.promises.begin_show();
        (self.status, self.newest, self.is_over) = (None, None, false);
        self.begin_observer();
        self.counts.shows += 1;
        self.start(Part::Server);
        self.start(Part::Guard);
        if self.scenario.has_recorder {
            self.start(Part::Recorder);
        }
    }

    pub(super) fn start(&mut self, part: Part) {
        let life = self.life();
        self.supervisor.note_start(part);
        self.watch.disturb(self.now_ns);
        ("start", part == Part::Server, life, self.now_ns).hash(&mut self.trace);
        match part {
            Part::Server => {
                let (start, _) = self.supervisor.start_of_server(self.scenario);
                // Numbers of runs are random in the program. Here they only differ.
                self.server = Some(Server::new(self.scenario, start, life, life, self.now_ns + START_NS));
                self.after(START_NS, Event::ServerJoins(life));
            }
            Part::Guard => {
                self.guards.push(GuardProcess::new(life, false));
                self.after(START_NS, Event::GuardJoins(life));
            }
            Part::Recorder => self.start_recorder(life),
        }
    }

    pub(super) fn join_server(&mut self, life: u64) {
        let Some(server) = self.server.as_mut().filter(|server| server.life == life) else { return };
        let (run_id, start, due_ns) = (server.run_id, server.start, server.due_ns());
        self.counts.runs += 1;
        let told = self.status.as_ref().map(|status| (status.run_id, status.tick));
        self.promises.begin_run(run_id, start, told, self.now_ns);
        self.agenda.add(due_ns, Event::Tick(life));
        self.after(0, Event::Report(life));
    }

    pub(super) fn tick(&mut self, life: u64) {
        let (now_ns, windows) = (self.now_ns, self.windows);
        let Some(server) = self.server.as_mut().filter(|server| server.life == life) else { return };
        let resumes_ns = server.stopped_until_ns.max(windows.clock_stands_until);
        if resumes_ns > now_ns {
            return self.agenda.add(resumes_ns, Event::Tick(life));
        }
        let ticked = server.tick();
        let header = FrameHeader { published_ns: now_ns, ..ticked.header };
        self.promises.take_tick(&ticked, now_ns);
        hash_header(&header, &mut self.trace);
        self.counts.frames += 1;
        if let Some(last) = self.newest.as_ref().filter(|last| last.run_id == header.run_id) {
            self.counts.walked_m += (header.head_travel_m - last.head_travel_m).max(0.0);
        }
        let arrives = windows.frames_lost_until <= now_ns;
        let is_seek = |decided: &Decided| matches!(decided.request, Request::Seek { .. }) && decided.outcome.is_ok();
        let is_sought = ticked.decided.iter().any(is_seek);
        let frame = Rc::new(BusFrame { header, is_sought, handles: ticked.handles.to_vec() });
        for guard in self.guards.iter_mut().filter(|guard| guard.has_joined && arrives) {
            guard.deliver(&frame);
            let wake_ns = self.scenario.latency_ns(now_ns, 10 + guard.life, MESSAGE_NS);
            self.agenda.add(now_ns + wake_ns, Event::Frames(guard.life));
        }
        self.watch.deliver(&frame, now_ns);
        if let Some(recorder) = self.recorder.as_mut().filter(|recorder| recorder.has_joined) {
            recorder.deliver(&frame);
            let wake_ns = self.scenario.latency_ns(now_ns, 80, MESSAGE_NS);
            self.agenda.add(now_ns + wake_ns, Event::RecorderReads(recorder.life));
        }
        let (decided, steering) = (ticked.decided, ticked.steering);
        (self.newest, self.has_news) = (Some(header), true);
        if steering.is_some_and(|steering| steering.leads) {
            self.supervisor.has_timecode_run = !steering.is_some_and(|steering| steering.stands);
        }
        let ended_ns =
            now_ns + self.scenario.latency_ns(now_ns, 3, MESSAGE_NS / 4) + std::mem::take(&mut server.busy_ns);
        // A clock that stands at the end of the tick shows its earlier reading.
        let reading_ns = if windows.clock_stands_until > ended_ns { windows.clock_stood_at } else { ended_ns };
        server.end_tick(reading_ns);
        let due_ns = server.due_ns();
        self.promises.require(Promise::PeriodsAreSkipped, now_ns, due_ns >= reading_ns, || {
            format!("the next tick is due at {due_ns} ns, and the clock reads {reading_ns} ns")
        });
        let due_ns = due_ns.max(ended_ns);
        self.reply(&decided);
        let has_sought = decided.iter().any(|decided| decided.caller.is_none() && decided.outcome.is_ok());
        self.check_timecode(&header, steering, has_sought);
        if header.show_state() == Some(ShowState::Ended) {
            return self.end_server();
        }
        self.agenda.add(due_ns, Event::Tick(life));
    }

    pub(super) fn reply(&mut self, decided: &[Decided]) {
        for (place, &Decided { caller, request, outcome, reply }) in decided.iter().enumerate() {
            self.counts.replies += 1;
            (request.to_wire().as_bytes(), outcome.is_ok()).hash(&mut self.trace);
            let Some(reply) = reply else { continue };
            if let Some(Caller::Desk(call)) = caller {
                let taken = self.desks[call.desk].book.take(call, &reply);
                self.require_queue(taken);
            }
            let Some(caller) = caller.filter(|_| self.windows.replies_lost_until <= self.now_ns) else { continue };
            let delay_ns = self.message_ns(20 + place as u64);
            self.after(delay_ns, Event::Replied(caller, Some(reply)));
        }
    }

    /// The server has ended in order: it was told to, or has reached the end of its run.
    pub(super) fn end_server(&mut self) {
        self.publish_events(usize::MAX);
        self.end_recorder();
        self.drop_server();
        self.is_over = true;
        // A show that ends by itself after the faults has walked, too.
        if self.captain != Captain::Waits {
            self.captain = Captain::Done;
        }
    }

    /// Removes the server's process. Clients that wait for a reply get an error.
    pub(super) fn drop_server(&mut self) {
        let Some(server) = self.server.take() else { return };
        ("server ends", server.life).hash(&mut self.trace);
        for (caller, _) in server.requests {
            self.after(20 * MS_NS, Event::Replied(caller, None));
        }
    }

    pub(super) fn report(&mut self, life: u64) {
        let now_ns = self.now_ns;
        let Some(server) = self.server.as_ref().filter(|server| server.life == life) else { return };
        if server.stopped_until_ns > now_ns {
            let at_ns = server.stopped_until_ns;
            return self.agenda.add(at_ns, Event::Report(life));
        }
        let guard = match (self.scenario.is_guarded(), self.guards.iter().any(|guard| guard.has_joined)) {
            (false, _) => GuardState::None,
            (true, false) => GuardState::Missing,
            (true, true) => GuardState::Running,
        };
        self.status = Some(Rc::new(Status { guard: guard.to_wire(), ..server.status() }));
        self.publish_events(COMMAND_EVENT_BUFFER / 2);
        self.after(REPORT_NS, Event::Report(life));
        for number in 0..self.guards.len() {
            let life = self.guards[number].life;
            let wake_ns = self.scenario.latency_ns(now_ns, 30 + life, 20 * MS_NS);
            self.after(wake_ns, Event::Work(life));
        }
    }
}
