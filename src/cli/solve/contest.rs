//! The tables of the contest for which the paper was written, CUMCM 2024, problem A: the labels of their rows and columns.
//!
//! `result1.xlsx` and `result4.xlsx` have a sheet of positions and one of speeds, with a column for every second. `result2.xlsx`
//! has a row for every handle at one time.

use crate::output::poses::{Handle, Poses};
use crate::output::table::{Cell, Column, Table};

/// What a number of a table is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    X,
    Y,
    Speed,
}

impl Quantity {
    pub(super) const ALL: [Self; 3] = [Self::X, Self::Y, Self::Speed];

    /// The quantity that a label ends with, and the rest of the label.
    pub(super) fn at_end(label: &str) -> Option<(Self, String)> {
        let label = plain(label);
        for (end, quantity) in [("(m/s)", Self::Speed), ("speed_mps", Self::Speed), ("x_m", Self::X), ("y_m", Self::Y)]
        {
            if let Some(rest) = label.strip_suffix(end) {
                return Some((quantity, rest.to_owned()));
            }
        }
        let label = label.strip_suffix("(m)").unwrap_or(&label);
        let x = label.strip_suffix('x').map(|rest| (Self::X, rest.to_owned()));
        x.or_else(|| label.strip_suffix('y').map(|rest| (Self::Y, rest.to_owned())))
    }
}

/// A label in lower case and without blanks and the wide brackets of Chinese text.
fn plain(label: &str) -> String {
    let letters = label.chars().filter(|letter| !letter.is_whitespace());
    let narrow = |letter: char| match letter {
        '（' => '(',
        '）' => ')',
        letter => letter.to_ascii_lowercase(),
    };
    letters.map(narrow).collect()
}

/// The handle of a name, of this many handles: as the contest names it, as our workbooks do, or by its number.
pub(super) fn handle(name: &str, handles: usize) -> Option<usize> {
    let name = plain(name);
    let index = match name.as_str() {
        "龙头" | "head" => 0,
        "龙尾" | "tail" => handles.checked_sub(2)?,
        "龙尾(后)" | "tailrear" => handles - 1,
        name => {
            let body = name.strip_prefix('第').and_then(|name| name.strip_suffix("节龙身"));
            let index = body.or_else(|| name.strip_prefix("bench")).unwrap_or(name).parse().ok()?;
            // The contest counts the benches between head and tail.
            if body.is_some() && !(1..handles.saturating_sub(2)).contains(&index) {
                return None;
            }
            index
        }
    };
    (index < handles).then_some(index)
}

/// The contest's name of a handle, of this many handles.
pub(super) fn name(index: usize, handles: usize) -> String {
    match handles - index {
        _ if index == 0 => "龙头".to_owned(),
        1 => "龙尾（后）".to_owned(),
        2 => "龙尾".to_owned(),
        _ => format!("第{index}节龙身"),
    }
}

/// The sheets of `result1.xlsx` and `result4.xlsx`.
pub(super) fn sheets_by_time(answer: &Poses) -> [Table; 2] {
    let times = || answer.poses.iter().map(|pose| numbers(format!("{} s", pose.time_s)));
    let columns = || std::iter::once(Column::text("")).chain(times()).collect();
    let (mut positions, mut speeds) = (Table::new("位置", columns()), Table::new("速度", columns()));
    let handles = answer.poses.first().map_or(0, |pose| pose.handles.len());
    let row = |label: String, index: usize, value: fn(&Handle) -> f64| {
        let values = answer.poses.iter().map(|pose| Cell::from(value(&pose.handles[index])));
        std::iter::once(Cell::from(label)).chain(values).collect()
    };
    for index in 0..handles {
        let name = name(index, handles);
        positions.push(row(format!("{name}x (m)"), index, |handle| handle.x_m));
        positions.push(row(format!("{name}y (m)"), index, |handle| handle.y_m));
        speeds.push(row(format!("{name} (m/s)"), index, |handle| handle.speed_mps));
    }
    [positions, speeds]
}

/// The sheet of `result2.xlsx`.
pub(super) fn sheet_at_end(handles: &[Handle]) -> Table {
    let titles = ["横坐标x (m)", "纵坐标y (m)", "速度 (m/s)"].map(numbers);
    let mut table = Table::new("Sheet1", std::iter::once(Column::text("")).chain(titles).collect());
    for (index, handle) in handles.iter().enumerate() {
        let values = [handle.x_m, handle.y_m, handle.speed_mps].map(Cell::from);
        table.push(std::iter::once(Cell::from(name(index, handles.len()))).chain(values).collect());
    }
    table
}

/// Decimals that the contest asks for.
pub(super) const DECIMALS: usize = 6;

fn numbers(title: impl Into<String>) -> Column {
    Column::number(title, DECIMALS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_of_a_handle_is_read_back() {
        for handles in [2, 3, 4, 224] {
            for index in 0..handles {
                assert_eq!(handle(&name(index, handles), handles), Some(index), "{}", name(index, handles));
            }
        }
        assert_eq!(
            ["bench 7", "head", "tail rear", "9"].map(|name| handle(name, 224)),
            [Some(7), Some(0), Some(223), Some(9)]
        );
        assert_eq!(["第222节龙身", "第0节龙身", "224", "龙身"].map(|name| handle(name, 224)), [None; 4]);
    }

    #[test]
    fn labels_are_read_with_any_blanks_and_brackets() {
        for (label, quantity, name) in [
            ("第1节龙身  (m/s)", Quantity::Speed, "第1节龙身"),
            ("龙尾（后）x (m)", Quantity::X, "龙尾(后)"),
            ("龙头 y（m）", Quantity::Y, "龙头"),
            ("横坐标x (m)", Quantity::X, "横坐标"),
            ("bench 12 y (m)", Quantity::Y, "bench12"),
            ("speed_mps", Quantity::Speed, ""),
        ] {
            assert_eq!(Quantity::at_end(label), Some((quantity, name.to_owned())), "{label}");
        }
        assert_eq!(Quantity::at_end("龙头"), None);
    }
}
