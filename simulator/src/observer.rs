//! The observer and a bridge: the production state, lamps and pace on what the simulated bus delivers.

use std::rc::Rc;

use bench_dragon::bridge::{Freshness, SourcePace, StaleAfter};
use bench_dragon::display::observe::{FrameCopy, Lamp, Members, ObserverState, SourceFacts, lamps};
use bench_dragon_ipc::{Alert, CommandEvent, ContinuityTracker, Description, FrameHeader, ReaderReport, Status};

use crate::frame::BusFrame;

/// An observer, such as that of the page.
#[derive(Debug)]
pub(crate) struct ObserverProcess {
    state: ObserverState,
    tracker: ContinuityTracker,
    newest: Option<Rc<BusFrame>>,
    pub(crate) since_ns: u64,
    described: Option<u64>,
}

impl ObserverProcess {
    pub(crate) fn new(members: Members, now_ns: u64) -> Self {
        let (state, tracker) =
            (ObserverState::without_threads("simulated", now_ns, members), ContinuityTracker::default());
        Self { state, tracker, newest: None, since_ns: now_ns, described: None }
    }

    pub(crate) fn deliver(&mut self, frame: &Rc<BusFrame>, now_ns: u64) {
        let continuity = self.tracker.track(&frame.header);
        self.state.count_frame(&frame.header, continuity, now_ns);
        self.newest = Some(Rc::clone(frame));
    }

    pub(crate) fn take_report(&mut self, report: ReaderReport) {
        self.state.take_report(report);
    }

    pub(crate) fn take_event(&mut self, event: CommandEvent) {
        self.state.take_event(event);
    }

    /// Looks at the bus, in the order of the observer's loop. Returns the lamps.
    pub(crate) fn look(
        &mut self,
        status: Option<&Rc<Status>>,
        alerts: &[Alert],
        facts: SourceFacts,
        toml: &str,
        now_ns: u64,
    ) -> Vec<Lamp> {
        if let Some(status) = status {
            self.state.take_status(**status, now_ns);
        }
        if let Some(frame) = self.newest.take() {
            let run_id = frame.header.run_id;
            if self.described.replace(run_id) != Some(run_id) {
                self.state.take_description(Description { run_id, toml: toml.to_owned() });
            }
            self.state.take_frame(FrameCopy { header: frame.header, handles: frame.handles.clone() }, now_ns);
        }
        for alert in alerts {
            self.state.take_alert(*alert, now_ns);
        }
        self.state.note_source(facts);
        self.state.judge(now_ns);
        lamps(&self.state.snapshot(now_ns), now_ns)
    }
}

/// A bridge, which sends the newest frame at its own rate.
#[derive(Debug, Default)]
pub(crate) struct Bridge {
    pace: SourcePace,
    latest: Option<FrameHeader>,
    unread: Option<Rc<BusFrame>>,
}

impl Bridge {
    pub(crate) fn deliver(&mut self, frame: &Rc<BusFrame>) {
        self.unread = Some(Rc::clone(frame));
    }

    /// The frame that the bridge sends now, and its freshness.
    pub(crate) fn send(&mut self, status: Option<&Rc<Status>>, now_ns: u64) -> Option<(FrameHeader, Freshness)> {
        if let Some(status) = status {
            self.pace.note_rate(status.run_id, status.rate_hz);
        }
        if let Some(next) = self.unread.take() {
            self.pace.note_frame(&self.latest.unwrap_or_default(), &next.header);
            self.latest = Some(next.header);
        }
        let latest = self.latest?;
        Some((latest, self.pace.freshness(&latest, now_ns, StaleAfter::default())))
    }
}

/// A list of the nodes on the bus.
pub(crate) fn members(source: Option<u64>, living: &[(&str, u64)]) -> Members {
    let node =
        |&(name, life): &(&str, u64)| bench_dragon_ipc::NodeEntry { name: name.to_owned(), pid: Some(life as u32) };
    Members {
        source: source.map(|life| life as u32),
        has_source: source.is_some(),
        living: living.iter().map(node).collect(),
        ..Members::default()
    }
}

/// The lamp of a name.
pub(crate) fn lamp<'a>(lamps: &'a [Lamp], name: &str) -> &'a Lamp {
    lamps.iter().find(|lamp| lamp.name == name).expect("all lamps are there")
}
