//! The ROS 2 messages, which are also the definitions in recordings.

use bench_dragon_ipc::{
    Alert, AlertKind, CommandEvent, CommandReply, DragonState, EventKind, FrameHeader, Refusal, Sender, ShowState,
};
use test_support::foreign_form::{Constant, require_passage, wrapped};

use crate::layouts::{self, Field};
use crate::{repository, text};

const MESSAGES: &str = "packaging/ros2/bench_dragon_msgs/msg";
/// Width of the messages in characters.
const WIDTH: usize = 120;

#[test]
fn messages_have_the_fields_of_the_types_in_their_order() {
    let messages = [
        ("Frame", "FrameHeader"),
        ("FormationFrame", "FrameHeader"),
        ("DragonMotion", "DragonMotion"),
        ("HandleState", "HandleState"),
        ("Alert", "Alert"),
        ("CommandEvent", "CommandEvent"),
    ];
    for (message, name) in messages {
        let contents = text(&format!("{MESSAGES}/{message}.msg"));
        let fields = contents.lines().filter(|line| !line.is_empty() && !line.starts_with('#') && !line.contains('='));
        let layout = layouts::of(name).fields;
        let is_shown = |field: &&Field| name != "FrameHeader" || field.offset < FrameHeader::SHOW_BYTES;
        let mut expected: Vec<String> = layout.iter().filter(is_shown).map(declaration).collect();
        // The payload of a frame follows the values of the show. The number of dragons is that of the entries.
        expected.extend((name == "FrameHeader").then(|| "HandleState[] handles".to_owned()));
        if message == "FormationFrame" {
            expected.extend(["float64 course_m", "float64 course_mps", "DragonMotion[] dragons"].map(str::to_owned));
        }
        assert_eq!(fields.collect::<Vec<_>>(), expected, "{message}");
    }
}

/// A field in ROS's interface definition language: `float64[2] point_m`.
fn declaration(Field { name, kind, .. }: &Field) -> String {
    let (element, length) = match kind.trim_matches(['[', ']']).split_once("; ") {
        Some((element, length)) => (element, format!("[{length}]")),
        None => (kind.as_str(), String::new()),
    };
    let element = match element {
        "u32" => "uint32",
        "u64" => "uint64",
        "i64" => "int64",
        "f64" => "float64",
        _ => panic!("{name} has the type {kind}"),
    };
    format!("{element}{length} {name}")
}

#[test]
fn coded_fields_have_the_constants_of_their_enums() {
    let mut kinds = Constant::all("KIND_", &EventKind::MEANINGS);
    let unknown = "A command that the source does not support.";
    kinds.push(Constant::new("KIND_UNKNOWN", CommandEvent::UNKNOWN_KIND, unknown));
    let accepted = CommandReply::accepted(0, 0).refusal;
    let none = Constant::new("REFUSAL_NONE", accepted, "The command was accepted.");
    let refusals = [vec![none], Constant::all("REFUSAL_", &Refusal::MEANINGS)].concat();
    require_constants("Frame", "bench_count", "state", &Constant::all("", &ShowState::MEANINGS));
    require_constants("FormationFrame", "bench_count", "state", &Constant::all("", &ShowState::MEANINGS));
    require_constants("DragonMotion", "bench_count", "state", &Constant::all("", &DragonState::MEANINGS));
    require_constants("Alert", "point_m", "kind", &Constant::all("", &AlertKind::MEANINGS));
    require_constants("CommandEvent", "highest", "kind", &kinds);
    require_constants("CommandEvent", "kind", "sender", &Constant::all("SENDER_", &Sender::MEANINGS));
    require_constants("CommandEvent", "pid", "refusal", &refusals);
}

/// Requires the constants between two fields. Viewers find the name of a number directly before its field.
fn require_constants(message: &str, field_before: &str, field: &str, constants: &[Constant]) {
    let lines = constants.iter().map(|Constant { name, number, meaning }| {
        format!("{}\nuint32 {name}={number}\n", wrapped(meaning, "# ", "# ", WIDTH))
    });
    let path = repository(&format!("{MESSAGES}/{message}.msg"));
    let before = format!(" {field_before}\n\n");
    require_passage(&path, &before, &lines.collect::<String>(), &format!("uint32 {field}\n"));
}

#[test]
fn sentinels_of_an_alert_are_constants_before_their_fields() {
    let alert = text(&format!("{MESSAGES}/Alert.msg"));
    for (constant, field) in [
        (format!("int64 NO_FORECAST={}", Alert::NO_FORECAST), "int64 forecast_ns"),
        (format!("uint32 NO_BENCH={}", Alert::NO_BENCH), "uint32 bench_a"),
    ] {
        let mut lines = alert.lines().filter(|line| !line.starts_with('#')).skip_while(|line| *line != constant);
        assert_eq!(lines.nth(1), Some(field), "after {constant}");
    }
}
