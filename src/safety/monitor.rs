//! The collision monitor: measures every frame, and sweeps the travel between frames.
//!
//! - *Measure:* from the poses of a frame, the monitor measures the clearance of every pair of benches that could touch.
//! - *Sweep:* between two frames that the head walked, the monitor uses the published description to find the exact travel at
//!   which a pair touches or parts. So it misses no contact at any rate, time scale or loss of frames. It does not sweep travel
//!   that the [`forecast`](super::forecast) has already shown to be free.
//! - *Stage:* in each frame, the monitor compares the boards with the borders of the stage. Between frames, it finds the exact travel
//!   at which a board passes a border, comes too near, or is clear again (`stage_watch`).
//! - The monitor never sweeps travel across a seek or a restart, because the head did not walk it (`source_motion`).
//!
//! The work and the alerts of a frame are bounded for every dragon. A sweep ends early if it needs too many steps. The monitor
//! watches at most the nearest [`MAX_WATCHED`] pairs. Alerts have a greatest rate ([`ALERTS_PER_S`]). The monitor counts
//! incomplete sweeps and omitted alerts.
//!
//! Pure: frames go in, alerts come out. The command owns the clocks, the bus and the search thread.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::alerts::AlertLimit;
use super::forecast::Forecast;
use super::source_motion::SourceMotion;
use super::stage_watch::{StageEvent, StageWatch};
use crate::config::{Config, FORECAST_SPEED_MPS};
use bench_dragon_geometry::clearance::{ClearanceSearch, Contact, CourseSearch, PairClearance, PairEvent};
use bench_dragon_geometry::dragon::{Board, Meter};
use bench_dragon_geometry::formation::Formation;
use bench_dragon_ipc::{Alert, AlertKind, FrameHeader, HandleState};

#[cfg(doc)]
use super::alerts::ALERTS_PER_S;

/// Clearance ÷ warning distance above which a near pair is no longer watched.
const UNWATCH_RATIO: f64 = 1.25;
/// Greatest overlap in metres that is only the rounding of a touch. The sweep finds that touch.
const TOUCH_TOLERANCE_M: f64 = 1e-9;
/// Greatest number of watched pairs.
pub const MAX_WATCHED: usize = 10_000;
/// Greatest work of the sweep up to a frame in steps: about a fifth of a second. The paper's dragon needs a thousand steps
/// between two frames.
const SWEEP_STEPS: u64 = 4_000_000;

/// State of a watched pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PairState {
    Near,
    Touching,
}

/// Monitor of one run of a formation.
#[derive(Debug)]
pub struct Monitor {
    /// The watched dragons.
    pub formation: Arc<Formation>,
    source: SourceMotion,
    near_m: f64,
    planned_speed_mps: f64,
    clearances: ClearanceSearch,
    contacts: CourseSearch,
    boards: Vec<Board>,
    pairs: BTreeMap<[usize; 2], PairState>,
    /// The boards on the stage; `None` for a stage without borders.
    stage: Option<StageWatch>,
    last: Option<FrameHeader>,
    alerts: Vec<Alert>,
    limit: AlertLimit,
    sweeping: Meter,
    /// Whether all further sweeps share the work limit of one sweep.
    is_ending: bool,
    /// Number of frames whose sweep ended early because it needed too much work.
    pub unswept: u64,
}

impl Monitor {
    /// A monitor of a run with its published configuration.
    pub fn new(config: &Config) -> Self {
        let formation = Arc::clone(config.formation());
        let sweeping = Meter::of(SWEEP_STEPS);
        Self {
            source: SourceMotion::of(config),
            near_m: config.tables().monitor.near_m,
            planned_speed_mps: config.tables().head.speed_mps,
            clearances: ClearanceSearch::of(formation.layout()).with_room(MAX_WATCHED),
            contacts: CourseSearch::within(&formation.metered(&sweeping), 0.0),
            boards: Vec::with_capacity(formation.layout().benches()),
            pairs: BTreeMap::new(),
            stage: StageWatch::new(&formation.metered(&sweeping), config.stage()),
            last: None,
            alerts: Vec::new(),
            limit: AlertLimit::new(),
            sweeping,
            is_ending: false,
            unswept: 0,
            formation,
        }
    }

    /// From now on, all sweeps share the work limit of one sweep, so that an ending monitor ends soon.
    pub fn end_soon(&mut self) {
        self.is_ending = true;
    }

    /// Number of alerts that exceeded the limit and were left out.
    pub fn suppressed(&self) -> u64 {
        self.limit.suppressed
    }

    /// Whether a pair touches in the last frame.
    pub fn is_touching(&self) -> bool {
        self.pairs.values().any(|&state| state == PairState::Touching)
    }

    /// Takes the next frame of the run, and stores its alerts in [`Monitor::alerts`]. Returns the pair with the least
    /// clearance; `None` if all benches are neighbours.
    pub fn observe(
        &mut self,
        header: &FrameHeader,
        handles: &[HandleState],
        forecast: Option<&Forecast>,
    ) -> Option<PairClearance> {
        self.alerts.clear();
        let forecast_ns = self.forecast_ns(header, forecast);
        match self.last.replace(*header) {
            Some(last) if self.source.has_walked(&last, header) => {
                self.sweep(&last, header, forecast);
                self.sweep_stage(&last, header);
            }
            _ => {
                self.pairs.clear();
                self.stage.iter_mut().for_each(StageWatch::restart);
                self.sweep_stage(header, header);
            }
        }
        let nearest = self.measure(header, handles, forecast_ns);
        if let Some(stage) = &mut self.stage {
            stage.observe(&self.boards, |event| self.alerts.push(stage_alert(header, &event, header.show_time_ns)));
        }
        self.limit.apply(header.scheduled_ns, &mut self.alerts);
        nearest
    }

    /// Alerts of the last frame, in the order of their events.
    pub fn alerts(&self) -> &[Alert] {
        &self.alerts
    }

    /// Finds the contacts and partings on the travel from `last` to `next`.
    fn sweep(&mut self, last: &FrameHeader, next: &FrameHeader, forecast: Option<&Forecast>) {
        let (from_m, to_m) = (last.course_m, next.course_m);
        let known_free = forecast.is_some_and(|forecast| forecast.is_free(from_m, to_m));
        if from_m == to_m || known_free && !self.is_touching() {
            return;
        }
        if !self.is_ending {
            self.sweeping.restart();
        }
        let swept = self.contacts.sweep(from_m, to_m);
        self.unswept += u64::from(swept.reached_m < to_m);
        for event in swept.events {
            let (kind, state, touch) = match event {
                PairEvent::Touch(touch) => (AlertKind::Contact, PairState::Touching, touch),
                PairEvent::Part(touch) => (AlertKind::Parted, PairState::Near, touch),
            };
            let show_time_ns = show_time_ns(last, next, touch.travel_m);
            if self.pairs.insert(touch.benches, state) != Some(state) {
                self.alerts.push(touch_alert(next, kind, touch, show_time_ns));
            }
        }
    }

    /// Finds the boards that pass borders of the stage, or come near them, on the travel from `last` to `next`.
    fn sweep_stage(&mut self, last: &FrameHeader, next: &FrameHeader) {
        let Self { stage: Some(stage), formation, alerts, .. } = self else { return };
        self.unswept += u64::from(!stage.is_complete());
        stage.sweep(formation, next.course_m, |event| {
            let at_m = event.course_m.unwrap_or(next.course_m);
            alerts.push(stage_alert(next, &event, show_time_ns(last, next, at_m)));
        });
    }

    /// Measures the frame and updates the watched pairs.
    fn measure(&mut self, header: &FrameHeader, handles: &[HandleState], forecast_ns: i64) -> Option<PairClearance> {
        self.formation.place_boards(handles, |handle| handle.position_m.into(), &mut self.boards);
        let unwatch_m = self.near_m * UNWATCH_RATIO;
        let found = self.clearances.nearest_and_within(&self.boards, unwatch_m);
        let mut watched = BTreeMap::new();
        for pair in found.iter().take(MAX_WATCHED).filter(|pair| pair.clearance_m <= unwatch_m) {
            let known = self.pairs.get(&pair.benches).copied();
            let state = match known {
                None | Some(PairState::Near) if pair.clearance_m < -TOUCH_TOLERANCE_M => Some(PairState::Touching),
                None if pair.clearance_m <= self.near_m => Some(PairState::Near),
                known => known,
            };
            let Some(state) = state else { continue };
            if known != Some(state) {
                let kind = if state == PairState::Near { AlertKind::Near } else { AlertKind::Contact };
                self.alerts.push(pair_alert(header, kind, pair, forecast_ns));
            }
            watched.insert(pair.benches, state);
        }
        self.pairs = watched;
        found.first().copied()
    }

    /// Show time of the forecast contact at the present speed of the head; at the planned speed while the head stands.
    fn forecast_ns(&self, header: &FrameHeader, forecast: Option<&Forecast>) -> i64 {
        let ahead = forecast
            .filter(|forecast| forecast.covers(header.course_m))
            .and_then(|forecast| forecast.contact)
            .map(|contact| contact.travel_m - header.course_m);
        let walks = header.course_mps >= FORECAST_SPEED_MPS;
        let speed_mps = if walks { header.course_mps } else { self.planned_speed_mps };
        ahead.map_or(Alert::NO_FORECAST, |ahead_m| header.show_time_ns + (ahead_m / speed_mps * 1e9).round() as i64)
    }
}

/// An alert of the whole run, without a pair.
pub fn run_alert(header: &FrameHeader, kind: AlertKind) -> Alert {
    Alert {
        run_id: header.run_id,
        tick: header.tick,
        show_time_ns: header.show_time_ns,
        forecast_ns: Alert::NO_FORECAST,
        clearance_m: 0.0,
        point_m: [0.0; 2],
        kind: kind.to_wire(),
        bench_a: Alert::NO_BENCH,
        bench_b: Alert::NO_BENCH,
        reserved: 0,
    }
}

/// Show time at a place of the course between two frames, evenly between them.
fn show_time_ns(last: &FrameHeader, next: &FrameHeader, course_m: f64) -> i64 {
    let walked_m = next.course_m - last.course_m;
    let share = if walked_m > 0.0 { (course_m - last.course_m) / walked_m } else { 1.0 };
    let show_step_ns = (next.show_time_ns - last.show_time_ns) as f64;
    last.show_time_ns + (share * show_step_ns).round() as i64
}

/// An alert of a board that passes a border of the stage, comes too near, or is clear again.
fn stage_alert(header: &FrameHeader, event: &StageEvent, show_time_ns: i64) -> Alert {
    Alert {
        show_time_ns,
        clearance_m: event.distance_m,
        point_m: event.point.to_array(),
        bench_a: event.bench as u32,
        ..run_alert(header, event.kind)
    }
}

/// A frame of run 1 whose head has walked one metre per show second since 0.
#[cfg(test)]
pub(crate) fn walking_frame(tick: u64, show_time_s: f64) -> FrameHeader {
    FrameHeader {
        run_id: 1,
        tick,
        show_time_ns: (show_time_s * 1e9) as i64,
        head_travel_m: show_time_s,
        head_speed_mps: 1.0,
        time_scale: 1.0,
        ..FrameHeader::default()
    }
    .of_one_dragon()
}

/// An alert that a frame differs from the published description, with the nearest pair in the frame.
pub fn fault_alert(header: &FrameHeader, nearest: Option<PairClearance>) -> Alert {
    let none = run_alert(header, AlertKind::Fault);
    nearest.map_or(none, |pair| pair_alert(header, AlertKind::Fault, &pair, Alert::NO_FORECAST))
}

fn pair_alert(header: &FrameHeader, kind: AlertKind, pair: &PairClearance, forecast_ns: i64) -> Alert {
    Alert {
        forecast_ns,
        clearance_m: pair.clearance_m,
        point_m: pair.point.to_array(),
        bench_a: pair.benches[0] as u32,
        bench_b: pair.benches[1] as u32,
        ..run_alert(header, kind)
    }
}

/// An alert of a touch that the sweep found. Its clearance is 0; for a contact, its forecast is the instant of the touch.
fn touch_alert(header: &FrameHeader, kind: AlertKind, touch: &Contact, show_time_ns: i64) -> Alert {
    let pair = PairClearance { benches: touch.benches, clearance_m: 0.0, point: touch.point };
    let forecast_ns = if kind == AlertKind::Contact { show_time_ns } else { Alert::NO_FORECAST };
    Alert { show_time_ns, ..pair_alert(header, kind, &pair, forecast_ns) }
}
