//! The poses of a table that somebody else has computed.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, bail, ensure};

use super::sheet::{Row, Sheet, Value, read};
use crate::cli::solve::contest::{Quantity, handle};
use crate::output::poses::MAX_POSITIONS;
use crate::system::input_file::quoted;

/// The poses of a table, in the order of their times.
#[derive(Debug)]
pub(super) struct GivenPoses(pub(super) Vec<GivenPose>);

/// The handles of a table at a time.
#[derive(Clone, Debug)]
pub(super) struct GivenPose {
    /// The time; `None` for a table of one time that it does not have, such as `result2.xlsx`.
    pub(super) time_s: Option<f64>,
    /// The numbers of each handle, in the order of [`Quantity`].
    pub(super) handles: Vec<[Option<f64>; 3]>,
}

/// A pose that is found by its time.
type ByTime = BTreeMap<Option<i64>, GivenPose>;

impl GivenPoses {
    /// Reads a table of a dragon with this many handles.
    pub(super) fn read(path: &Path, handles: usize) -> anyhow::Result<Self> {
        let mut poses = ByTime::new();
        for sheet in read(path)? {
            add_sheet(&mut poses, &sheet, handles)?;
        }
        let poses: Vec<GivenPose> = poses.into_values().collect();
        let has_numbers = poses.iter().flat_map(|pose| pose.handles.iter().flatten()).any(Option::is_some);
        ensure!(
            has_numbers,
            "has no table: a row of times such as \"0 s\" above rows such as \"龙头x (m)\", a row with x, y and m/s above rows of \
             handles, or columns time_s, handle, x_m, y_m, speed_mps"
        );
        let has_end = poses.iter().any(|pose| pose.time_s.is_none());
        ensure!(!has_end || poses.len() == 1, "has a table with times and one without: put them into two files");
        Ok(Self(poses))
    }
}

/// The columns of a table.
enum Columns {
    /// A time each.
    Times(Vec<(usize, f64)>),
    /// A quantity each, at one time.
    Quantities(Vec<(usize, Quantity)>),
    /// A row for every handle at every time.
    Long { time: usize, handle: usize, quantities: Vec<(usize, Quantity)> },
}

fn add_sheet(poses: &mut ByTime, sheet: &Sheet, handles: usize) -> anyhow::Result<()> {
    let Some((head, columns)) = sheet.rows.iter().enumerate().find_map(|(at, row)| Some((at, columns(row, handles)?)))
    else {
        return Ok(());
    };
    let is_of_speeds = sheet.name.contains("速度") || sheet.name.to_lowercase().contains("speed");
    for row in &sheet.rows[head + 1..] {
        add_row(poses, row, &columns, is_of_speeds, handles).with_context(|| match sheet.name.as_str() {
            "" => format!("line {}", row.number),
            name => format!("sheet \"{name}\", row {}", row.number),
        })?;
    }
    Ok(())
}

/// The columns under a row of titles; `None` for another row.
fn columns(row: &Row, handles: usize) -> Option<Columns> {
    let texts = || row.cells.iter().filter_map(|(column, value)| Some((*column, value.text()?)));
    let named = |name: &str| texts().find(|(_, text)| text.eq_ignore_ascii_case(name)).map(|(column, _)| column);
    let quantities: Vec<_> = texts().filter_map(|(column, text)| Some((column, Quantity::at_end(text)?.0))).collect();
    if let (Some(time), Some(handle)) = (named("time_s"), named("handle")) {
        return Some(Columns::Long { time, handle, quantities });
    }
    if label(row).is_some_and(|label| of_label(label, handles).is_some()) {
        return None;
    }
    let times: Vec<_> = row.cells.iter().filter_map(|(column, value)| Some((*column, time_s(value)?))).collect();
    if !times.is_empty() {
        return Some(Columns::Times(times));
    }
    let has = |quantity| quantities.iter().any(|(_, other)| *other == quantity);
    (has(Quantity::X) && has(Quantity::Y)).then_some(Columns::Quantities(quantities))
}

/// A time such as `12 s`.
fn time_s(value: &Value) -> Option<f64> {
    let Some(text) = value.text() else { return value.number() };
    let text = text.trim();
    text.strip_suffix(['s', '秒']).unwrap_or(text).trim().parse().ok().filter(|time_s: &f64| time_s.abs() <= MOST_S)
}

/// Greatest time of a table, in seconds. Its nanoseconds are whole.
const MOST_S: f64 = 1e6;

fn label(row: &Row) -> Option<&str> {
    row.cells.iter().find_map(|(_, value)| value.text())
}

/// The handle of a label, and the quantity if the label has one.
fn of_label(label: &str, handles: usize) -> Option<(usize, Option<Quantity>)> {
    match Quantity::at_end(label) {
        Some((quantity, name)) => Some((handle(&name, handles)?, Some(quantity))),
        None => Some((handle(label, handles)?, None)),
    }
}

fn add_row(poses: &mut ByTime, row: &Row, columns: &Columns, is_of_speeds: bool, handles: usize) -> anyhow::Result<()> {
    let named = || -> anyhow::Result<(usize, Option<Quantity>)> {
        let Some(label) = label(row) else { bail!("has no name of a handle") };
        let last = handles.saturating_sub(3);
        of_label(label, handles).with_context(|| {
            format!("{} is no handle, must be 龙头, 第1节龙身 to 第{last}节龙身, 龙尾 or 龙尾（后）", quoted(label))
        })
    };
    match columns {
        Columns::Times(times) => {
            let (handle, quantity) = named()?;
            let quantity = quantity.or(is_of_speeds.then_some(Quantity::Speed));
            let quantity = quantity.context("its name has no x (m), y (m) or (m/s)")?;
            times
                .iter()
                .try_for_each(|&(column, time_s)| add(poses, row, column, (Some(time_s), handle, quantity), handles))
        }
        Columns::Quantities(quantities) => {
            let (handle, _) = named()?;
            quantities
                .iter()
                .try_for_each(|&(column, quantity)| add(poses, row, column, (None, handle, quantity), handles))
        }
        Columns::Long { time, handle: at, quantities } => {
            let time_s = row.at(*time).and_then(time_s).context("time_s is no time")?;
            let handle = row.at(*at).and_then(|value| match value {
                Value::Number(number) => {
                    Some(*number as usize).filter(|index| *index < handles && *index as f64 == *number)
                }
                Value::Text(text) => handle(text, handles),
            });
            let handle = handle.with_context(|| format!("handle must be from 0 to {}", handles - 1))?;
            quantities
                .iter()
                .try_for_each(|&(column, quantity)| add(poses, row, column, (Some(time_s), handle, quantity), handles))
        }
    }
}

/// Adds the number in a column of a row, unless the cell is empty.
fn add(
    poses: &mut ByTime,
    row: &Row,
    column: usize,
    (time_s, handle, quantity): (Option<f64>, usize, Quantity),
    handles: usize,
) -> anyhow::Result<()> {
    let Some(value) = row.at(column) else { return Ok(()) };
    let number = value.number().with_context(|| {
        format!("{} in column {} is no number", quoted(value.text().unwrap_or_default()), column + 1)
    })?;
    let key = time_s.map(|time_s| (time_s * 1e9).round() as i64);
    if !poses.contains_key(&key) {
        let most = MAX_POSITIONS / handles;
        ensure!(poses.len() < most, "has more than {most} times, the most that is allowed");
        poses.insert(key, GivenPose { time_s, handles: vec![[None; 3]; handles] });
    }
    let pose = poses.get_mut(&key).expect("it was added");
    let place = &mut pose.handles[handle][quantity as usize];
    ensure!(place.is_none(), "has a number twice: of one handle at one time");
    *place = Some(number);
    Ok(())
}
