//! The tables of `docs/reference/json.md` name exactly the keys that commands print: each documented key is printed, and each
//! printed key is documented.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use serde_json::Value;
use test_support::process::Process;

use crate::stage::{Stage, program};

/// The keys of an object, each with the keys of its own object, or of the objects in its list.
#[derive(Clone, Debug, Default, PartialEq)]
struct Keys(BTreeMap<String, Keys>);

/// The keys of each row of the page's tables, by the other words of the row.
struct Page(BTreeMap<String, Keys>);

/// A part of a cell's text.
enum Word {
    Key(String),
    Text(String),
}

/// Objects whose keys depend on their `kind`, and which another page describes; and the starts of dragons by their names.
const BY_KIND: [&str; 4] = ["ahead", "guard", "refusals", "starts_s"];

impl Page {
    fn read() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/json.md");
        let text = fs::read_to_string(path).expect("the page");
        let mut page = BTreeMap::new();
        for table in tables(&text) {
            let titles: Vec<String> = table[0].iter().map(|cell| plain(cell)).collect();
            let Some(column) = titles.iter().position(|title| title == "keys") else { continue };
            let mut above = String::new();
            for row in &table[1..] {
                let mut names: Vec<String> = row[..column].iter().map(|cell| plain(cell)).collect();
                if names[0].is_empty() {
                    names[0].clone_from(&above);
                }
                above.clone_from(&names[0]);
                let is_new = page.insert(names.join(" "), Keys::read(&row[column])).is_none();
                assert!(is_new, "two rows are named {names:?}");
            }
        }
        let coverage = page["the coverage"].clone();
        for keys in page.values_mut() {
            if keys.0.remove("the coverage").is_some() {
                keys.0.extend(coverage.0.clone());
            }
        }
        Self(page)
    }

    /// The keys of some rows together.
    fn keys(&self, rows: &[&str]) -> Keys {
        let row = |row: &&str| self.0.get(*row).unwrap_or_else(|| panic!("no row is named {row}")).0.clone();
        Keys(rows.iter().flat_map(row).collect())
    }
}

impl Keys {
    fn read(cell: &[Word]) -> Self {
        let mut open = vec![(String::new(), Self::default())];
        let mut last = String::new();
        for word in cell {
            let here = open.last_mut().expect("each `)` has its `(`");
            match word {
                Word::Key(key) => {
                    here.1.0.insert(key.clone(), Self::default());
                    last.clone_from(key);
                }
                Word::Text(text) => {
                    if text.contains("the coverage") {
                        here.1.0.insert("the coverage".to_owned(), Self::default());
                    }
                    for char in text.chars() {
                        match char {
                            '(' => open.push((last.clone(), Self::default())),
                            ')' => {
                                let (key, keys) = open.pop().expect("each `)` has its `(`");
                                open.last_mut().expect("each `)` has its `(`").1.0.insert(key, keys);
                            }
                            _ => {}
                        }
                    }
                }
            }
        }
        open.pop().expect("each `(` has its `)`").1
    }

    /// Adds the differences from a printed object to `faults`, and the path of every printed object to `seen`.
    fn compare(&self, printed: &Value, path: &str, seen: &mut BTreeSet<String>, faults: &mut BTreeSet<String>) {
        if let Value::Array(items) = printed {
            return items.iter().for_each(|item| self.compare(item, path, seen, faults));
        }
        let Value::Object(object) = printed else { return };
        let last = path.rsplit('.').next().unwrap_or_default();
        if self.0.is_empty() && BY_KIND.contains(&last) {
            return;
        }
        seen.insert(path.to_owned());
        let duration = ["p50", "p99", "p999", "max"].map(|key| (key.to_owned(), Self::default())).into();
        let is_duration = self.0.is_empty() && last.ends_with("_us");
        let documented = if is_duration { &duration } else { &self.0 };
        let missing = documented.keys().filter(|key| !object.contains_key(*key));
        faults.extend(missing.map(|key| format!("{path}: {key} is documented, and not printed")));
        for (key, value) in object {
            match documented.get(key) {
                Some(keys) => keys.compare(value, &format!("{path}.{key}"), seen, faults),
                None => drop(faults.insert(format!("{path}: {key} is printed, and not documented"))),
            }
        }
    }

    /// Paths of all keys that have keys.
    fn objects(&self, path: &str) -> Vec<String> {
        let below = |(key, keys): (&String, &Self)| {
            let path = format!("{path}.{key}");
            let below = keys.objects(&path);
            if keys.0.is_empty() { below } else { [vec![path], below].concat() }
        };
        self.0.iter().flat_map(below).collect()
    }
}

/// The cells of all tables of a page, the titles first.
fn tables(text: &str) -> Vec<Vec<Vec<Vec<Word>>>> {
    let mut tables: Vec<Vec<Vec<Vec<Word>>>> = Vec::new();
    let mut is_in_cell = false;
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        let table = tables.last_mut();
        let cell = |table: Option<&mut Vec<Vec<Vec<Word>>>>, word| {
            table.and_then(|table| table.last_mut()?.last_mut()).expect("a cell").push(word);
        };
        match event {
            Event::Start(Tag::Table(_)) => tables.push(Vec::new()),
            Event::Start(Tag::TableHead | Tag::TableRow) => table.expect("a table").push(Vec::new()),
            Event::Start(Tag::TableCell) => {
                table.and_then(|table| table.last_mut()).expect("a row").push(Vec::new());
                is_in_cell = true;
            }
            Event::End(TagEnd::TableCell) => is_in_cell = false,
            Event::Code(key) if is_in_cell => cell(table, Word::Key(key.into_string())),
            Event::Text(text) if is_in_cell => cell(table, Word::Text(text.into_string())),
            _ => {}
        }
    }
    tables
}

fn plain(cell: &[Word]) -> String {
    let words = cell.iter().map(|word| match word {
        Word::Key(text) | Word::Text(text) => text.as_str(),
    });
    words.collect()
}

/// A question of `solve`: its rows on the page, its arguments, and its configuration.
type Case = (&'static [&'static str], &'static [&'static str], &'static str);

const EIGHT: &str = "[dragon]\nbenches = 20\n[route]\nkind = \"path\"\nclosed = true\nsegments = [\
    { kind = \"arc\", radius_m = 20, turn_deg = 360 }, { kind = \"arc\", radius_m = 20, turn_deg = -360 }]\n\
    [stage]\noutline = [[-30, -30], [10, -30], [10, 45], [-30, 45]]\n";
const SPIRAL: &str = "[dragon]\nbenches = 60\n[route]\nstart_turns = 5\n";
const LOOSE_SPIRAL: &str = "[dragon]\nbenches = 60\npole_diameter_m = 0.050\n[route]\nstart_turns = 5\n";
const TURN: &str = "[dragon]\nbenches = 30\n[route]\nkind = \"turnaround\"\n";
const LOOSE_TURN: &str = "[dragon]\nbenches = 30\npole_diameter_m = 0.050\n[route]\nkind = \"turnaround\"\n";
const SHORT: &str = "[dragon]\nbenches = 4\n[route]\nkind = \"turnaround\"\n";
const HILL: &str = "[dragon]\nbenches = 12\n[ground]\nrise_x = 0.2\n[route]\nkind = \"path\"\n\
    segments = [{ kind = \"line\", length_m = 20 }, { kind = \"arc\", radius_m = 6, turn_deg = 90 }]\n";
const CROSSING: &str = "[dragon]\nbenches = 4\n[route]\nkind = \"path\"\nsegments = [{ kind = \"line\", length_m = 30 }, \
    { kind = \"arc\", radius_m = 6, turn_deg = 270 }, { kind = \"line\", length_m = 30 }, \
    { kind = \"arc\", radius_m = 0.5, turn_deg = 350 }, { kind = \"line\", length_m = 30 }]\n";

const STOPPED: &str = "[[dragons]]\nname = \"a\"\nbenches = 3\n[dragons.route]\nkind = \"path\"\n\
    segments = [{ kind = \"line\", length_m = 5 }, { kind = \"arc\", radius_m = 0.5, turn_deg = 350 }]\n";
/// A dragon whose route crosses itself before it is too tight.
const LOOPED: &str = "[[dragons]]\nname = \"a\"\nbenches = 4\n[dragons.route]\nkind = \"path\"\nsegments = [\
    { kind = \"line\", length_m = 30 }, { kind = \"arc\", radius_m = 6, turn_deg = 270 }, { kind = \"line\", length_m = 30 }, \
    { kind = \"arc\", radius_m = 0.5, turn_deg = 350 }]\n";
const TWO: &str = "[[dragons]]\nname = \"a\"\nbenches = 3\n[dragons.route]\nkind = \"path\"\n\
    segments = [{ kind = \"line\", length_m = 20 }]\n[[dragons]]\nname = \"b\"\nbenches = 3\n[dragons.route]\nkind = \"path\"\n\
    start_x_m = 9\nstart_y_m = -9\nstart_heading_deg = 90\nsegments = [{ kind = \"line\", length_m = 20 }]\n";

const FENCED: &str = "[dragon]\nbenches = 3\n[route]\nkind = \"path\"\nsegments = [{ kind = \"line\", length_m = 20 }]\n\
    [stage]\ncrowd = [[0, 3], [9, 3]]\nclear_m = 3\n";

const PLAY: &str = "contact with play in the hinges";
const OUTLINE: &str = "contact and route with an outline of the stage";
const LIST: &str = "route --list (instead of those of route)";

/// Every question with every flag that adds keys. Together they print every documented object at least once.
const CASES: [Case; 38] = [
    (&["poses"], &["poses", "--at", "0,1"], SPIRAL),
    (&["poses of several dragons"], &["poses", "--at", "1"], TWO),
    (&["contact of several dragons"], &["contact"], TWO),
    (&["contact of several dragons"], &["contact"], STOPPED),
    (&["route of several dragons"], &["route"], LOOPED),
    (&["speed-limit of several dragons"], &["speed-limit", "--limit", "2"], TWO),
    (&["sensitivity of several dragons"], &["sensitivity"], TWO),
    (&["schedule"], &["schedule", "--clearance", "0.5"], TWO),
    (&["schedule"], &["schedule", "--work", "1"], TWO),
    (&["sweep"], &["sweep"], EIGHT),
    (&["sweep"], &["sweep"], FENCED),
    (&["contact"], &["contact"], SPIRAL),
    (&["contact"], &["contact", "--clearance", "0.05"], SPIRAL),
    (&["contact"], &["contact", "--work", "1"], ""),
    (&["contact", "contact --max-ratio"], &["contact", "--max-ratio", "1.5"], TURN),
    (&["contact", "contact --max-ratio"], &["contact", "--max-ratio", "1000"], TURN),
    (&["contact", "contact --profile"], &["contact", "--profile", "--near", "0.3"], SPIRAL),
    (&["contact", PLAY], &["contact"], LOOSE_SPIRAL),
    (&["contact", PLAY], &["contact"], LOOSE_TURN),
    (&["contact", OUTLINE], &["contact"], EIGHT),
    (&["route"], &["route"], SPIRAL),
    (&["route"], &["route"], CROSSING),
    (&["route", OUTLINE], &["route"], EIGHT),
    (&["route", "route on ground"], &["route"], HILL),
    (&["pitch"], &["pitch"], ""),
    (&["pitch"], &["pitch", "--turn-diameter", "9", "--clearance", "0.05"], ""),
    (&["pitch"], &["pitch", "--work", "1"], LOOSE_SPIRAL),
    (&["turn"], &["turn"], TURN),
    (&["turn"], &["turn", "--clearance", "0.3"], "[route]\nkind = \"turnaround\"\n"),
    (&["turn"], &["turn", "--max-ratio", "1.5"], TURN),
    (&["turn"], &["turn", "--radius-ratio", "3"], TURN),
    (&["turn", "turn --shortest"], &["turn", "--shortest", "--max-ratio", "1.3"], SHORT),
    (&["turn", "turn with play in the hinges"], &["turn"], LOOSE_TURN),
    (&["speed-limit"], &["speed-limit", "--limit", "2"], TURN),
    (&["speed-limit"], &["speed-limit", "--limit", "2"], SPIRAL),
    (&["profile"], &["profile", "--limit", "2", "--accel", "1"], TURN),
    (&["profile"], &["profile", "--limit", "2", "--accel", "1"], SPIRAL),
    (&["sensitivity"], &["sensitivity", "--parameter", "pitch", "--steps", "1"], SPIRAL),
];

#[test]
fn every_documented_key_of_a_question_is_printed_and_every_printed_key_is_documented() {
    let (page, stage) = (Page::read(), Stage::new());
    let (mut seen, mut faults) = (BTreeSet::new(), BTreeSet::new());
    let mut asked = BTreeSet::new();
    let mut compare = |rows: &[&'static str], args: &[&str]| {
        let mut command = program(&[&["solve"], args, &["--format", "json"]].concat());
        command.current_dir(stage.path(""));
        let answer = Process::start(command).end().expect_clean().last_json();
        page.keys(rows).compare(&answer, args[0], &mut seen, &mut faults);
        asked.extend(rows.iter().copied());
    };
    for (rows, args, text) in CASES {
        fs::write(stage.path("asked.toml"), text).expect("a configuration");
        compare(rows, &[args, &["--config", "asked.toml"]].concat());
    }
    let drawing = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/processes/drawings/seam.svg");
    compare(&[LIST], &["route", "--list", &drawing.display().to_string()]);
    assert!(faults.is_empty(), "{faults:#?}");

    let questions = ["poses", "contact", "route", "pitch", "turn", "speed-limit", "profile", "sensitivity", "sweep"];
    let documented = page.0.iter().filter(|(row, _)| questions.iter().any(|question| row.starts_with(question)));
    for (row, keys) in documented {
        assert!(asked.contains(row.as_str()), "nothing asks for the keys of {row}");
        let question = row.split(' ').next().unwrap_or_default();
        let unseen: Vec<String> = keys.objects(question).into_iter().filter(|path| !seen.contains(path)).collect();
        assert!(unseen.is_empty(), "{row}: no answer has {unseen:?}");
    }
}

/// Fails unless each line has the keys of its row.
#[track_caller]
fn assert_rows<'a>(page: &Page, lines: impl IntoIterator<Item = (&'a str, &'a Value)>) {
    let (mut seen, mut faults) = (BTreeSet::new(), BTreeSet::new());
    for (row, line) in lines {
        page.keys(&[row]).compare(line, row, &mut seen, &mut faults);
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Fails unless each line of a running command, without its type, has the keys of its row. Returns the types.
#[track_caller]
fn assert_lines(page: &Page, command: &str, lines: &[Value]) -> BTreeSet<String> {
    let mut kinds = BTreeSet::new();
    for line in lines {
        let mut line = line.clone();
        let kind = line.as_object_mut().and_then(|line| line.remove("type")).expect("a line has a type");
        let kind = kind.as_str().expect("a type is a word").to_owned();
        let row = format!("{command} {kind}");
        let row = if page.0.contains_key(&row) { row } else { format!("{row} (with --progress)") };
        assert_rows(page, [(row.as_str(), &line)]);
        kinds.insert(kind);
    }
    kinds
}

#[test]
fn every_line_of_a_running_command_has_its_documented_keys() {
    let (page, stage) = (Page::read(), Stage::new());
    fs::write(stage.path("stage.toml"), SPIRAL).expect("a configuration");
    let pace = ["--config", "stage.toml", "--time-scale", "20", "--rate", "100", "--until", "14", "--readers", "2"];
    let mut server = stage.start(&[&["serve", "--format", "json"], &pace[..]].concat());
    // The services exist, so no reader reports that it waits for a server.
    let started = server.json();
    let monitor = stage.start(&["monitor", "--format", "json", "--progress", "0.1"]);
    let recorder = stage.start(&["record", "tonight.mcap", "--format", "json"]);
    let served = [vec![started], server.end().expect_clean().json_lines()].concat();
    // Readers wait for the next run until a signal ends them.
    let [watched, recorded] = [monitor, recorder].map(|reader| reader.terminate().expect_clean().json_lines());
    for (command, lines, kinds) in [
        ("serve", served, &["started", "summary"][..]),
        ("monitor", watched, &["alert", "command", "progress", "summary"]),
        ("record", recorded, &["started", "summary"]),
    ] {
        let wanted = kinds.iter().map(|kind| (*kind).to_owned()).collect();
        assert_eq!(assert_lines(&page, command, &lines), wanted, "{command}");
    }
    let without_a_bus = |args: &[&str]| {
        let mut command = program(&[args, &["--format", "json"]].concat());
        command.current_dir(stage.path(""));
        Process::start(command).end().expect_clean()
    };
    let verified = without_a_bus(&["replay", "tonight.mcap", "--verify"]).json_lines();
    assert_eq!(assert_lines(&page, "replay --verify", &verified), ["run", "verification"].map(str::to_owned).into());
    let replayed =
        stage.run(&["replay", "tonight.mcap", "--rate", "100", "--format", "json"]).expect_clean().json_lines();
    assert_eq!(assert_lines(&page, "replay", &replayed), ["pass", "started", "summary"].map(str::to_owned).into());
    let exported = without_a_bus(&["export", "tonight.mcap", "tonight.csv"]).last_json();
    let repaired = stage.run(&["record", "--repair", "tonight.mcap", "--format", "json"]).expect_clean().last_json();
    assert_rows(&page, [("export", &exported), ("record --repair, record --check", &repaired)]);
}

#[test]
fn every_single_report_has_its_documented_keys() {
    let (page, stage) = (Page::read(), Stage::new());
    let server = stage.serve(&["--rate", "100"]);
    let report = |args: &[&str]| stage.run(&[args, &["--format", "json"]].concat()).last_json();
    let reports = [
        ("echo", report(&["echo", "--count", "1"])),
        ("hz", report(&["hz", "--seconds", "1"])),
        ("latency", report(&["latency", "--seconds", "0.1"])),
        ("ctl COMMAND", report(&["ctl", "pause"])),
        // Beyond the end of the run.
        ("ctl COMMAND", report(&["ctl", "seek", "100000"])),
        ("ctl status", report(&["ctl", "status"])),
        ("doctor", report(&["doctor"])),
    ];
    assert_rows(&page, reports.iter().map(|(row, report)| (*row, report)));
    server.stop();
    fs::write(stage.path("cued.toml"), "[[cues]]\nname = \"a\"\nat_s = 400\n").expect("a file");
    let server = stage.serve(&["--rate", "100", "--config", "cued.toml"]);
    assert_rows(&page, [("ctl cues", &report(&["ctl", "cues"]))]);
    server.stop();
}
