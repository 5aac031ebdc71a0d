//! The run that is being looked at: what is worked out of its frames.

use std::sync::Arc;

use bench_dragon_ipc::{FrameHeader, HandleState};
use glam::DVec2;

use super::clearance_chart::ClearanceChart;
use super::outlook::Outlook;
use super::run::Run;
use crate::config::Config;
use crate::dragon::{Board, ClearanceSearch, PairClearance};
use crate::monitor::forecast::Forecaster;

/// A run with its description.
#[derive(Debug)]
pub(super) struct WatchedRun {
    pub(super) run: Arc<Run>,
    pub(super) chart: Arc<ClearanceChart>,
    pub(super) least: Option<(f64, f64)>,
    clearances: ClearanceSearch,
    boards: Vec<Board>,
    forecaster: Forecaster,
    /// Travel from which the forecast was last asked for.
    asked_from_m: f64,
}

impl WatchedRun {
    /// Begins with a frame. A run that goes on with what an earlier one began, as after a restart of the server, keeps its
    /// chart.
    pub(super) fn begin(config: Config, header: &FrameHeader, earlier: Option<Self>) -> Self {
        let from_m = header.head_travel_m;
        let forecaster = Forecaster::start(Arc::clone(config.dragon()), from_m);
        let earlier = earlier.filter(|earlier| earlier.run.config.to_toml() == config.to_toml());
        let (chart, least) = match earlier {
            Some(earlier) => (earlier.chart, earlier.least),
            None => (Arc::new(ClearanceChart::new(config.start_s(), config.end_s())), None),
        };
        Self {
            run: Arc::new(Run::new(header.run_id, config)),
            chart,
            least,
            clearances: ClearanceSearch::default(),
            boards: Vec::new(),
            forecaster,
            asked_from_m: from_m,
        }
    }

    /// The nearest pair of a frame; none where the frame is not of as many benches as were described.
    pub(super) fn measure(&mut self, header: &FrameHeader, handles: &[HandleState]) -> Option<PairClearance> {
        let dragon = self.run.config.dragon();
        if handles.len() != dragon.dimensions().handles() {
            return None;
        }
        dragon.place_boards_at(handles, plan_view, &mut self.boards);
        let nearest = self.clearances.nearest(&self.boards)?;
        let time_s = header.sim_time_s();
        Arc::make_mut(&mut self.chart).note(time_s, nearest.clearance_m);
        if self.least.is_none_or(|(least_m, _)| nearest.clearance_m < least_m) {
            self.least = Some((nearest.clearance_m, time_s));
        }
        Some(nearest)
    }

    /// What lies ahead of a frame. Asks for a new forecast where the present one says nothing of it.
    pub(super) fn look_ahead(&mut self, header: &FrameHeader, nearest: Option<PairClearance>) -> Outlook {
        let forecast = self.forecaster.latest();
        let travel_m = header.head_travel_m;
        let is_touching = nearest.is_some_and(|pair| pair.clearance_m <= 0.0);
        if self.asked_from_m == forecast.from_m && !forecast.covers(travel_m) && !is_touching {
            self.forecaster.restart(travel_m);
            self.asked_from_m = travel_m;
        }
        let config = &self.run.config;
        Outlook::of(&forecast, header, config.head_speed_mps(), config.dragon().end_travel_m())
    }
}

fn plan_view(handle: &HandleState) -> DVec2 {
    DVec2::new(handle.position_m[0], handle.position_m[1])
}
