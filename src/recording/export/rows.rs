//! Rows of frames, alerts and commands: their columns, their values, and their form as comma-separated values.

use std::io::Write;

use bench_dragon_ipc::{Alert, BenchState, CommandEvent, HandleState};

use super::{ExportError, ExportSubject, Selection};
use crate::output::command_words::{CommandLine, wall_time};
use crate::output::table::{Cell, Column, CsvWriter};
use crate::recording::{Recorded, RecordedAlert, RecordedFrame};

pub(super) const DECIMALS: usize = 6;

/// Writes a line of titles, then the rows of the selection's subject. Calls `look` after each frame, alert or command event, to
/// report progress. If the selection has no frame, fails before it writes anything.
pub(crate) fn write_csv(
    selection: &mut Selection,
    sink: impl Write,
    mut look: impl FnMut(&Selection),
) -> Result<(), ExportError> {
    let subject = selection.settings.subject;
    let mut recorded = selection.next_recorded()?;
    selection.counts.rows = Some(0);
    let mut csv = CsvWriter::begin(sink, &columns(subject)).map_err(ExportError::Write)?;
    while let Some(frame) = recorded {
        for row in rows(subject, &frame) {
            *selection.counts.rows.get_or_insert(0) += 1;
            csv.write(&row).map_err(ExportError::Write)?;
        }
        look(selection);
        recorded = selection.next_recorded()?;
    }
    csv.finish().map_err(ExportError::Write)
}

pub(super) fn columns(subject: ExportSubject) -> Vec<Column> {
    let when = [Column::whole("run_id"), Column::whole("tick"), Column::number("time_s", 9), Column::text("wall_time")];
    let what = match subject {
        ExportSubject::Handles => {
            let numbers = numbers(&["x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "speed_mps"]);
            [vec![Column::whole("handle")], numbers].concat()
        }
        ExportSubject::Benches => {
            let place = ["x_m", "y_m", "z_m", "heading_rad"];
            let motion = ["vx_mps", "vy_mps", "vz_mps", "speed_mps", "turn_rate_radps"];
            [vec![Column::whole("bench")], numbers(&place), numbers(&motion)].concat()
        }
        ExportSubject::Frames => {
            let numbers = numbers(&["head_travel_m", "head_speed_mps", "time_scale"]);
            [vec![Column::text("state")], numbers, vec![Column::whole("benches")]].concat()
        }
        ExportSubject::Alerts => {
            let benches = vec![Column::text("kind"), Column::whole("bench_a"), Column::whole("bench_b")];
            [benches, numbers(&["clearance_m", "x_m", "y_m", "forecast_s"])].concat()
        }
        ExportSubject::Commands => {
            let sender = vec![Column::text("sender"), Column::whole("pid")];
            let command =
                vec![Column::text("command"), Column::number("value_1", DECIMALS), Column::number("value_2", DECIMALS)];
            let outcome = vec![Column::text("outcome"), Column::text("reason"), Column::text("text")];
            [sender, command, outcome, vec![Column::whole("number"), Column::whole("overruns")]].concat()
        }
    };
    when.into_iter().chain(what).collect()
}

fn numbers(titles: &[&str]) -> Vec<Column> {
    titles.iter().map(|title| Column::number(*title, DECIMALS)).collect()
}

/// Rows of a subject, in order.
pub(super) fn rows(subject: ExportSubject, recorded: &Recorded) -> Vec<Vec<Cell>> {
    match (subject, recorded) {
        (ExportSubject::Handles, Recorded::Frame(frame)) => {
            let when = When::of_frame(frame);
            let row_of = |(index, handle): (usize, &HandleState)| {
                let numbers = [handle.position_m, handle.velocity_mps];
                row(&when, index, numbers.as_flattened().iter().copied().chain([handle.speed_mps()]))
            };
            frame.handles.iter().enumerate().map(row_of).collect()
        }
        (ExportSubject::Benches, Recorded::Frame(frame)) => {
            let when = When::of_frame(frame);
            let row_of = |(index, bench): (usize, BenchState)| {
                let BenchState { centre_m, heading_rad, velocity_mps, turn_rate_radps, .. } = bench;
                let numbers = centre_m.into_iter().chain([heading_rad]).chain(velocity_mps);
                row(&when, index, numbers.chain([bench.speed_mps(), turn_rate_radps]))
            };
            frame.header.benches(&frame.handles).enumerate().map(row_of).collect()
        }
        (ExportSubject::Frames, Recorded::Frame(frame)) => vec![frame_row(frame)],
        (ExportSubject::Alerts, Recorded::Alert(alert)) => vec![alert_row(alert)],
        (ExportSubject::Commands, Recorded::Command(event)) => vec![command_row(event)],
        _ => Vec::new(),
    }
}

/// Show time in seconds: the f64 nearest to the recorded nanoseconds.
pub(super) fn seconds(time_ns: i64) -> f64 {
    time_ns as f64 / 1e9
}

fn row(when: &When, index: usize, numbers: impl Iterator<Item = f64>) -> Vec<Cell> {
    when.cells().into_iter().chain([index.into()]).chain(numbers.map(Cell::from)).collect()
}

fn frame_row(frame: &RecordedFrame) -> Vec<Cell> {
    let header = &frame.header;
    let state = header.show_state().map_or_else(|| format!("state {}", header.state), |state| state.to_string());
    let numbers = [header.head_travel_m, header.head_speed_mps, header.time_scale];
    let when = When::of_frame(frame).cells().into_iter();
    let benches = Cell::Whole(u64::from(header.bench_count));
    when.chain([state.into()]).chain(numbers.map(Cell::from)).chain([benches]).collect()
}

fn alert_row(&RecordedAlert { log_time_ns, ref alert }: &RecordedAlert) -> Vec<Cell> {
    let kind = alert.alert_kind().map_or_else(|| format!("kind {}", alert.kind), |kind| kind.to_string());
    let bench = |bench: u32| if bench == Alert::NO_BENCH { Cell::Blank } else { Cell::Whole(u64::from(bench)) };
    let of_pair = |number: f64| Cell::from(alert.pair().map(|_| number));
    let of_bench = |number: f64| Cell::from((alert.bench_a != Alert::NO_BENCH).then_some(number));
    let [x_m, y_m] = alert.point_m;
    let forecast_s = (alert.forecast_ns != Alert::NO_FORECAST).then(|| seconds(alert.forecast_ns));
    let benches = [bench(alert.bench_a), bench(alert.bench_b)];
    let what = [of_pair(alert.clearance_m), of_bench(x_m), of_bench(y_m)];
    let when = When::of(alert.run_id, alert.tick, alert.show_time_ns, wall_time(i128::from(log_time_ns)));
    let when = when.cells().into_iter();
    when.chain([kind.into()]).chain(benches).chain(what).chain([forecast_s.into()]).collect()
}

/// Row of a command event, with the values of its [`CommandLine`]. An event that is not a command has no outcome.
fn command_row(event: &CommandEvent) -> Vec<Cell> {
    let CommandLine { command, text, reason, sender, pid, wall_time, values, .. } = CommandLine::from(event);
    let value = |index: usize| Cell::from(values.get(index).copied().flatten());
    let outcome = match (event.request(), &reason) {
        (_, Some(_)) => "refused".into(),
        (Some(_), None) => "accepted".into(),
        (None, None) => Cell::Blank,
    };
    let sender = [sender.into(), pid.map_or(Cell::Blank, |pid| Cell::Whole(pid.into()))];
    let command = [command.into(), value(0), value(1), outcome, reason.map_or(Cell::Blank, Cell::from), text.into()];
    let when = When::of(event.run_id, event.tick, event.show_time_ns, wall_time).cells().into_iter();
    when.chain(sender).chain(command).chain([Cell::Whole(event.number), Cell::Whole(event.overruns)]).collect()
}

/// The first columns of every row.
struct When([Cell; 4]);

impl When {
    fn of(run_id: u64, tick: u64, show_time_ns: i64, wall_time: String) -> Self {
        Self([Cell::Whole(run_id), Cell::Whole(tick), Cell::Number(seconds(show_time_ns)), Cell::Text(wall_time)])
    }

    /// The wall time of a frame is that of its sending.
    fn of_frame(RecordedFrame { log_time_ns, header, .. }: &RecordedFrame) -> Self {
        Self::of(header.run_id, header.tick, header.show_time_ns, wall_time(i128::from(*log_time_ns)))
    }

    fn cells(&self) -> [Cell; 4] {
        self.0.clone()
    }
}
