//! The rooms of `src/` and of `ipc/src/` use each other in one direction: a room uses only rooms of rows above its own in
//! [`PROGRAM`] and [`BUS`].
//!
//! Rooms are modules of one crate, so the compiler does not check this.

use std::fs;
use std::path::{Path, PathBuf};

/// Rows of rooms. Those of one row do not use each other.
type Order = [&'static [&'static str]];

/// The rooms of the program.
const PROGRAM: &Order = &[
    &["system"],
    &["drawing", "height_map"],
    &["config"],
    &["output"],
    &["recording"],
    &["source"],
    &["safety", "command_queue"],
    &["display", "bridge"],
    &["cli"],
];
/// The rooms of the bus.
const BUS: &Order = &[&["wire"], &["domain"], &["wake"], &["service"], &["client"]];

#[test]
fn no_room_uses_a_room_above_it() {
    let faults = [faults("src", PROGRAM), faults("ipc/src", BUS)].concat();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Returns place, room and used room of each upward use in a crate's folder of sources.
fn faults(folder: &str, order: &Order) -> Vec<String> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut faults = Vec::new();
    for path in sources(&src) {
        let inner = path.strip_prefix(&src).expect("the path is in this folder").with_extension("");
        let room = inner.iter().next().and_then(|name| name.to_str()).expect("its name is UTF-8").to_owned();
        if ["lib", "main"].contains(&&*room) {
            continue;
        }
        assert!(row(order, &room).is_some(), "{room} is in no row of the order: {}", path.display());
        let text = fs::read_to_string(&path).expect("a source can be read");
        let upward = upward_uses(order, &room, &text).into_iter();
        faults.extend(upward.map(|(line, used)| format!("{}:{line}: {room} uses {used}", path.display())));
    }
    faults
}

#[test]
fn upward_uses_are_found_alone_and_in_braces_and_not_in_comments() {
    let text = "//! As in [`crate::cli`].\nuse crate::config::{Config, cli};\nuse crate::{\n    config::{Config, RATE_HZ},\n    \
                display::Look,\n    output::Counted,\n};\nlet it = crate::command_queue::open(); // crate::bridge\n";
    let found = |room| upward_uses(PROGRAM, room, text);
    assert_eq!(found("output"), [(3, "display"), (8, "command_queue")].map(|(line, used)| (line, used.to_owned())));
    assert_eq!(found("bridge"), [(3, "display".to_owned())], "rooms of one row do not use each other");
    assert_eq!(found("cli"), []);
}

/// Returns the line and the room of each use of a room that is in the same row or a later one.
fn upward_uses(order: &Order, room: &str, text: &str) -> Vec<(usize, String)> {
    let code: Vec<&str> = text.lines().map(|line| line.split_once("//").map_or(line, |(code, _)| code)).collect();
    let code = code.join("\n");
    let is_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    let mut found = Vec::new();
    for (at, path) in code.match_indices("crate::") {
        if code[..at].bytes().next_back().is_some_and(is_word) {
            continue;
        }
        let line = code[..at].matches('\n').count() + 1;
        let used = first_segments(&code[at + path.len()..]).into_iter();
        let is_upward =
            |used: &String| used != room && row(order, used).is_some_and(|used| Some(used) >= row(order, room));
        found.extend(used.filter(is_upward).map(|used| (line, used)));
    }
    found
}

/// Returns the first segment of the path at the start of a text; for paths in braces, the first segment of each.
fn first_segments(text: &str) -> Vec<String> {
    let segment =
        |text: &str| text.trim().split(|character| !matches!(character, 'a'..='z' | '_')).next().map(str::to_owned);
    let Some(inner) = text.strip_prefix('{') else { return segment(text).into_iter().collect() };
    let (mut depth, mut segments) = (0, vec![String::new()]);
    for character in inner.chars() {
        match character {
            '}' if depth == 0 => break,
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => segments.push(String::new()),
            other => segments.last_mut().expect("the list begins with an element").push(other),
        }
    }
    segments.iter().filter_map(|path| segment(path)).collect()
}

fn row(order: &Order, room: &str) -> Option<usize> {
    order.iter().position(|rooms| rooms.contains(&room))
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder of sources").map(|entry| entry.expect("an entry").path());
    let of = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    let mut sources: Vec<PathBuf> =
        entries.flat_map(of).filter(|path| path.extension().is_some_and(|end| end == "rs")).collect();
    sources.sort();
    sources
}
