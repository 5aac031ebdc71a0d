//! The run of the newest frame, and the values derived from its frames.

use std::io;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance, PlayEnd, first_breach};
use bench_dragon_geometry::dragon::{Board, Meter};
use bench_dragon_geometry::formation::Planned;
use bench_dragon_ipc::{FrameHeader, GuardState, HandleState, Status};

use super::clearance_memory::ClearanceMemory;
use super::described_run::{ClearanceChart, DescribedRun};
use super::head_motion::{Arrival, HeadMotion, TravelClock};
use super::planned_clearance::ClearancePlanner;
use super::show_forecast::ShowForecast;
use super::snapshot::LeastClearance;
use crate::config::{Config, FORECAST_SPEED_MPS};
use crate::safety::forecast::Forecaster;

/// Greatest work for finding where a board comes too near to a border, in steps: about a fifth of a second.
const BORDER_STEPS: u64 = 4_000_000;

/// Greatest wall time between the last frame of a run and the first frame of the run that continues it, in seconds.
const LONGEST_BREAK_S: f64 = 1.0;

/// A run with its description.
#[derive(Debug)]
pub(super) struct CurrentRun {
    pub(super) run: Arc<DescribedRun>,
    pub(super) chart: Arc<ClearanceChart>,
    pub(super) least: Option<LeastClearance>,
    walking_speed: WalkingSpeed,
    /// Speed that the run's start or the last command has ordered, in metres per show second; `None` if it is unknown.
    ordered_mps: Option<f64>,
    /// Show time at which the run ends, however far the head has walked, in seconds; `None` without such a limit.
    until_s: Option<f64>,
    /// Show time of the newest frame, in seconds.
    time_s: f64,
    clearances: ClearanceSearch,
    boards: Vec<Board>,
    /// `None` for an observer without forecasts.
    forecaster: Option<Forecaster>,
    /// Clearance that the forecast searches for: 0, or the guard's margin.
    looked_for_m: f64,
    /// Place of the course at which a board comes too near to a border that the guard keeps clear.
    border_m: Option<f64>,
    pub(super) planner: Option<ClearancePlanner>,
}

impl CurrentRun {
    /// Begins a run with its first frame.
    ///
    /// A run that continues an earlier one of the same configuration, for example after a restart of the server, keeps that
    /// run's chart, least clearance and speed. Any other run starts without them, or with what `memory` has of it.
    /// `plans`: whether to compute the planned clearance; `forecasts`: whether to look ahead. A plan of the same
    /// configuration is kept.
    ///
    /// # Errors
    /// The operating system's reason if the forecast's or the planner's thread cannot start.
    pub(super) fn begin(
        config: Config,
        header: &FrameHeader,
        mut earlier: Option<Self>,
        [plans, forecasts]: [bool; 2],
        memory: Option<&ClearanceMemory>,
    ) -> io::Result<Self> {
        earlier = earlier.filter(|earlier| earlier.run.config.to_toml() == config.to_toml());
        let planner = match earlier.as_mut().and_then(|earlier| earlier.planner.take()) {
            None if plans => Some(ClearancePlanner::start(config.formation(), config.tables().monitor.near_m)?),
            planner => planner,
        };
        let forecaster = forecasts.then(|| Forecaster::start(config.formation(), 0.0, header.course_m)).transpose()?;
        let goes_on = |earlier: &Self| {
            let longest_break_s = LONGEST_BREAK_S * header.time_scale.max(1.0);
            (header.show_time_s() - earlier.time_s).abs() <= longest_break_s
        };
        let (chart, least, walking_speed) = if let Some(earlier) = earlier.filter(goes_on) {
            (earlier.chart, earlier.least, earlier.walking_speed)
        } else {
            let mut chart = ClearanceChart::new(config.start_s(), config.end_s());
            let least = memory.and_then(|memory| memory.recall(header.run_id, &mut chart));
            (Arc::new(chart), least, WalkingSpeed::default())
        };
        Ok(Self {
            border_m: border_m(&config).filter(|_| forecasts),
            clearances: ClearanceSearch::of(config.formation().layout()),
            run: Arc::new(DescribedRun::new(header.run_id, config)),
            chart,
            least,
            walking_speed,
            ordered_mps: None,
            until_s: None,
            time_s: header.show_time_s(),
            boards: Vec::new(),
            forecaster,
            looked_for_m: 0.0,
            planner,
        })
    }

    /// Records the ordered speed, and the show time at which the run ends.
    pub(super) fn order(&mut self, speed_mps: Option<f64>, until_s: Option<f64>) {
        (self.ordered_mps, self.until_s) = (speed_mps, until_s);
    }

    /// Records a frame and finds its nearest pair. Returns `None` if the frame's number of benches differs from the
    /// description.
    pub(super) fn measure(&mut self, header: &FrameHeader, handles: &[HandleState]) -> Option<PairClearance> {
        self.time_s = header.show_time_s();
        self.walking_speed.note(header.course_mps);
        let formation = self.run.config.formation();
        if handles.len() != formation.layout().handles() {
            return None;
        }
        formation.place_boards(handles, |handle| handle.position_m.into(), &mut self.boards);
        let nearest = self.clearances.nearest(&self.boards)?;
        Arc::make_mut(&mut self.chart).note(self.time_s, nearest.clearance_m);
        if self.least.is_none_or(|least| nearest.clearance_m < least.clearance_m) {
            self.least = Some(LeastClearance { clearance_m: nearest.clearance_m, time_s: self.time_s });
        }
        Some(nearest)
    }

    /// Returns the forecast from a frame on, and the earliest possible contact of loose hinges. Requests a new forecast
    /// if the present one does not cover the frame.
    pub(super) fn look_ahead(
        &mut self,
        header: &FrameHeader,
        nearest: Option<PairClearance>,
        status: Option<&Status>,
    ) -> (ShowForecast, Option<Arrival>) {
        let guarded = status.filter(|status| !matches!(status.guard_state(), None | Some(GuardState::None)));
        let travel_m = header.course_m;
        self.look_for(if guarded.is_some() { self.run.config.tables().monitor.margin_m } else { 0.0 }, travel_m);
        let is_found = nearest.is_some_and(|pair| pair.clearance_m <= self.looked_for_m);
        let Some(forecaster) = &mut self.forecaster else { return (ShowForecast::Unknown, None) };
        let forecast = forecaster.latest();
        forecaster.advance(&forecast, travel_m, is_found);
        let motion = HeadMotion::new(header, self.clock(header), self.run.config.accel_mps2_at(travel_m), status);
        let end_m = self.run.config.formation().end_m();
        let possible = ShowForecast::possible_contact(&forecast, &motion, header.show_state());
        let state = header.show_state();
        let ahead = ShowForecast::of(&forecast, &motion, state, end_m, guarded, self.border_m);
        (self.until_s.map_or(ahead, |until_s| ahead.until(until_s, &motion)), possible)
    }

    /// Where the proof about loose hinges ends, if the search has got there.
    pub(super) fn play_end(&self) -> Option<PlayEnd> {
        self.forecaster.as_ref()?.latest().play_end()
    }

    /// Searches for the first travel from `from_m` on at which some pair's clearance falls to `clearance_m`. The first status
    /// decides which clearance to search for, since it reports whether the head is guarded.
    fn look_for(&mut self, clearance_m: f64, from_m: f64) {
        if clearance_m == self.looked_for_m || self.forecaster.is_none() {
            return;
        }
        match Forecaster::start(self.run.config.formation(), clearance_m, from_m) {
            Ok(forecaster) => {
                self.forecaster = Some(forecaster);
                self.looked_for_m = clearance_m;
            }
            Err(error) => tracing::warn!("the guard's stop is not forecast: cannot start a thread: {error}"),
        }
    }

    /// Returns the clock that converts travel to show time, from a frame on.
    pub(super) fn clock(&self, header: &FrameHeader) -> TravelClock {
        // The speed at which the head walks on after a standstill or a change of speed.
        let ordered_mps = self.ordered_mps.filter(|speed_mps| *speed_mps >= FORECAST_SPEED_MPS);
        let planned_mps = self.run.config.tables().head.speed_mps;
        let speed_mps = ordered_mps.or(self.walking_speed.steady_mps).unwrap_or(planned_mps);
        TravelClock { travel_m: header.course_m, time_s: header.show_time_s(), speed_mps }
    }
}

/// The first place of the course at which a board comes too near to a border that the guard keeps clear. `None` also
/// where it takes too much work.
fn border_m(config: &Config) -> Option<f64> {
    let (stage, formation) = (config.guarded_stage()?, config.formation().metered(&Meter::of(BORDER_STEPS)));
    let place_m = |(number, planned): (usize, &Planned)| {
        let breach = first_breach(&planned.dragon, stage, stage.clear_m()).ok()??;
        Some(formation.place_of(number, breach.travel_m))
    };
    formation.dragons().iter().enumerate().filter_map(place_m).reduce(f64::min)
}

/// The last steady speed of a head.
///
/// A head with bounded acceleration passes through every lower speed while it brakes. It does not walk on at any of these.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WalkingSpeed {
    last_mps: f64,
    /// In metres per show second; `None` if the head has not walked steadily yet.
    steady_mps: Option<f64>,
}

impl WalkingSpeed {
    /// Records the speed in the next measured frame.
    fn note(&mut self, speed_mps: f64) {
        if speed_mps >= FORECAST_SPEED_MPS && speed_mps.to_bits() == self.last_mps.to_bits() {
            self.steady_mps = Some(speed_mps);
        }
        self.last_mps = speed_mps;
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;
    use crate::safety::monitor::walking_frame;

    fn paper() -> Config {
        Config::load(None, |_| ()).expect("the paper's")
    }

    fn frame(run_id: u64, time_s: f64) -> FrameHeader {
        FrameHeader { run_id, ..walking_frame(0, time_s) }
    }

    fn handles(time_s: f64) -> Vec<HandleState> {
        let config = paper();
        let chain = config.lead().chain(time_s).expect("within the run");
        chain.map(|at| HandleState { position_m: at.in_space().into(), ..HandleState::default() }).collect()
    }

    /// A run with a contact, measured up to this show time.
    fn touched(time_s: f64) -> CurrentRun {
        let mut run = CurrentRun::begin(paper(), &frame(1, time_s), None, [false, true], None).expect("a thread");
        run.measure(&frame(1, 412.5), &handles(412.5)).expect("a nearest pair");
        run.measure(&frame(1, time_s), &handles(time_s)).expect("a nearest pair");
        assert!(run.least.is_some_and(|least| least.clearance_m < 0.0), "{:?}", run.least);
        run
    }

    #[test]
    fn only_a_run_that_continues_an_earlier_one_keeps_its_chart() {
        let keeps = |from_s: f64, time_scale: f64, config: Config| {
            let header = FrameHeader { time_scale, ..frame(2, from_s) };
            let run = CurrentRun::begin(config, &header, Some(touched(300.0)), [false, true], None).expect("a thread");
            assert_eq!(run.least.is_some(), run.chart.revisions > 0);
            run.least.is_some()
        };
        assert!(keeps(300.0, 1.0, paper()) && keeps(300.9, 1.0, paper()) && keeps(299.1, 1.0, paper()));
        assert!(keeps(315.0, 20.0, paper()), "20 s of show time pass within a second");
        assert!(!keeps(0.0, 1.0, paper()), "a show after its rehearsal");
        assert!(!keeps(298.0, 1.0, paper()) && !keeps(302.0, 1.0, paper()) && !keeps(302.0, 0.1, paper()));
        assert!(!keeps(300.0, 1.0, paper().with_head_speed(0.5).expect("a speed")), "another configuration");
    }

    #[test]
    fn a_pause_does_not_change_the_forecast() {
        let slow = |time_s| FrameHeader { course_mps: 0.5, ..frame(1, time_s) };
        let mut run = CurrentRun::begin(paper(), &slow(411.0), None, [false, true], None).expect("a thread");
        for time_s in [411.0, 411.1] {
            // The head walks half a metre per show second.
            run.measure(&slow(time_s), &handles(411.0));
        }
        let walking = FrameHeader { course_m: 411.0, ..slow(411.1) };
        let deadline = Instant::now() + Duration::from_mins(1);
        let expected_s = loop {
            if let Some(contact_s) = run.look_ahead(&walking, None, None).0.contact_s() {
                break contact_s;
            }
            assert!(Instant::now() < deadline, "no forecast of the contact within a minute");
        };
        assert!((expected_s - (411.1 + 1.473_838 / 0.5)).abs() < 1e-5, "{expected_s}");
        let paused = FrameHeader { course_mps: 0.0, ..walking };
        run.measure(&paused, &handles(411.0));
        assert_eq!(run.look_ahead(&paused, None, None).0.contact_s(), Some(expected_s));
    }

    fn after(speeds_mps: &[f64]) -> Option<f64> {
        let mut speed = WalkingSpeed::default();
        for &speed_mps in speeds_mps {
            speed.note(speed_mps);
        }
        speed.steady_mps
    }

    #[test]
    fn a_standing_head_walks_on_at_its_speed_before_it_braked() {
        assert_eq!(after(&[1.0, 1.0, 0.5, 0.5, 0.0, 0.0]), Some(0.5));
        assert_eq!(after(&[0.5, 0.5, 0.4, 0.25, 0.01, 0.0]), Some(0.5));
        assert_eq!(after(&[0.5, 0.5, 1e-320, 1e-320]), Some(0.5), "no arrival can be forecast at that speed");
    }

    #[test]
    fn a_head_that_never_walked_steadily_has_no_steady_speed() {
        assert_eq!(after(&[0.0, 0.0]), None);
        assert_eq!(after(&[0.0, 0.2, 0.4]), None);
    }
}
