//! The rooms of the program, of the bus and of geometry use each other in one direction: a room uses only rooms of the rows under
//! its own in the picture of ARCHITECTURE.md. Every room is in that picture.
//!
//! Rooms are modules of one crate, so the compiler does not check this.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Rows of rooms, the lowest first. Those of one row do not use each other.
type Order = [Vec<String>];

#[test]
fn rooms_use_each_other_as_in_the_picture_of_the_architecture() {
    let columns = picture();
    assert_eq!(columns.iter().map(|(folder, _)| &**folder).collect::<Vec<_>>(), ["src", "ipc/src", "geometry/src"]);
    let faults: Vec<String> = columns.iter().flat_map(|(folder, order)| faults(folder, order)).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    for (folder, order) in &columns {
        let drawn: BTreeSet<&str> = order.iter().flatten().map(String::as_str).collect();
        assert_eq!(rooms(&root().join(folder)).iter().map(String::as_str).collect::<BTreeSet<_>>(), drawn, "{folder}");
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The folders of the picture, each with its rows of rooms: a table of columns divided by `│`, with the folders in its first row.
fn picture() -> Vec<(String, Vec<Vec<String>>)> {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("the page can be read");
    let cells = |line: &str| line.split('│').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let mut lines = text.lines().map(cells).filter(|cells| cells.len() == 3);
    let folders = lines.next().expect("the page has a picture of the rooms");
    let mut columns: Vec<_> = folders.into_iter().map(|folder| (folder, Vec::new())).collect();
    for row in lines {
        for ((_, order), cell) in columns.iter_mut().zip(&row).filter(|(_, cell)| !cell.is_empty()) {
            order.insert(0, cell.split(',').map(|room| room.trim().to_owned()).collect());
        }
    }
    columns
}

/// The modules of a folder of sources.
fn rooms(src: &Path) -> BTreeSet<String> {
    let name = |path: PathBuf| path.with_extension("").file_name().and_then(|name| name.to_str()).map(str::to_owned);
    let entries = fs::read_dir(src).expect("a folder of sources").map(|entry| entry.expect("an entry").path());
    let is_room = |path: &PathBuf| path.is_dir() || path.extension().is_some_and(|end| end == "rs");
    entries.filter(is_room).filter_map(name).filter(|name| !["lib", "main"].contains(&&**name)).collect()
}

/// Returns place, room and used room of each upward use in a crate's folder of sources.
fn faults(folder: &str, order: &Order) -> Vec<String> {
    let src = root().join(folder);
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
    let order = ["config", "output", "command_queue", "display,bridge", "cli"]
        .map(|row| row.split(',').map(str::to_owned).collect::<Vec<_>>());
    let found = |room| upward_uses(&order, room, text);
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
    order.iter().position(|rooms| rooms.iter().any(|name| name == room))
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder of sources").map(|entry| entry.expect("an entry").path());
    let of = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    let mut sources: Vec<PathBuf> =
        entries.flat_map(of).filter(|path| path.extension().is_some_and(|end| end == "rs")).collect();
    sources.sort();
    sources
}
