//! Rows of frames, alerts and commands: their columns, their values, and their form as comma-separated values.

use std::io::Write;

use bench_dragon_ipc::{Alert, BenchState, CommandEvent, DragonMotion, HandleState};

use super::{ExportError, ExportSubject, Selection};
use crate::config::NamedLayout;
use crate::output::command_words::{CommandLine, wall_time};
use crate::output::table::{Cell, Column, CsvWriter};
use crate::recording::{Configuration, Recorded, RecordedAlert, RecordedFrame};

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
    let mut dragons = ExportedDragons::default();
    dragons.follow(selection.reader.configuration());
    let mut csv = CsvWriter::begin(sink, &columns(subject, &dragons.first)).map_err(ExportError::Write)?;
    while let Some(frame) = recorded {
        dragons.follow(selection.reader.configuration());
        for row in rows(subject, &frame, &dragons) {
            *selection.counts.rows.get_or_insert(0) += 1;
            csv.write(&row).map_err(ExportError::Write)?;
        }
        look(selection);
        recorded = selection.next_recorded()?;
    }
    csv.finish().map_err(ExportError::Write)
}

/// The names of the dragons. The columns are those of the first run with exported rows.
#[derive(Clone, Debug, Default)]
pub(super) struct ExportedDragons {
    pub(super) first: NamedLayout,
    present: NamedLayout,
    run_id: Option<u64>,
}

impl ExportedDragons {
    /// Takes the names of the configuration of the rows that follow.
    pub(super) fn follow(&mut self, configuration: Option<&Configuration>) {
        let Some(Configuration { run_id, toml }) = configuration.filter(|known| self.run_id != Some(known.run_id))
        else {
            return;
        };
        self.present = NamedLayout::of_toml(toml);
        if self.run_id.replace(*run_id).is_none() {
            self.first = self.present.clone();
        }
    }

    /// The dragon and the index within it, for the columns of a bench that is numbered on; of a show of one dragon, its number.
    fn cells(&self, bench: usize) -> Vec<Cell> {
        let (name, index) = match self.present.place(bench) {
            Some((name, index)) if self.first.are_named() => (name.into(), index),
            _ => (Cell::Blank, bench),
        };
        self.with_dragon(name, index.into())
    }

    /// A name, if there is a column for it, and an index.
    fn with_dragon(&self, name: Cell, index: Cell) -> Vec<Cell> {
        if self.first.are_named() { vec![name, index] } else { vec![index] }
    }

    /// The dragons of a frame, each with its cell and its handles. Without a column of names, all are one dragon.
    fn of_frame<'a>(&self, frame: &'a RecordedFrame) -> Vec<(Cell, &'a [HandleState])> {
        if !self.first.are_named() {
            return vec![(Cell::Blank, &frame.handles)];
        }
        let named = frame.header.dragons().iter().enumerate().map(|(number, motion)| {
            let name = self.present.name(number).map_or(Cell::Blank, Cell::from);
            (name, &frame.handles[motion.handles()])
        });
        named.collect()
    }
}

/// Columns of a subject, for a first run of dragons with these names.
pub(super) fn columns(subject: ExportSubject, dragons: &NamedLayout) -> Vec<Column> {
    let of_dragon = |title: &'static str, index: &'static str| {
        let name = dragons.are_named().then(|| Column::text(title));
        name.into_iter().chain([Column::whole(index)]).collect::<Vec<_>>()
    };
    let when = [Column::whole("run_id"), Column::whole("tick"), Column::number("time_s", 9), Column::text("wall_time")];
    let what = match subject {
        ExportSubject::Handles => {
            let numbers = numbers(&["x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "speed_mps"]);
            [of_dragon("dragon", "handle"), numbers].concat()
        }
        ExportSubject::Benches => {
            let place = ["x_m", "y_m", "z_m", "heading_rad"];
            let motion = ["vx_mps", "vy_mps", "vz_mps", "speed_mps", "turn_rate_radps"];
            [of_dragon("dragon", "bench"), numbers(&place), numbers(&motion)].concat()
        }
        ExportSubject::Frames => {
            let numbers = numbers(&["head_travel_m", "head_speed_mps", "time_scale"]);
            let motions = dragons.dragons().flat_map(|(name, _)| {
                let numbers =
                    ["travel_m", "speed_mps"].map(|title| Column::number(format!("{name}_{title}"), DECIMALS));
                numbers.into_iter().chain([Column::text(format!("{name}_state"))])
            });
            [vec![Column::text("state")], numbers, vec![Column::whole("benches")], motions.collect()].concat()
        }
        ExportSubject::Alerts => {
            let benches = [of_dragon("dragon_a", "bench_a"), of_dragon("dragon_b", "bench_b")].concat();
            [vec![Column::text("kind")], benches, numbers(&["clearance_m", "x_m", "y_m", "forecast_s"])].concat()
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
pub(super) fn rows(subject: ExportSubject, recorded: &Recorded, dragons: &ExportedDragons) -> Vec<Vec<Cell>> {
    match (subject, recorded) {
        (ExportSubject::Handles, Recorded::Frame(frame)) => {
            let when = When::of_frame(frame);
            let rows = dragons.of_frame(frame).into_iter().flat_map(|(name, handles)| {
                handles.iter().enumerate().map(move |(index, handle)| (name.clone(), index, handle))
            });
            let row_of = |(name, index, handle): (Cell, usize, &HandleState)| {
                let numbers = [handle.position_m, handle.velocity_mps];
                let place = dragons.with_dragon(name, index.into());
                row(&when, place, numbers.as_flattened().iter().copied().chain([handle.speed_mps()]))
            };
            rows.map(row_of).collect()
        }
        (ExportSubject::Benches, Recorded::Frame(frame)) => {
            let when = When::of_frame(frame);
            let row_of = |(index, bench): (usize, BenchState)| {
                let BenchState { centre_m, heading_rad, velocity_mps, turn_rate_radps, .. } = bench;
                let numbers = centre_m.into_iter().chain([heading_rad]).chain(velocity_mps);
                row(&when, dragons.cells(index), numbers.chain([bench.speed_mps(), turn_rate_radps]))
            };
            frame.header.benches(&frame.handles).enumerate().map(row_of).collect()
        }
        (ExportSubject::Frames, Recorded::Frame(frame)) => vec![frame_row(frame, dragons)],
        (ExportSubject::Alerts, Recorded::Alert(alert)) => vec![alert_row(alert, dragons)],
        (ExportSubject::Commands, Recorded::Command(event)) => vec![command_row(event)],
        _ => Vec::new(),
    }
}

/// Show time in seconds: the f64 nearest to the recorded nanoseconds.
pub(super) fn seconds(time_ns: i64) -> f64 {
    time_ns as f64 / 1e9
}

fn row(when: &When, place: Vec<Cell>, numbers: impl Iterator<Item = f64>) -> Vec<Cell> {
    when.cells().into_iter().chain(place).chain(numbers.map(Cell::from)).collect()
}

fn frame_row(frame: &RecordedFrame, dragons: &ExportedDragons) -> Vec<Cell> {
    let header = &frame.header;
    let state = header.show_state().map_or_else(|| format!("state {}", header.state), |state| state.to_string());
    let numbers = [header.head_travel_m, header.head_speed_mps, header.time_scale];
    let when = When::of_frame(frame).cells().into_iter();
    let benches = Cell::Whole(u64::from(header.bench_count));
    let motions = dragons.first.dragons().flat_map(|(name, _)| {
        let number = dragons.present.dragons().position(|(present, _)| present == name);
        number.and_then(|number| header.dragons().get(number)).map_or([const { Cell::Blank }; 3], motion_cells)
    });
    when.chain([state.into()]).chain(numbers.map(Cell::from)).chain([benches]).chain(motions).collect()
}

fn motion_cells(motion: &DragonMotion) -> [Cell; 3] {
    let state = motion.dragon_state().map_or_else(|| format!("state {}", motion.state), |state| state.to_string());
    [motion.travel_m.into(), motion.speed_mps.into(), state.into()]
}

fn alert_row(&RecordedAlert { log_time_ns, ref alert }: &RecordedAlert, dragons: &ExportedDragons) -> Vec<Cell> {
    let kind = alert.alert_kind().map_or_else(|| format!("kind {}", alert.kind), |kind| kind.to_string());
    let bench = |bench: u32| match bench {
        Alert::NO_BENCH => dragons.with_dragon(Cell::Blank, Cell::Blank),
        bench => dragons.cells(bench as usize),
    };
    let of_pair = |number: f64| Cell::from(alert.pair().map(|_| number));
    let of_bench = |number: f64| Cell::from((alert.bench_a != Alert::NO_BENCH).then_some(number));
    let [x_m, y_m] = alert.point_m;
    let forecast_s = (alert.forecast_ns != Alert::NO_FORECAST).then(|| seconds(alert.forecast_ns));
    let benches = [bench(alert.bench_a), bench(alert.bench_b)].concat();
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
