//! A recording as a workbook: frames, their handles or benches in one column per frame, alerts, commands and configurations.

use bench_dragon_ipc::{BenchState, HandleState};

use super::rows::{DECIMALS, ExportedDragons, columns, rows, seconds};
use super::{ExportCounts, ExportError, ExportFindings, ExportSubject, Selection};
use crate::output::table::{Book, Cell, Column, MAX_COLUMNS, MAX_ROWS};
use crate::recording::{Configuration, Recorded, RecordedFrame};

/// Greatest number of handles or benches in all frames of a workbook: enough for a sheet of full width of the paper's dragon.
const MOST_SAMPLES: usize = 4_000_000;

/// A workbook of a recording, in memory.
///
/// The sheet *frames* has one row per frame. The sheets *positions*, *headings* (benches only) and *speeds* have one column per
/// row of *frames*, in the same order. The sheets *alerts* and *commands* have one row each. The sheet *configuration* has the
/// keys of each run.
#[derive(Debug, Default)]
pub(crate) struct Workbook {
    subject: ExportSubject,
    /// Rows of each sheet of [`LISTS`].
    lists: [Vec<Vec<Cell>>; LISTS.len()],
    titles: Vec<String>,
    /// For each frame, the samples of its handles or benches.
    samples: Vec<Vec<Sample>>,
    /// Whether a sample has a height.
    has_heights: bool,
    configurations: Vec<Configuration>,
    dragons: ExportedDragons,
    pub(crate) counts: ExportCounts,
    pub(crate) findings: ExportFindings,
}

/// Position and motion of a handle or a bench.
#[derive(Clone, Copy, Debug)]
struct Sample {
    x_m: f64,
    y_m: f64,
    z_m: f64,
    heading_rad: f64,
    speed_mps: f64,
}

impl Workbook {
    /// Reads the selection. Fails as soon as it exceeds the limits of a workbook. Calls `look` after each frame, alert or
    /// command event, to report progress.
    pub(crate) fn read(mut selection: Selection, mut look: impl FnMut(&Selection)) -> Result<Self, ExportError> {
        let mut workbook = Self { subject: selection.settings.subject, ..Self::default() };
        let mut sample_count = 0;
        while let Some(recorded) = selection.next_recorded()? {
            workbook.dragons.follow(selection.reader.configuration());
            for ((_, subject), list) in LISTS.into_iter().zip(&mut workbook.lists) {
                list.extend(rows(subject, &recorded, &workbook.dragons));
            }
            if let Recorded::Frame(frame) = recorded {
                sample_count += workbook.take_frame(&frame, selection.counts.runs);
            }
            workbook.take_configuration(selection.reader.configuration());
            workbook.require_room(sample_count)?;
            look(&selection);
        }
        workbook.counts = selection.counts;
        workbook.findings = selection.into_findings();
        Ok(workbook)
    }

    /// Returns the bytes of the workbook. Calls `look` after each row of a wide sheet, with the number of rows of all wide
    /// sheets.
    pub(crate) fn to_bytes(&self, mut look: impl FnMut(usize)) -> Result<Vec<u8>, ExportError> {
        let mut book = Book::new()?;
        let subject = self.subject;
        let add_list = |book: &mut Book, index: usize| {
            let (name, subject) = LISTS[index];
            book.add_sheet(name, &columns(subject, &self.dragons.first), self.lists[index].iter().cloned())
        };
        if subject.has_frames() {
            add_list(&mut book, 0)?;
        }
        let sheets = sheets(subject, self.has_heights);
        for sheet in sheets {
            let row_count = self.wide_rows().count() * sheets.iter().map(|sheet| sheet.lines.len()).sum::<usize>();
            let rows =
                self.wide_rows().flat_map(|index| sheet.lines.iter().map(move |line| self.wide_row(index, line)));
            book.add_sheet(sheet.name, &self.wide_columns(), rows.inspect(|_| look(row_count)))?;
        }
        (1..LISTS.len()).try_for_each(|index| add_list(&mut book, index))?;
        let keys = [Column::whole("run_id"), Column::text("key"), Column::text("value")];
        book.add_sheet("configuration", &keys, self.configurations.iter().flat_map(configuration_rows))?;
        Ok(book.finish()?)
    }

    /// Adds a frame of the run with this number. Returns the number of its samples.
    fn take_frame(&mut self, RecordedFrame { header, handles, .. }: &RecordedFrame, run: u64) -> usize {
        let samples: Vec<Sample> = match self.subject {
            ExportSubject::Handles => {
                let sample = |handle: &HandleState| {
                    let [x_m, y_m, z_m] = handle.position_m;
                    Sample { x_m, y_m, z_m, heading_rad: 0.0, speed_mps: handle.speed_mps() }
                };
                handles.iter().map(sample).collect()
            }
            ExportSubject::Benches => header.benches(handles).map(|bench| Sample::of(&bench)).collect(),
            ExportSubject::Frames | ExportSubject::Alerts | ExportSubject::Commands => return 0,
        };
        let time_s = seconds(header.show_time_ns);
        self.titles.push(if run == 1 { format!("{time_s} s") } else { format!("run {run}, {time_s} s") });
        let count = samples.len();
        self.has_heights |= samples.iter().any(|sample| sample.z_m != 0.0);
        self.samples.push(samples);
        count
    }

    fn take_configuration(&mut self, configuration: Option<&Configuration>) {
        if let Some(configuration) = configuration.filter(|known| self.configurations.last() != Some(known)) {
            self.configurations.push(configuration.clone());
        }
    }

    /// Fails if the selection so far exceeds the limits of a workbook.
    fn require_room(&self, sample_count: usize) -> Result<(), ExportError> {
        let plural = self.subject.name();
        // One row is for the titles, one column for the labels of the rows.
        let (rows, columns) = (MAX_ROWS - 1, MAX_COLUMNS - 1);
        let lines = sheets(self.subject, self.has_heights).iter().map(|sheet| sheet.lines.len()).max().unwrap_or(0);
        let tallest = self.samples.last().map_or(0, Vec::len) * lines;
        let lists =
            LISTS.iter().zip(&self.lists).map(|((_, subject), list)| (list.len(), rows, subject.name().to_owned()));
        for (count, most, what) in lists.chain([
            (self.samples.len(), columns, format!("frames with one column of {plural} each")),
            (tallest, rows, format!("rows of {plural}")),
            (sample_count, MOST_SAMPLES, format!("{plural} in all frames")),
        ]) {
            if count > most {
                return Err(ExportError::TooMuch { what: format!("there are at least {count} {what}"), most });
            }
        }
        Ok(())
    }

    fn wide_columns(&self) -> Vec<Column> {
        let frames = self.titles.iter().map(|title| Column::number(title, DECIMALS));
        std::iter::once(Column::text(self.subject.name())).chain(frames).collect()
    }

    fn wide_rows(&self) -> std::ops::Range<usize> {
        0..self.samples.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// A handle or a bench as people call it: `gold 3`, or its number.
    fn label(&self, index: usize) -> String {
        let handles = self.subject == ExportSubject::Handles;
        // Each dragon has one handle more than benches.
        let named = self.dragons.first.dragons().enumerate().find_map(|(number, (name, benches))| {
            let first = benches.start + if handles { number } else { 0 };
            let count = benches.len() + usize::from(handles);
            (first..first + count).contains(&index).then(|| format!("{name} {}", index - first))
        });
        named.unwrap_or_else(|| index.to_string())
    }

    fn wide_row(&self, index: usize, (title, value): &WideLine) -> Vec<Cell> {
        let values = self.samples.iter().map(|samples| Cell::from(samples.get(index).map(value)));
        std::iter::once(Cell::from(format!("{} {title}", self.label(index)))).chain(values).collect()
    }
}

impl Sample {
    fn of(bench: &BenchState) -> Self {
        let [x_m, y_m, z_m] = bench.centre_m;
        Self { x_m, y_m, z_m, heading_rad: bench.heading_rad, speed_mps: bench.speed_mps() }
    }
}

/// Sheets with one row for each frame, alert or command event.
const LISTS: [(&str, ExportSubject); 3] =
    [("frames", ExportSubject::Frames), ("alerts", ExportSubject::Alerts), ("commands", ExportSubject::Commands)];

/// A sheet with one column per frame.
struct WideSheet {
    name: &'static str,
    /// Rows for each handle or bench.
    lines: &'static [WideLine],
}

/// A row for a handle or a bench: its title, and the function that returns its value.
type WideLine = (&'static str, fn(&Sample) -> f64);

const POSITIONS: WideSheet =
    WideSheet { name: "positions", lines: &[("x (m)", |sample| sample.x_m), ("y (m)", |sample| sample.y_m)] };
/// The same with heights, for ground that is not flat.
const POSITIONS_IN_SPACE: WideSheet = WideSheet {
    name: "positions",
    lines: &[("x (m)", |sample| sample.x_m), ("y (m)", |sample| sample.y_m), ("z (m)", |sample| sample.z_m)],
};
const HEADINGS: WideSheet = WideSheet { name: "headings", lines: &[("(rad)", |sample| sample.heading_rad)] };
const SPEEDS: WideSheet = WideSheet { name: "speeds", lines: &[("(m/s)", |sample| sample.speed_mps)] };

fn sheets(subject: ExportSubject, has_heights: bool) -> &'static [WideSheet] {
    match (subject, has_heights) {
        (ExportSubject::Handles, false) => &[POSITIONS, SPEEDS],
        (ExportSubject::Handles, true) => &[POSITIONS_IN_SPACE, SPEEDS],
        (ExportSubject::Benches, false) => &[POSITIONS, HEADINGS, SPEEDS],
        (ExportSubject::Benches, true) => &[POSITIONS_IN_SPACE, HEADINGS, SPEEDS],
        (ExportSubject::Frames | ExportSubject::Alerts | ExportSubject::Commands, _) => &[],
    }
}

/// Rows of the keys of a configuration, or one row with its text if it is not valid TOML.
fn configuration_rows(Configuration { run_id, toml }: &Configuration) -> Vec<Vec<Cell>> {
    let row = |key: String, value: String| vec![Cell::Whole(*run_id), Cell::from(key), Cell::from(value)];
    let Ok(document) = toml.parse::<toml::Table>() else { return vec![row(String::new(), toml.clone())] };
    let of_table = |(name, value): (String, toml::Value)| match value {
        toml::Value::Table(table) => {
            table.into_iter().map(|(key, value)| row(format!("{name}.{key}"), value.to_string())).collect()
        }
        value => vec![row(name, value.to_string())],
    };
    let of_dragon = |dragon: toml::Value| {
        let name = dragon.get("name").and_then(toml::Value::as_str).unwrap_or_default().to_owned();
        let toml::Value::Table(keys) = dragon else { return Vec::new() };
        keys.into_iter().flat_map(|(key, value)| of_table((format!("dragons.{name}.{key}"), value))).collect()
    };
    let of_entry = |entry: (String, toml::Value)| match entry {
        (key, toml::Value::Array(dragons)) if key == "dragons" => dragons.into_iter().flat_map(of_dragon).collect(),
        entry => of_table(entry),
    };
    document.into_iter().flat_map(of_entry).collect()
}
