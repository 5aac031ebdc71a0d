//! The types of the Python package.

use std::collections::BTreeSet;

use bench_dragon_ipc::{
    AlertKind, DragonState, EventKind, GuardState, Refusal, Sender, ShowState, SourceKind, Stop, TimecodeKind,
    TimecodeState,
};
use test_support::foreign_form::{Constant, line, require_file, wrapped};

use crate::layouts::{self, Field};
use crate::{repository, text};

const PACKAGE: &str = "ipc/python/src/bench_dragon";
/// Width of the package's lines in characters.
const WIDTH: usize = 120;
/// Modules with types of the bus.
const MODULES: [&str; 5] = ["alert", "command", "command_event", "frame", "status"];
/// Types of the bus that the package has.
const TYPES: [&str; 9] = [
    "Alert",
    "Command",
    "CommandEvent",
    "CommandReply",
    "DragonMotion",
    "FrameHeader",
    "HandleState",
    "Status",
    "TimeHistogram",
];

#[test]
fn codes_have_the_names_and_the_numbers_of_the_enums() {
    let classes = [
        class("AlertKind", AlertKind::ABOUT, &AlertKind::MEANINGS),
        class("CommandKind", "Kind of a command to the server.", &EventKind::meanings_of_clients()),
        class("DragonState", DragonState::ABOUT, &DragonState::MEANINGS),
        class("EventKind", EventKind::ABOUT, &EventKind::MEANINGS),
        class("GuardState", GuardState::ABOUT, &GuardState::MEANINGS),
        class("Refusal", Refusal::ABOUT, &Refusal::MEANINGS),
        class("Sender", Sender::ABOUT, &Sender::MEANINGS),
        class("ShowState", ShowState::ABOUT, &ShowState::MEANINGS),
        class("SourceKind", SourceKind::ABOUT, &SourceKind::MEANINGS),
        class_of(
            "IntFlag",
            "Stops",
            "Reasons for which the head stands or brakes. Several may hold at once.",
            Constant::bits("", &Stop::MEANINGS),
        ),
        class("TimecodeKind", TimecodeKind::ABOUT, &TimecodeKind::MEANINGS),
        class("TimecodeState", TimecodeState::ABOUT, &TimecodeState::MEANINGS),
    ];
    let about =
        "\"\"\"Numeric codes of the bus. Generated from the Rust crate by its test `wire`; not changed by hand.\"\"\"";
    let module =
        format!("{about}\n\nfrom enum import IntFlag\n\nfrom bench_dragon.wire import WireCode\n{}", classes.concat());
    require_file(&repository(&format!("{PACKAGE}/codes.py")), &module);
}

fn class(name: &str, about: &str, meanings: &[(&str, u32, &str)]) -> String {
    class_of("WireCode", name, about, Constant::all("", meanings))
}

fn class_of(base: &str, name: &str, about: &str, constants: Vec<Constant>) -> String {
    let codes = constants.into_iter().map(|Constant { name, number, meaning }| {
        let meaning = wrapped(&format!("{meaning}\"\"\""), "    \"\"\"", "    ", WIDTH);
        format!("    {name} = {number}\n{meaning}\n")
    });
    let codes: String = codes.collect();
    format!("\n\nclass {name}({base}):\n    \"\"\"{}\"\"\"\n\n{codes}", line(about))
}

#[test]
fn structures_have_the_layouts_of_the_types() {
    let mut found = BTreeSet::new();
    for module in MODULES {
        let source = text(&format!("{PACKAGE}/{module}.py"));
        for class in source.split("\nclass ").filter(|class| class.contains("(WireType):")) {
            let (name, body) = class.split_once('(').expect("a class has a base");
            let layout = layouts::of(name);
            assert!(body.contains(&format!("TYPE_NAME = \"{}\"\n", layout.type_name)), "{name}: {}", layout.type_name);
            let (_, fields) = body.split_once("_fields_ = [").unwrap_or_else(|| panic!("{name} has no fields"));
            let fields = fields.split_once("]\n").expect("an end of the fields").0;
            let fields: Vec<&str> =
                fields.split(['(', ')']).map(str::trim).filter(|part| part.starts_with('"')).collect();
            let expected: Vec<String> = layout.fields.iter().map(field).collect();
            assert_eq!(fields, expected, "{name}");
            found.insert(name.to_owned());
        }
    }
    assert_eq!(found, BTreeSet::from(TYPES.map(str::to_owned)));
}

/// A field in the words of `ctypes`: `"point_m", ctypes.c_double * 2`.
fn field(Field { name, kind, .. }: &Field) -> String {
    let (element, length) = match kind.trim_matches(['[', ']']).split_once("; ") {
        Some((element, length)) => (element, format!(" * {length}")),
        None => (kind.as_str(), String::new()),
    };
    let element = match element {
        "u32" => "ctypes.c_uint32",
        "u64" => "ctypes.c_uint64",
        "i64" => "ctypes.c_int64",
        "f64" => "ctypes.c_double",
        other => other,
    };
    format!("\"{name}\", {element}{length}")
}
