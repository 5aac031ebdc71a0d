//! Where each bench is at each moment: a sheet for those who carry it, and tables.

use bench_dragon_geometry::number::Fixed;

use super::{HandOver, figures};
use crate::output::Counted;
use crate::output::in_plan::handles;
use crate::output::report::{Block, Fact, Layout, Report, Section, Table as Rows, Verdict, Weight};
use crate::output::table::{self, Cell, Column, Table};

/// Greatest number of rows of all benches together.
const MOST_ROWS: usize = 200_000;
/// Greatest number of sheets.
const MOST_SHEETS: usize = 3000;

/// A bench at a moment.
struct AtMoment {
    front_m: [f64; 2],
    rear_m: [f64; 2],
    heading_deg: f64,
    speed_mps: f64,
}

/// All moments of a bench, in their order, with the number of its dragon and its index.
fn benches(show: &HandOver<'_>) -> Result<Vec<(usize, usize, Vec<AtMoment>)>, String> {
    let rows = show.config.formation().layout().benches() * show.moments.len();
    if rows > MOST_ROWS {
        return Err(format!("it would have {rows} rows, at most {MOST_ROWS} are written"));
    }
    let mut benches = Vec::new();
    for (number, planned) in show.config.formation().dragons().iter().enumerate() {
        let first = benches.len();
        benches.extend((0..planned.dragon.dimensions().benches()).map(|bench| (number, bench, Vec::new())));
        for moment in &show.moments {
            // As in the tables of poses: one dragon has its speed also at the instant at which it ends.
            let head_mps = match show.config.named() {
                Some(_) => planned.speed_mps(moment.time_s),
                None => show.config.timetable().speed_mps(moment.time_s),
            };
            let handles = handles(&planned.dragon, planned.travel_m(moment.time_s));
            for (ends, (_, _, moments)) in handles.windows(2).zip(&mut benches[first..]) {
                let link = ends[0].position - ends[1].position;
                moments.push(AtMoment {
                    front_m: ends[0].position.to_array(),
                    rear_m: ends[1].position.to_array(),
                    heading_deg: link.y.atan2(link.x).to_degrees(),
                    speed_mps: ends[0].speed_ratio * head_mps,
                });
            }
        }
    }
    Ok(benches)
}

/// A printable page for each bench.
pub(super) fn html(show: &HandOver<'_>) -> Result<Vec<u8>, String> {
    let sheets = show.config.formation().layout().benches();
    if sheets > MOST_SHEETS {
        return Err(format!("it would have {sheets} sheets, at most {MOST_SHEETS} are written"));
    }
    let names = show.names();
    let has_names = names.len() > 1;
    let section = |(number, bench, moments): (usize, usize, Vec<AtMoment>)| {
        let name = if has_names { format!("{} bench {bench}", names[number]) } else { format!("Bench {bench}") };
        let rows = show.moments.iter().zip(moments).map(|(moment, at)| {
            let metres = |metres: f64| Fixed::<2>(metres).to_string();
            let [front, rear] = [at.front_m, at.rear_m].map(|place| place.map(metres));
            let [x, y] = front;
            let [to_x, to_y] = rear;
            let heading = Fixed::<0>(at.heading_deg).to_string();
            let (time, speed) = (Fixed::<1>(moment.time_s).to_string(), metres(at.speed_mps));
            vec![moment.name.clone(), time, x, y, to_x, to_y, heading, speed]
        });
        let table =
            Rows { columns: COLUMNS.to_vec(), numbers: COLUMNS[1..].to_vec(), rows: rows.collect(), ..Rows::default() };
        Section { heading: name, begins_page: true, blocks: vec![Block::Table(table)] }
    };
    let benches = benches(show)?;
    let facts = vec![
        Fact::new("Sheets", Counted(benches.len() as u64, "bench").to_string()).more("one page each"),
        Fact::new("Front, rear", "the two hinges of a bench").more("x to the right, y away, in metres"),
        Fact::new("Heading", "direction of the bench").more("degrees, counter-clockwise from +x"),
        Fact::new("Speed", "of the front hinge").more("metres per second, as planned"),
    ];
    let report = Report {
        kind: "Sheets of the benches".to_owned(),
        title: show.title.clone(),
        subtitle: String::new(),
        verdict: match show.attention() {
            None => Verdict { weight: Weight::Good, words: "No benches touch in this plan.".to_owned() },
            Some(words) => {
                let weight = if show.contact().is_some() { Weight::Danger } else { Weight::Attention };
                Verdict { weight, words: format!("In this plan: {words}.") }
            }
        },
        sections: std::iter::once(Section {
            heading: "How to read".to_owned(),
            begins_page: false,
            blocks: vec![Block::Facts(facts)],
        })
        .chain(benches.into_iter().map(section))
        .collect(),
        layout: Layout::Pages,
        cover: None,
    };
    Ok(report.html().into_bytes())
}

const COLUMNS: [&str; 8] = ["moment", "time s", "front x", "front y", "rear x", "rear y", "heading °", "speed m/s"];

/// The same as comma-separated values.
pub(super) fn csv(show: &HandOver<'_>) -> Result<Vec<u8>, String> {
    let numbers = ["front_x_m", "front_y_m", "rear_x_m", "rear_y_m", "heading_deg", "speed_mps"];
    let columns = [Column::text("dragon"), Column::whole("bench"), Column::text("moment"), Column::number("time_s", 6)];
    let mut table =
        Table::new("benches", columns.into_iter().chain(numbers.map(|title| Column::number(title, 6))).collect());
    let names = show.names();
    for (number, bench, moments) in benches(show)? {
        for (moment, at) in show.moments.iter().zip(moments) {
            let [[x, y], [to_x, to_y]] = [at.front_m, at.rear_m];
            let head =
                [Cell::from(names[number].as_ref()), bench.into(), moment.name.as_str().into(), moment.time_s.into()];
            let values = [x, y, to_x, to_y, at.heading_deg, at.speed_mps].map(Cell::from);
            table.push(head.into_iter().chain(values).collect());
        }
    }
    Ok(table::csv(&[table]))
}

/// The coordinates of all handles at each moment; `layer` is that of the DXF file.
pub(super) fn floor_csv(show: &HandOver<'_>) -> Vec<u8> {
    let names = show.names();
    let columns = vec![
        Column::text("layer"),
        Column::text("moment"),
        Column::number("time_s", 6),
        Column::text("dragon"),
        Column::whole("handle"),
        Column::number("x_m", 6),
        Column::number("y_m", 6),
    ];
    let mut table = Table::new("floor", columns);
    for (number, moment) in show.moments.iter().enumerate() {
        for (dragon, index, [x, y]) in figures::places(show, moment.time_s) {
            let layer = format!("HANDLES_{:02}", number + 1);
            let row =
                [Cell::from(layer), moment.name.as_str().into(), moment.time_s.into(), names[dragon].as_ref().into()];
            table.push(row.into_iter().chain([index.into(), x.into(), y.into()]).collect());
        }
    }
    table::csv(&[table])
}
