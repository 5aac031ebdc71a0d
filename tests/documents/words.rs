//! `docs/reference/words.md` agrees with the code, and is the only table of words.

use std::collections::BTreeSet;
use std::fmt::Debug;

use bench_dragon_ipc::{AlertKind, ShowState};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use crate::{files, read, root};

const PAGE: &str = "docs/reference/words.md";

/// A table of a page: its rows of cells, the titles first. Code is between backticks.
pub(crate) type Table = Vec<Vec<String>>;

pub(crate) fn tables(page: &str) -> Vec<Table> {
    let text = read(&root().join(page));
    let mut tables: Vec<Table> = Vec::new();
    let mut cell = None;
    for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Table(_)) => tables.push(Vec::new()),
            Event::Start(Tag::TableHead | Tag::TableRow) => tables.last_mut().expect("in a table").push(Vec::new()),
            Event::Start(Tag::TableCell) => cell = Some(String::new()),
            Event::End(TagEnd::TableCell) => {
                let row = tables.last_mut().and_then(|table| table.last_mut()).expect("in a row");
                row.extend(cell.take());
            }
            Event::Text(text) => cell.iter_mut().for_each(|cell| cell.push_str(&text)),
            Event::Code(code) => cell.iter_mut().for_each(|cell| cell.extend(["`", &code, "`"])),
            _ => {}
        }
    }
    tables
}

/// The table of a page whose titles begin with these.
fn table(page: &str, titles: &[&str]) -> Table {
    let table = tables(page).into_iter().find(|table| table[0].iter().zip(titles).all(|(cell, title)| cell == title));
    table.unwrap_or_else(|| panic!("{page} has no table of {titles:?}"))
}

fn cells<const N: usize>(rows: &[Vec<String>], columns: [usize; N]) -> Vec<[&str; N]> {
    rows.iter().map(|row| columns.map(|column| &*row[column])).collect()
}

fn assert_equal<Row: PartialEq + Debug>(found: &[Row], expected: &[Row], page: &str) {
    assert_eq!(found, expected, "{page} differs from the code");
}

#[test]
fn the_states_are_those_of_the_bus_with_their_words() {
    let states = ShowState::ALL.map(|state| (state.to_wire().to_string(), state.name(), state.walks()));
    let walks = |is_walking| if is_walking { "walks" } else { "stands" };
    let expected = states.each_ref().map(|(number, name, is_walking)| [*name, &**number, walks(*is_walking)]);
    assert_equal(&cells(&table(PAGE, &["word", "number", "the head"])[1..], [0, 1, 2]), &expected, PAGE);
    let expected = states.each_ref().map(|(number, name, _)| [&**number, *name]);
    let bus = "docs/reference/bus.md";
    assert_equal(&cells(&table(bus, &["number", "state"])[1..], [0, 1]), &expected, bus);
}

#[test]
fn the_alerts_are_those_of_the_bus_with_their_words() {
    let kinds = AlertKind::ALL.map(|kind| (kind.to_wire().to_string(), kind.name()));
    let expected = kinds.each_ref().map(|(number, name)| [*name, &**number]);
    assert_equal(&cells(&table(PAGE, &["word", "number", "meaning"])[1..], [0, 1]), &expected, PAGE);
}

#[test]
fn every_term_has_one_row_and_a_meaning() {
    let mut words = BTreeSet::new();
    let tables = tables(PAGE);
    let terms = tables.iter().filter(|table| table[0][1] == "meaning").flat_map(|table| &table[1..]);
    for row in terms {
        for word in row[0].split(", ") {
            assert!(words.insert(word), "{word} has two rows");
        }
        assert!(!row[1].is_empty(), "{} has no meaning", row[0]);
    }
    assert!(words.len() > 40, "{} terms were found", words.len());
}

#[test]
fn names_beside_the_terms_are_in_the_code() {
    let folders = ["src", "geometry/src", "ipc/src"].map(|folder| root().join(folder));
    let sources: Vec<String> =
        folders.iter().flat_map(|folder| files(folder, &[".rs"])).map(|path| read(&path)).collect();
    let is_part = |char: char| char.is_alphanumeric() || char == '_';
    let known: BTreeSet<&str> = sources.iter().flat_map(|text| text.split(|char| !is_part(char))).collect();
    let mut named = 0;
    for table in tables(PAGE).iter().filter(|table| table[0][1] == "meaning") {
        for row in &table[1..] {
            for name in row[2].split('`').skip(1).step_by(2).filter(|name| *name != "CLOCK_MONOTONIC") {
                assert!(known.contains(name), "{}: {name} is not in the code", row[0]);
                named += 1;
            }
        }
    }
    assert!(named > 30, "{named} names were found");
}

#[test]
fn no_other_page_has_a_table_of_words() {
    for path in files(root(), &[".md"]) {
        let page = path.strip_prefix(root()).expect("a file of the project").to_str().expect("a name in UTF-8");
        let has_words = tables(page).iter().any(|table| table[0][0] == "word");
        assert!(!has_words || page == PAGE, "{page} has a table of words: {PAGE} is the place for them");
    }
}
