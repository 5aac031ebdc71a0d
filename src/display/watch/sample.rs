//! Snapshots and screens for tests.

use std::sync::Arc;

use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_ipc::{Alert, AlertKind, DragonMotion, FrameHeader, HandleState, ShowState};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::{Buffer, Cell};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::{KeyAction, Look, Screen, draw};
use crate::config::Config;
use crate::display::observe::{
    AlertLog, Arrival, ClearanceChart, DescribedRun, FrameCopy, LeastClearance, ShowForecast, Snapshot,
};
use crate::safety::monitor::{run_alert, walking_frame};

/// The paper's dragon at a show time, live.
pub(super) fn snapshot(state: ShowState, time_s: f64) -> Snapshot {
    let run = DescribedRun::new(7, Config::load(None, |_| ()).expect("the paper's"));
    let dragon = run.config.lead();
    let positions: Vec<_> = dragon.chain(time_s).expect("within the run").map(|handle| handle.in_space()).collect();
    let mut boards = Vec::new();
    dragon.place_boards_at(&positions, |position| *position, &mut boards);
    let nearest = ClearanceSearch::default().nearest(&boards).expect("at least three boards");
    let mut chart = ClearanceChart::new(run.config.start_s(), run.config.end_s());
    (0..time_s as u32).for_each(|second| chart.note(second.into(), nearest.clearance_m));
    let handles = positions.iter().map(|at| HandleState { position_m: (*at).into(), ..HandleState::default() });
    let (state, walking) = (state.to_wire(), walking_frame(0, time_s));
    let header = FrameHeader { run_id: 7, time_scale: 20.0, bench_count: 223, state, ..walking };
    let mut alerts = AlertLog::default();
    alerts.push(run_alert(&header, AlertKind::Restarted));
    alerts.push(Alert { bench_a: 0, bench_b: 11, ..run_alert(&header, AlertKind::Near) });
    let contact_s = 412.473_838;
    let arrival = Arrival { travel_m: contact_s, time_s: contact_s, wall_s: (contact_s - time_s) / 20.0 };
    Snapshot {
        frame: Some(Arc::new(FrameCopy { header, handles: handles.collect() })),
        nearest: Some(nearest),
        least: Some(LeastClearance { clearance_m: nearest.clearance_m, time_s }),
        forecast: ShowForecast::Contact { at: arrival, benches: [0, 8] },
        chart: Some(Arc::new(chart)),
        run: Some(Arc::new(run)),
        alerts: Arc::new(alerts),
        ..Snapshot::live(header)
    }
}

/// Two straight dragons at their starts, live: `gold` of 4 benches, and `silver` of 3 benches 20 m above. An alert about both is the
/// newest one.
pub(super) fn formation() -> Snapshot {
    let straight = "route = { kind = \"path\", segments = [{ kind = \"line\", length_m = 40 }]";
    let text = format!(
        "[[dragons]]\nname = \"gold\"\nbenches = 4\n{straight} }}\n\
         [[dragons]]\nname = \"silver\"\nbenches = 3\n{straight}, start_y_m = 20 }}\n"
    );
    let run = DescribedRun::new(7, Config::from_toml(&text).expect("valid"));
    let (mut motions, mut handles) = (Vec::new(), Vec::new());
    for planned in run.config.formation().dragons() {
        let first_handle = handles.len() as u32;
        let chain = planned.dragon.chain(planned.dragon.start_travel_m()).expect("within the run");
        handles.extend(chain.map(|at| HandleState { position_m: at.in_space().into(), ..HandleState::default() }));
        let bench_count = planned.dragon.dimensions().benches() as u32;
        motions.push(DragonMotion { first_handle, bench_count, ..DragonMotion::default() });
    }
    let header = FrameHeader { run_id: 7, time_scale: 1.0, bench_count: 7, ..FrameHeader::default() };
    let header = header.of_plan([0.0; 2], &motions).expect("two dragons");
    let mut alerts = AlertLog::default();
    alerts.push(Alert { bench_a: 3, bench_b: 4, ..run_alert(&header, AlertKind::Near) });
    Snapshot {
        frame: Some(Arc::new(FrameCopy { header, handles })),
        run: Some(Arc::new(run)),
        alerts: Arc::new(alerts),
        ..Snapshot::live(header)
    }
}

/// A snapshot whose head has this speed, without a run or a handle.
pub(super) fn walking(state: ShowState, head_speed_mps: f64) -> Snapshot {
    Snapshot::live(
        FrameHeader { run_id: 1, state: state.to_wire(), head_speed_mps, ..FrameHeader::default() }.of_one_dragon(),
    )
}

pub(super) fn new_screen(is_read_only: bool) -> Screen {
    Screen::new("dragon", Look::default(), is_read_only)
}

/// Presses keys, one after another, and returns their actions.
pub(super) fn type_keys(screen: &mut Screen, keys: &str, snapshot: &Snapshot) -> Vec<KeyAction> {
    let code = |key| if key == '\n' { KeyCode::Enter } else { KeyCode::Char(key) };
    let events = keys.chars().map(|key| KeyEvent::new(code(key), KeyModifiers::NONE));
    events.map(|event| screen.press(event, snapshot, 0)).filter(|action| *action != KeyAction::None).collect()
}

/// A screen that has handled a snapshot, and then these keys.
pub(super) fn screen_after(look: Look, keys: &str, snapshot: &Snapshot) -> Screen {
    let mut screen = Screen::new("dragon", look, false);
    screen.see(snapshot, 0);
    type_keys(&mut screen, keys, snapshot);
    screen
}

pub(super) fn drawn(snapshot: &Snapshot, screen: &Screen, width: u16, height: u16) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("memory");
    terminal.draw(|frame| draw(frame, snapshot, screen)).expect("memory");
    terminal.backend().buffer().clone()
}

pub(super) fn rows(buffer: &Buffer) -> Vec<String> {
    let width = usize::from(buffer.area.width);
    let symbols = |row: &[Cell]| row.iter().map(Cell::symbol).collect();
    buffer.content.chunks(width.max(1)).map(symbols).collect()
}

/// The rows of a screen of 80 by 24 after these keys.
pub(super) fn rows_after(keys: &str, snapshot: &Snapshot) -> Vec<String> {
    rows(&drawn(snapshot, &screen_after(Look::default(), keys, snapshot), 80, 24))
}

pub(super) fn text_after(keys: &str, snapshot: &Snapshot) -> String {
    rows_after(keys, snapshot).join("\n")
}
