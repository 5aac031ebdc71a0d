//! The monitor's process, with the guard's thread: the production monitor, check and guard on the simulated bus.

use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;

use bench_dragon::safety::guard::{Asked, ClearanceCheck, Guard};
use bench_dragon::safety::monitor::Monitor;
use bench_dragon_ipc::{
    Alert, AlertKind, ContinuityTracker, FrameHeader, ReaderReport, Refusal, ReportCount, Request, ShowState, Status,
};

use crate::frame::BusFrame;
use crate::scenario::Scenario;

/// Frames that the bus keeps for a reader that is slower than the server. It drops the oldest.
const FRAME_BUFFER: usize = 256;

/// Overlap of two boards in metres that is not the rounding of a touch.
const OVERLAP_M: f64 = 1e-6;

/// A running monitor.
#[derive(Debug)]
pub(crate) struct GuardProcess<'a> {
    /// Number of the process, which tells its events from those of an earlier one.
    pub(crate) life: u64,
    pub(crate) stopped_until_ns: u64,
    /// Whether it has joined the bus. Before, it gets no frames.
    pub(crate) has_joined: bool,
    /// Whether an operator started it, and not the supervisor.
    pub(crate) is_foreign: bool,
    pub(crate) frames: VecDeque<Rc<BusFrame>>,
    /// Its report to those who watch the show.
    pub(crate) report: ReportCount,
    tracker: ContinuityTracker,
    watched: Option<Watched<'a>>,
}

/// The watch of one run.
#[derive(Debug)]
struct Watched<'a> {
    run_id: u64,
    monitor: Monitor,
    check: ClearanceCheck,
    guard: Option<GuardThread<'a>>,
    last: Option<FrameHeader>,
    has_reported: bool,
}

/// The guard's thread of one run.
#[derive(Debug)]
struct GuardThread<'a> {
    guard: Guard<'a>,
    newest: Option<FrameHeader>,
    /// The frame with which the guard has advanced last.
    advanced: Option<FrameHeader>,
    has_fault: bool,
    has_ended: bool,
    /// The request that waits for its reply, and its number.
    asked: Option<(Request, u64)>,
    next_ask: u64,
}

/// What the guard's thread does next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum GuardStep {
    /// It waits for a frame or a status.
    Wait,
    /// It sends a request of this number, and waits for the reply.
    Ask(Request, u64),
}

/// The findings of a monitor in its frames.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    pub(crate) alerts: Vec<Alert>,
    /// Frames that differ from the reference solver.
    pub(crate) faults: u64,
    /// Frames up to which the monitor has not swept all travel.
    pub(crate) unswept: u64,
    /// The frames of an unguarded show.
    pub(crate) read: Vec<ReadFrame>,
    pub(crate) report: Option<ReaderReport>,
}

/// A frame that the monitor of an unguarded show has read.
#[derive(Debug)]
pub(crate) struct ReadFrame {
    pub(crate) frame: Rc<BusFrame>,
    /// Travel of the frame before, if the head has walked from there.
    pub(crate) walked_from_m: Option<f64>,
    /// Whether the monitor has reported a contact of this run.
    pub(crate) has_reported: bool,
    /// Whether a contact on walked travel was found only where the boards overlap already.
    pub(crate) is_reported_late: bool,
}

impl<'a> GuardProcess<'a> {
    pub(crate) fn new(life: u64, is_foreign: bool) -> Self {
        let (frames, stopped_until_ns) = (VecDeque::new(), 0);
        let report = ReportCount::new("monitor", life.into(), life as u32);
        let tracker = ContinuityTracker::default();
        Self { life, stopped_until_ns, has_joined: false, is_foreign, frames, report, tracker, watched: None }
    }

    /// Puts a frame into the buffer, which drops its oldest frame if it is full.
    pub(crate) fn deliver(&mut self, frame: &Rc<BusFrame>) {
        if self.frames.len() == FRAME_BUFFER {
            self.frames.pop_front();
        }
        self.frames.push_back(Rc::clone(frame));
    }

    /// Reads all frames of the buffer.
    pub(crate) fn read(&mut self, scenario: &'a Scenario) -> Findings {
        let mut findings = Findings::default();
        while let Some(frame) = self.frames.pop_front() {
            let run_id = frame.header.run_id;
            self.tracker.track(&frame.header);
            self.report.count(&frame.header, self.tracker.lost());
            if self.watched.as_ref().is_none_or(|watched| watched.run_id != run_id) {
                self.watched = Some(Watched::new(scenario, run_id));
            }
            let watched = self.watched.as_mut().expect("begun where it was missing");
            watched.take(frame, &mut findings);
        }
        // No frame is unread, so the report is due after a second.
        if self.report.is_due(1) {
            findings.report = self.report.take();
        }
        findings
    }

    /// Continues the guard's thread with the newest status, unless it waits for a reply.
    pub(crate) fn work(&mut self, status: Option<&Status>) -> GuardStep {
        let guard = self.watched.as_mut().and_then(|watched| watched.guard.as_mut());
        guard.map_or(GuardStep::Wait, |guard| guard.work(status))
    }

    /// Takes the reply to a request; `None` where there was none in time. Returns whether the thread waited for it.
    pub(crate) fn take_reply(&mut self, number: u64, reply: Option<Result<u64, Refusal>>) -> bool {
        let guard = self.watched.as_mut().and_then(|watched| watched.guard.as_mut());
        guard.is_some_and(|guard| guard.take_reply(number, reply))
    }

    /// Whether the head is at its final rest in this frame, by the guard.
    pub(crate) fn is_final(&self, header: &FrameHeader) -> bool {
        let guard = self.watched.as_ref().and_then(|watched| watched.guard.as_ref());
        guard.is_some_and(|thread| thread.advanced == Some(*header) && thread.guard.is_final(header))
    }
}

impl<'a> Watched<'a> {
    fn new(scenario: &'a Scenario, run_id: u64) -> Self {
        let config = &scenario.config;
        let guard = scenario.is_guarded().then(|| GuardThread {
            guard: Guard::new(&scenario.metered, config, run_id),
            newest: None,
            advanced: None,
            has_fault: false,
            has_ended: false,
            asked: None,
            // Numbers are unique over all runs, so that a late reply is not taken for another.
            next_ask: run_id << 32,
        });
        let check = ClearanceCheck::new(Arc::clone(config.formation()));
        Self { run_id, monitor: Monitor::new(config), check, guard, last: None, has_reported: false }
    }

    fn take(&mut self, frame: Rc<BusFrame>, findings: &mut Findings) {
        let BusFrame { header, handles, is_sought } = &*frame;
        let unswept = self.monitor.unswept;
        let nearest = self.monitor.observe(header, handles, None);
        findings.unswept += self.monitor.unswept - unswept;
        findings.alerts.extend_from_slice(self.monitor.alerts());
        self.has_reported |= self.monitor.alerts().iter().any(|alert| alert.alert_kind() == Some(AlertKind::Contact));
        let last = self.last.replace(*header);
        let Some(guard) = &mut self.guard else {
            let walks = |header: &FrameHeader| header.show_state().is_some_and(ShowState::walks);
            let is_next =
                |last: &FrameHeader| last.tick + 1 == header.tick && !is_sought && walks(last) && walks(header);
            let walked_from_m = last.filter(is_next).map(|last| last.course_m);
            let walked_from_m = walked_from_m.filter(|&from_m| from_m <= header.course_m);
            let is_late =
                |alert: &Alert| alert.alert_kind() == Some(AlertKind::Contact) && alert.clearance_m < -OVERLAP_M;
            let is_swept = walked_from_m.is_some() && self.monitor.unswept == 0;
            let is_reported_late = is_swept && self.monitor.alerts().iter().any(is_late);
            let has_reported = self.has_reported;
            return findings.read.push(ReadFrame { frame, walked_from_m, has_reported, is_reported_late });
        };
        guard.newest = Some(*header);
        if !self.check.agrees(header, nearest) && !std::mem::replace(&mut guard.has_fault, true) {
            findings.faults += 1;
        }
    }
}

impl GuardThread<'_> {
    fn work(&mut self, status: Option<&Status>) -> GuardStep {
        let Some(header) = self.newest.filter(|_| self.asked.is_none() && !self.has_ended) else {
            return GuardStep::Wait;
        };
        let request = if self.has_fault {
            self.has_ended = true;
            Some(Request::Hold)
        } else {
            let status = status.filter(|status| status.run_id == header.run_id);
            self.advanced = Some(header);
            self.guard.advance(&header, status.and_then(Asked::of))
        };
        let Some(request) = request else { return GuardStep::Wait };
        let number = self.next_ask;
        self.next_ask += 1;
        self.asked = Some((request, number));
        GuardStep::Ask(request, number)
    }

    fn take_reply(&mut self, number: u64, reply: Option<Result<u64, Refusal>>) -> bool {
        let Some((request, _)) = self.asked.take_if(|(_, asked)| *asked == number) else { return false };
        if let Some(outcome) = reply {
            self.guard.note_reply(request, outcome);
        }
        true
    }
}

/// Whether the state of a header is a stop at the end of a grant or an operator's hold.
pub(crate) fn is_held(header: &FrameHeader) -> bool {
    header.show_state() == Some(ShowState::Held)
}
