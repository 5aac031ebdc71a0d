//! The tables of the reference.

use std::fmt::Display;

use bench_dragon_ipc::{AlertKind, DragonState, ShowState, SourceKind, Stop, TimecodeKind, TimecodeState};
use test_support::foreign_form::require_passage;

use crate::layouts::{self, Field};
use crate::{repository, text};

const STOCK_PAGE: &str = "docs/reference/stock-iceoryx2.md";
/// A type without a table of its own: the status has its fields.
const HISTOGRAM: &str = "TimeHistogram";

#[test]
fn the_page_for_stock_clients_has_every_layout() {
    let page = text(STOCK_PAGE);
    for layout in layouts::all().into_iter().filter(|layout| layout.name != HISTOGRAM) {
        let heading = layout.type_name.split('.').nth(1).expect("a name with a version");
        let opening = format!("\n### {heading}\n\n{} bytes, `{}`", layout.size, layout.type_name);
        let (_, section) = page.split_once(&opening).unwrap_or_else(|| panic!("the page lacks {opening:?}"));
        let section = section.split("\n#").next().expect("a section has a beginning");
        let rows = section.lines().filter(|line| line.starts_with('|')).skip(2);
        let on_page: Vec<String> = rows.map(|row| row.splitn(5, " | ").take(3).collect::<Vec<_>>().join(" ")).collect();
        let row = |Field { offset, kind, name }: &Field| format!("| {offset} {kind} `{name}`");
        let on_bus: Vec<String> = layout.fields.iter().map(row).collect();
        assert_eq!(on_page, on_bus, "{heading}");
    }
}

#[test]
fn the_page_for_stock_clients_has_the_numbers_of_the_enums() {
    for (row, numbers) in [
        ("| 68 | u32 | `state` | ", numbers(&ShowState::ALL)),
        ("| 24 | u32 | `state` | ", numbers(&DragonState::ALL)),
        ("| 148 | u32 | `source` | ", numbers(&SourceKind::ALL)),
        ("| 156 | u32 | `timecode` | ", numbers(&TimecodeState::ALL)),
        ("| 160 | u32 | `timecode_kind` | ", numbers(&TimecodeKind::ALL)),
        ("| 164 | u32 | `stops` | bits: ", bits(&Stop::ALL)),
        ("| 56 | u32 | `kind` | ", numbers(&AlertKind::ALL)),
    ] {
        require_passage(&repository(STOCK_PAGE), row, &numbers, " |\n");
    }
}

/// The variants with their numbers, which begin with 0: `0 near, 1 contact`.
fn numbers(variants: &[impl Display]) -> String {
    listed((0..).zip(variants))
}

/// The variants with their bits: `1 paused, 2 held`.
fn bits(variants: &[impl Display]) -> String {
    listed((0..).map(|number| 1 << number).zip(variants))
}

fn listed(numbered: impl Iterator<Item = (u32, impl Display)>) -> String {
    numbered.map(|(number, variant)| format!("{number} {variant}")).collect::<Vec<_>>().join(", ")
}

#[test]
fn the_reference_names_every_kind_of_alert() {
    let names = AlertKind::ALL.map(AlertKind::name);
    let (last, others) = names.split_last().expect("there are kinds");
    let words = format!("`{}` or `{last}`", others.join("`, `"));
    require_passage(&repository("docs/reference/json.md"), "- The `kind` of an alert is ", &words, ";");
    let row = "| `bench_dragon_alerts_total` | counter | alerts of the monitors, by `kind`: ";
    require_passage(&repository("docs/reference/metrics.md"), row, &names.join(", "), " |\n");
}
