//! The checked-in header is the generated one: the bus's enums, and what cbindgen makes of the sources.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use bench_dragon_ipc::{
    AlertKind, DragonState, EventKind, GuardState, Refusal, Sender, ShowState, SourceKind, Stop, TimecodeKind,
    TimecodeState,
};
use test_support::foreign_form::{Constant, line, require_file, wrapped};

/// Width of the header in characters.
const WIDTH: usize = 100;
/// Source files in the order of the header. Each function is in the file of its types.
const SOURCES: [&str; 11] = [
    "result",
    "show",
    "frames",
    "frame",
    "bench",
    "continuity",
    "description",
    "status",
    "alert",
    "command",
    "command_event",
];

#[test]
fn every_public_module_is_in_the_header() {
    let root = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).expect("src/lib.rs exists");
    let public: BTreeSet<&str> =
        root.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    assert_eq!(BTreeSet::from(SOURCES), public);
}

#[test]
fn the_checked_in_header_is_the_generated_one() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config =
        cbindgen::Config::from_file(package.join("cbindgen.toml")).expect("cbindgen.toml is a configuration");
    config.after_includes = config.after_includes.map(|notice| format!("{notice}\n\n{}", enums()));
    let builder = SOURCES.iter().fold(cbindgen::Builder::new().with_config(config), |builder, source| {
        builder.with_src(package.join(format!("src/{source}.rs")))
    });
    let mut generated = Vec::new();
    builder.generate().expect("cbindgen reads the sources").write(&mut generated);
    let generated = String::from_utf8(generated).expect("a header is text");
    require_file(&package.join("include/bench_dragon.h"), &generated);
}

/// The enums of the bus in C.
fn enums() -> String {
    let events = Constant::all("BD_EVENT_", &EventKind::MEANINGS);
    let accepted = Constant::new("BD_ACCEPTED", 0, "The command was accepted.");
    let refusals = [vec![accepted], Constant::all("BD_REFUSED_", &Refusal::MEANINGS)].concat();
    [
        typedef("bd_show_state_t", ShowState::ABOUT, &Constant::all("BD_", &ShowState::MEANINGS)),
        typedef("bd_dragon_state_t", DragonState::ABOUT, &Constant::all("BD_DRAGON_", &DragonState::MEANINGS)),
        typedef("bd_alert_kind_t", AlertKind::ABOUT, &Constant::all("BD_ALERT_", &AlertKind::MEANINGS)),
        typedef("bd_command_t", "Kind of a command.", &Constant::all("BD_COMMAND_", &EventKind::meanings_of_clients())),
        typedef("bd_refusal_t", &format!("{} Later versions may add reasons.", Refusal::ABOUT), &refusals),
        typedef("bd_event_kind_t", EventKind::ABOUT, &events),
        typedef("bd_source_kind_t", SourceKind::ABOUT, &Constant::all("BD_KIND_", &SourceKind::MEANINGS)),
        typedef("bd_guard_state_t", GuardState::ABOUT, &Constant::all("BD_GUARD_", &GuardState::MEANINGS)),
        typedef("bd_timecode_state_t", TimecodeState::ABOUT, &Constant::all("BD_TIMECODE_", &TimecodeState::MEANINGS)),
        typedef("bd_timecode_kind_t", TimecodeKind::ABOUT, &Constant::all("BD_PROTOCOL_", &TimecodeKind::MEANINGS)),
        typedef(
            "bd_stop_t",
            &format!("{} A bit of `stops`.", Stop::ABOUT),
            &Constant::bits("BD_STOP_", &Stop::MEANINGS),
        ),
        typedef("bd_sender_t", Sender::ABOUT, &Constant::all("BD_SENDER_", &Sender::MEANINGS)),
    ]
    .join("\n\n")
}

fn typedef(name: &str, about: &str, constants: &[Constant]) -> String {
    let lines = constants
        .iter()
        .map(|Constant { name, number, meaning }| format!("{}\n  {name} = {number},\n", comment("  ", meaning)));
    format!("{}\ntypedef enum {{\n{}}} {name};", comment("", &line(about)), lines.collect::<String>())
}

fn comment(indent: &str, text: &str) -> String {
    let begin = format!("{indent} * ");
    format!("{indent}/**\n{}\n{indent} */", wrapped(text, &begin, &begin, WIDTH))
}
