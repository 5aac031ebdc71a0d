//! A snapshot of the paper's dragon, for tests.

use std::sync::Arc;

use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_ipc::{Alert, AlertKind, FrameHeader, HandleState, ShowState};

use crate::config::{Config, Overrides};
use crate::display::observe::{
    AlertLog, Arrival, ClearanceChart, DescribedRun, FrameCopy, LeastClearance, ShowForecast, Snapshot, SourcePresence,
};
use crate::safety::monitor::run_alert;

/// The paper's dragon at a show time, live.
pub(super) fn snapshot(state: ShowState, time_s: f64) -> Snapshot {
    let run = DescribedRun::new(7, Config::load(None, Overrides::default()).expect("the paper's"));
    let dragon = run.config.dragon();
    let positions: Vec<_> = dragon.chain(time_s).expect("within the run").map(|handle| handle.position).collect();
    let mut boards = Vec::new();
    dragon.place_boards_at(&positions, |position| *position, &mut boards);
    let nearest = ClearanceSearch::default().nearest(&boards).expect("three boards and more");
    let mut chart = ClearanceChart::new(run.config.start_s(), run.config.end_s());
    (0..time_s as u32).for_each(|second| chart.note(second.into(), nearest.clearance_m));
    let handles = positions.iter().map(|at| HandleState { position_m: [at.x, at.y, 0.0], ..HandleState::default() });
    let header = FrameHeader {
        run_id: 7,
        sim_time_ns: (time_s * 1e9) as i64,
        head_travel_m: time_s,
        head_speed_mps: 1.0,
        time_scale: 20.0,
        bench_count: 223,
        state: state.to_wire(),
        ..FrameHeader::default()
    };
    let mut alerts = AlertLog::default();
    alerts.push(run_alert(&header, AlertKind::Restarted));
    alerts.push(Alert { bench_a: 0, bench_b: 11, ..run_alert(&header, AlertKind::Near) });
    let contact_s = 412.473_838;
    let arrival = Arrival { travel_m: contact_s, time_s: contact_s, wall_s: (contact_s - time_s) / 20.0 };
    Snapshot {
        presence: SourcePresence::Live,
        frame: Some(Arc::new(FrameCopy { header, handles: handles.collect() })),
        nearest: Some(nearest),
        least: Some(LeastClearance { clearance_m: nearest.clearance_m, time_s }),
        forecast: ShowForecast::Contact { at: arrival, benches: [0, 8] },
        chart: Some(Arc::new(chart)),
        run: Some(Arc::new(run)),
        alerts: Arc::new(alerts),
        ..Snapshot::default()
    }
}
