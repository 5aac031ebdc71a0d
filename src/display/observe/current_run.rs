//! The run that the newest frame is of, and what follows from its frames.

use std::io;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance};
use bench_dragon_geometry::dragon::Board;
use bench_dragon_ipc::{FrameHeader, GuardState, HandleState, Status};

use super::described_run::{ClearanceChart, DescribedRun};
use super::head_motion::{HeadMotion, TravelClock};
use super::planned_clearance::ClearancePlanner;
use super::show_forecast::ShowForecast;
use super::snapshot::LeastClearance;
use crate::config::Config;
use crate::safety::forecast::Forecaster;
use crate::safety::monitor::plan_view;

/// Wall time that may pass between the last frame of a run and the first one that is seen of the run that goes on with it, in
/// seconds.
const LONGEST_BREAK_S: f64 = 1.0;

/// A run with its description.
#[derive(Debug)]
pub(super) struct CurrentRun {
    pub(super) run: Arc<DescribedRun>,
    pub(super) chart: Arc<ClearanceChart>,
    pub(super) least: Option<LeastClearance>,
    walking_speed: WalkingSpeed,
    /// Show time of the newest frame, in seconds.
    time_s: f64,
    clearances: ClearanceSearch,
    boards: Vec<Board>,
    forecaster: Forecaster,
    /// Clearance that is looked for: 0, or the guard's margin.
    looked_for_m: f64,
    pub(super) planner: Option<ClearancePlanner>,
}

impl CurrentRun {
    /// Begins with a frame. A run that goes on where an earlier one of the same configuration stood, as after a restart of the
    /// server, keeps what that one has seen; one that begins anew is a show of its own. `plans`: whether its planned clearance is
    /// worked out; of an earlier run of the same configuration it is kept.
    ///
    /// # Errors
    /// The operating system's reason why there can be no thread that looks ahead.
    pub(super) fn begin(
        config: Config,
        header: &FrameHeader,
        mut earlier: Option<Self>,
        plans: bool,
    ) -> io::Result<Self> {
        earlier = earlier.filter(|earlier| earlier.run.config.to_toml() == config.to_toml());
        let planner = match earlier.as_mut().and_then(|earlier| earlier.planner.take()) {
            None if plans => Some(ClearancePlanner::start(config.dragon(), config.tables().monitor.near_m)?),
            planner => planner,
        };
        let forecaster = Forecaster::start(config.dragon(), 0.0, header.head_travel_m)?;
        let goes_on = |earlier: &Self| {
            let longest_break_s = LONGEST_BREAK_S * header.time_scale.max(1.0);
            (header.sim_time_s() - earlier.time_s).abs() <= longest_break_s
        };
        let (chart, least, walking_speed) = match earlier.filter(goes_on) {
            Some(earlier) => (earlier.chart, earlier.least, earlier.walking_speed),
            None => (Arc::new(ClearanceChart::new(config.start_s(), config.end_s())), None, WalkingSpeed::default()),
        };
        Ok(Self {
            run: Arc::new(DescribedRun::new(header.run_id, config)),
            chart,
            least,
            walking_speed,
            time_s: header.sim_time_s(),
            clearances: ClearanceSearch::default(),
            boards: Vec::new(),
            forecaster,
            looked_for_m: 0.0,
            planner,
        })
    }

    /// Takes note of a frame, and finds its nearest pair; none where the frame is not of as many benches as were described.
    pub(super) fn measure(&mut self, header: &FrameHeader, handles: &[HandleState]) -> Option<PairClearance> {
        self.time_s = header.sim_time_s();
        self.walking_speed.note(header.head_speed_mps);
        let dragon = self.run.config.dragon();
        if handles.len() != dragon.dimensions().handles() {
            return None;
        }
        dragon.place_boards_at(handles, plan_view, &mut self.boards);
        let nearest = self.clearances.nearest(&self.boards)?;
        Arc::make_mut(&mut self.chart).note(self.time_s, nearest.clearance_m);
        if self.least.is_none_or(|least| nearest.clearance_m < least.clearance_m) {
            self.least = Some(LeastClearance { clearance_m: nearest.clearance_m, time_s: self.time_s });
        }
        Some(nearest)
    }

    /// What lies ahead of a frame. Asks for a new forecast where the present one says nothing of it.
    pub(super) fn look_ahead(
        &mut self,
        header: &FrameHeader,
        nearest: Option<PairClearance>,
        status: Option<&Status>,
    ) -> ShowForecast {
        let guarded = status.filter(|status| !matches!(status.guard_state(), None | Some(GuardState::None)));
        let travel_m = header.head_travel_m;
        self.look_for(if guarded.is_some() { self.run.config.tables().monitor.margin_m } else { 0.0 }, travel_m);
        let is_found = nearest.is_some_and(|pair| pair.clearance_m <= self.looked_for_m);
        let forecast = self.forecaster.latest();
        self.forecaster.follow(&forecast, travel_m, is_found);
        let motion = HeadMotion::new(header, self.clock(header), self.run.config.tables().head.accel_mps2);
        let end_m = self.run.config.dragon().end_travel_m();
        ShowForecast::of(&forecast, &motion, header.show_state(), end_m, guarded)
    }

    /// Looks for where some pair's clearance falls to this, from a travel on. Whether a head is guarded is known with the first
    /// status.
    fn look_for(&mut self, clearance_m: f64, from_m: f64) {
        if clearance_m == self.looked_for_m {
            return;
        }
        match Forecaster::start(self.run.config.dragon(), clearance_m, from_m) {
            Ok(forecaster) => {
                self.forecaster = forecaster;
                self.looked_for_m = clearance_m;
            }
            Err(error) => tracing::warn!("the guard's stop is not forecast: cannot start a thread: {error}"),
        }
    }

    /// When the head of a frame comes to a travel.
    pub(super) fn clock(&self, header: &FrameHeader) -> TravelClock {
        // The speed at which the head walks on after a stand or a change of speed.
        let speed_mps = self.walking_speed.steady_mps.unwrap_or(self.run.config.tables().head.speed_mps);
        TravelClock { travel_m: header.head_travel_m, time_s: header.sim_time_s(), speed_mps }
    }
}

/// The speed at which a head last walked steadily.
///
/// On its way to a rest a head with bounded acceleration has every speed down to none: what it had in passing is not what it will
/// go on at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WalkingSpeed {
    last_mps: f64,
    /// In metres a show second; `None` of a head that has not walked steadily yet.
    steady_mps: Option<f64>,
}

impl WalkingSpeed {
    /// Takes note of the speed in the next frame that is looked at.
    fn note(&mut self, speed_mps: f64) {
        if speed_mps > 0.0 && speed_mps.to_bits() == self.last_mps.to_bits() {
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
        let chain = config.dragon().chain(time_s).expect("within the run");
        chain
            .map(|at| HandleState { position_m: [at.position.x, at.position.y, 0.0], ..HandleState::default() })
            .collect()
    }

    /// A run that has touched, seen up to this show time.
    fn touched(time_s: f64) -> CurrentRun {
        let mut run = CurrentRun::begin(paper(), &frame(1, time_s), None, false).expect("a thread");
        run.measure(&frame(1, 412.5), &handles(412.5)).expect("a nearest pair");
        run.measure(&frame(1, time_s), &handles(time_s)).expect("a nearest pair");
        assert!(run.least.is_some_and(|least| least.clearance_m < 0.0), "{:?}", run.least);
        run
    }

    #[test]
    fn a_run_that_goes_on_where_another_one_stood_keeps_its_chart_and_no_other_run_does() {
        let keeps = |from_s: f64, time_scale: f64, config: Config| {
            let header = FrameHeader { time_scale, ..frame(2, from_s) };
            let run = CurrentRun::begin(config, &header, Some(touched(300.0)), false).expect("a thread");
            assert_eq!(run.least.is_some(), run.chart.revisions > 0);
            run.least.is_some()
        };
        assert!(keeps(300.0, 1.0, paper()) && keeps(300.9, 1.0, paper()) && keeps(299.1, 1.0, paper()));
        assert!(keeps(315.0, 20.0, paper()), "as much of it passes in a second");
        assert!(!keeps(0.0, 1.0, paper()), "a show after its rehearsal");
        assert!(!keeps(298.0, 1.0, paper()) && !keeps(302.0, 1.0, paper()) && !keeps(302.0, 0.1, paper()));
        assert!(!keeps(300.0, 1.0, paper().with_head_speed(0.5).expect("a speed")), "another configuration");
    }

    #[test]
    fn a_pause_does_not_move_the_forecast() {
        let slow = |time_s| FrameHeader { head_speed_mps: 0.5, ..frame(1, time_s) };
        let mut run = CurrentRun::begin(paper(), &slow(411.0), None, false).expect("a thread");
        for time_s in [411.0, 411.1] {
            // It walks half a metre a show second.
            run.measure(&slow(time_s), &handles(411.0));
        }
        let walking = FrameHeader { head_travel_m: 411.0, ..slow(411.1) };
        let patience = Instant::now() + Duration::from_mins(1);
        let expected_s = loop {
            if let Some(contact_s) = run.look_ahead(&walking, None, None).contact_s() {
                break contact_s;
            }
            assert!(Instant::now() < patience, "the forecast finds the contact");
        };
        assert!((expected_s - (411.1 + 1.473_838 / 0.5)).abs() < 1e-5, "{expected_s}");
        let paused = FrameHeader { head_speed_mps: 0.0, ..walking };
        run.measure(&paused, &handles(411.0));
        assert_eq!(run.look_ahead(&paused, None, None).contact_s(), Some(expected_s));
    }

    fn after(speeds_mps: &[f64]) -> Option<f64> {
        let mut speed = WalkingSpeed::default();
        for &speed_mps in speeds_mps {
            speed.note(speed_mps);
        }
        speed.steady_mps
    }

    #[test]
    fn a_head_that_stands_goes_on_as_it_walked_before_it_slowed_down() {
        assert_eq!(after(&[1.0, 1.0, 0.5, 0.5, 0.0, 0.0]), Some(0.5));
        assert_eq!(after(&[0.5, 0.5, 0.4, 0.25, 0.01, 0.0]), Some(0.5));
    }

    #[test]
    fn of_a_head_that_never_walked_nothing_is_known() {
        assert_eq!(after(&[0.0, 0.0]), None);
        assert_eq!(after(&[0.0, 0.2, 0.4]), None);
    }
}
