//! A recording as a workbook: frames, what is in them with a column for each, alerts, commands and configurations.

use bench_dragon_ipc::{BenchState, HandleState};

use super::rows::{DECIMALS, columns, rows, seconds};
use super::{ExportCounts, ExportError, ExportSubject, Selection};
use crate::output::table::{Book, Cell, Column, MAX_COLUMNS, MAX_ROWS};
use crate::recording::{Configuration, Flaws, Recorded, RecordedFrame};

/// Handles, or benches, of all frames together that a workbook may have: the whole width of a sheet of the paper's dragon.
const MOST_SAMPLES: usize = 4_000_000;

/// A workbook of a recording, in memory.
///
/// Its sheets are *frames* (a row each); of handles *positions* and *speeds*, of benches *positions*, *headings* and
/// *speeds*, with a column for each row of *frames*, in the same order; *alerts*; *commands*; and *configuration*, the keys of each
/// run.
#[derive(Debug, Default)]
pub(crate) struct Workbook {
    subject: ExportSubject,
    /// The rows of each of the [`LISTS`].
    lists: [Vec<Vec<Cell>>; LISTS.len()],
    titles: Vec<String>,
    /// Of each frame, a number of each handle or bench for each of the sheets' rows.
    samples: Vec<Vec<Sample>>,
    configurations: Vec<Configuration>,
    pub(crate) counts: ExportCounts,
    pub(crate) flaws: Flaws,
}

/// Where a handle or a bench is and how it moves.
#[derive(Clone, Copy, Debug)]
struct Sample {
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    speed_mps: f64,
}

impl Workbook {
    /// Reads what is exported; fails as soon as there is more than a workbook can have. `look` is shown how far it has come,
    /// after each frame.
    pub(crate) fn read(mut selection: Selection, mut look: impl FnMut(&Selection)) -> Result<Self, ExportError> {
        let mut workbook = Self { subject: selection.settings.subject, ..Self::default() };
        let mut sample_count = 0;
        while let Some(recorded) = selection.next_recorded()? {
            for ((_, subject), list) in LISTS.into_iter().zip(&mut workbook.lists) {
                list.extend(rows(subject, &recorded));
            }
            if let Recorded::Frame(frame) = recorded {
                sample_count += workbook.take_frame(&frame, selection.counts.runs);
            }
            workbook.take_configuration(selection.reader.configuration());
            workbook.require_room(sample_count)?;
            look(&selection);
        }
        (workbook.counts, workbook.flaws) = (selection.counts, selection.reader.flaws());
        Ok(workbook)
    }

    /// The bytes of the workbook. `look` is told after each row, of so many in all.
    pub(crate) fn to_bytes(&self, mut look: impl FnMut(usize)) -> Result<Vec<u8>, ExportError> {
        let mut book = Book::new()?;
        let subject = self.subject;
        let add_list = |book: &mut Book, index: usize| {
            let (name, subject) = LISTS[index];
            book.add_sheet(name, &columns(subject), self.lists[index].iter().cloned())
        };
        if subject.has_frames() {
            add_list(&mut book, 0)?;
        }
        for sheet in sheets(subject) {
            let row_count =
                self.wide_rows().count() * sheets(subject).iter().map(|sheet| sheet.lines.len()).sum::<usize>();
            let rows =
                self.wide_rows().flat_map(|index| sheet.lines.iter().map(move |line| self.wide_row(index, line)));
            book.add_sheet(sheet.name, &self.wide_columns(), rows.inspect(|_| look(row_count)))?;
        }
        (1..LISTS.len()).try_for_each(|index| add_list(&mut book, index))?;
        let keys = [Column::whole("run_id"), Column::text("key"), Column::text("value")];
        book.add_sheet("configuration", &keys, self.configurations.iter().flat_map(configuration_rows))?;
        Ok(book.finish()?)
    }

    /// Takes a frame of the run with this number. Returns how many handles or benches there were to keep.
    fn take_frame(&mut self, RecordedFrame { header, handles, .. }: &RecordedFrame, run: u64) -> usize {
        let samples: Vec<Sample> = match self.subject {
            ExportSubject::Handles => {
                let sample = |handle: &HandleState| {
                    let [x_m, y_m, _] = handle.position_m;
                    Sample { x_m, y_m, heading_rad: 0.0, speed_mps: handle.speed_mps() }
                };
                handles.iter().map(sample).collect()
            }
            ExportSubject::Benches => BenchState::all(handles).map(|bench| Sample::of(&bench)).collect(),
            ExportSubject::Frames | ExportSubject::Alerts | ExportSubject::Commands => return 0,
        };
        let time_s = seconds(header.sim_time_ns);
        self.titles.push(if run == 1 { format!("{time_s} s") } else { format!("run {run}, {time_s} s") });
        let count = samples.len();
        self.samples.push(samples);
        count
    }

    fn take_configuration(&mut self, configuration: Option<&Configuration>) {
        if let Some(configuration) = configuration.filter(|known| self.configurations.last() != Some(known)) {
            self.configurations.push(configuration.clone());
        }
    }

    /// Fails as soon as there is no room for what has been read.
    fn require_room(&self, sample_count: usize) -> Result<(), ExportError> {
        let plural = self.subject.name();
        // One row has the titles, one column tells what the row is.
        let (rows, columns) = (MAX_ROWS - 1, MAX_COLUMNS - 1);
        let tallest = self.samples.last().map_or(0, Vec::len) * MOST_LINES;
        let lists =
            LISTS.iter().zip(&self.lists).map(|((_, subject), list)| (list.len(), rows, subject.name().to_owned()));
        for (count, most, what) in lists.chain([
            (self.samples.len(), columns, format!("frames with a column of {plural} each")),
            (tallest, rows, format!("rows of {plural}")),
            (sample_count, MOST_SAMPLES, format!("{plural} of all frames")),
        ]) {
            if count > most {
                return Err(ExportError::TooMuch { what: format!("there are {count} {what} or more"), most });
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

    fn wide_row(&self, index: usize, (title, value): &WideLine) -> Vec<Cell> {
        let values = self.samples.iter().map(|samples| Cell::from(samples.get(index).map(value)));
        std::iter::once(Cell::from(format!("{index} {title}"))).chain(values).collect()
    }
}

impl Sample {
    fn of(bench: &BenchState) -> Self {
        let [x_m, y_m, _] = bench.centre_m;
        Self { x_m, y_m, heading_rad: bench.heading_rad, speed_mps: bench.speed_mps() }
    }
}

/// The sheets with a row for each frame, alert and event of a command.
const LISTS: [(&str, ExportSubject); 3] =
    [("frames", ExportSubject::Frames), ("alerts", ExportSubject::Alerts), ("commands", ExportSubject::Commands)];

/// A sheet with a column for each frame.
struct WideSheet {
    name: &'static str,
    /// The rows of each handle or bench.
    lines: &'static [WideLine],
}

/// What a row tells of a handle or a bench.
type WideLine = (&'static str, fn(&Sample) -> f64);

/// Rows that a sheet has of each handle or bench, at most.
const MOST_LINES: usize = 2;

const POSITIONS: WideSheet =
    WideSheet { name: "positions", lines: &[("x (m)", |sample| sample.x_m), ("y (m)", |sample| sample.y_m)] };
const HEADINGS: WideSheet = WideSheet { name: "headings", lines: &[("(rad)", |sample| sample.heading_rad)] };
const SPEEDS: WideSheet = WideSheet { name: "speeds", lines: &[("(m/s)", |sample| sample.speed_mps)] };

fn sheets(subject: ExportSubject) -> &'static [WideSheet] {
    match subject {
        ExportSubject::Handles => &[POSITIONS, SPEEDS],
        ExportSubject::Benches => &[POSITIONS, HEADINGS, SPEEDS],
        ExportSubject::Frames | ExportSubject::Alerts | ExportSubject::Commands => &[],
    }
}

/// The keys of a configuration, or its text where this version does not know the form.
fn configuration_rows(Configuration { run_id, toml }: &Configuration) -> Vec<Vec<Cell>> {
    let row = |key: String, value: String| vec![Cell::Whole(*run_id), Cell::from(key), Cell::from(value)];
    let Ok(document) = toml.parse::<toml::Table>() else { return vec![row(String::new(), toml.clone())] };
    let of_table = |(name, value): (String, toml::Value)| match value {
        toml::Value::Table(table) => {
            table.into_iter().map(|(key, value)| row(format!("{name}.{key}"), value.to_string())).collect()
        }
        value => vec![row(name, value.to_string())],
    };
    document.into_iter().flat_map(of_table).collect()
}
