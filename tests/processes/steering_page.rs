//! The messages of `docs/reference/steering.md` have the effect that the page promises, sent by `python-osc` and npm's `osc`.

use std::fs;
use std::path::Path;

use bench_dragon_ipc::{FrameHeader, ShowState};
use serde_json::{Value, json};
use test_support::process::Process;

use crate::bridge_steering::{Desk, listen};
use crate::reader::Reader;
use crate::stage::Stage;

const SECRET: &str = "night-of-dragons";
const DESKS: [&str; 6] = ["Bitfocus Companion", "QLab", "Chataigne", "TouchOSC", "grandMA3", "Eos"];

/// A message of the page, under the desk's name.
#[derive(Debug)]
struct Example {
    desk: String,
    /// Address and arguments.
    message: Value,
}

/// The messages in the column *sends* of the tables.
fn examples() -> Vec<Example> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/steering.md");
    let text = fs::read_to_string(path).expect("the page");
    let (mut desk, mut is_sends, mut examples) = (String::new(), false, Vec::new());
    for line in text.lines() {
        if let Some(title) = line.strip_prefix("### ") {
            title.clone_into(&mut desk);
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if !line.starts_with('|') {
            is_sends = false;
        } else if cells.last() == Some(&"sends") {
            is_sends = true;
        } else if is_sends && !line.starts_with("|---") {
            let sends = cells.last().expect("a cell").trim_matches('`');
            examples.push(Example { desk: desk.clone(), message: message(sends) });
        }
    }
    examples
}

/// A message in the page's notation. Its arguments are written as in JSON.
fn message(text: &str) -> Value {
    let mut words = text.split(' ');
    let address = words.next().expect("an address");
    let arguments = words.map(|word| serde_json::from_str(word).unwrap_or_else(|error| panic!("{error} in {text}")));
    std::iter::once(json!(address)).chain(arguments).collect()
}

/// A running show, with a listener for messages without a secret, and one for messages with it.
struct Rehearsal {
    reader: Reader,
    bridges: [(Process, String); 2],
    stage: Stage,
}

impl Rehearsal {
    fn ctl(&self, args: &[&str]) {
        // A refusal means that the show is in this state already.
        self.stage.run(&[&["ctl"], args].concat());
    }

    /// Brings the show into a state in which the command has an effect.
    fn prepare(&self, name: &str) {
        self.ctl(&["release"]);
        self.ctl(&["resume"]);
        self.ctl(&["speed", "0.5"]);
        self.ctl(&["seek", "10"]);
        match name {
            "release" => self.ctl(&["hold"]),
            "resume" => self.ctl(&["pause"]),
            _ => {}
        }
    }

    /// Waits until a frame shows the effect of a message.
    fn await_effect(&mut self, name: &str, value: Option<f64>) {
        let has_effect = |header: &FrameHeader| match (name, value) {
            ("hold", _) => header.show_state() == Some(ShowState::Held),
            ("pause", _) => header.show_state() == Some(ShowState::Paused),
            ("release" | "resume", _) => header.show_state() == Some(ShowState::Running),
            ("speed", Some(speed_mps)) => header.head_speed_mps == speed_mps,
            ("seek", Some(show_time_s)) => header.show_time_s() >= show_time_s,
            other => panic!("the page has no effect for {other:?}"),
        };
        self.reader.read_until(&format!("{name} has its effect"), has_effect);
    }
}

/// Sends each message of the page from desks that `start` starts, one for an address.
fn send_all(start: impl Fn(&str) -> Option<Desk>) {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let reader = Reader::join(&stage);
    let flags: [&[&str]; 2] = [&["--full"], &["--full", "--secret", SECRET]];
    let bridges = flags.map(|flags| listen(&stage, &[&["--allow", "127.0.0.1"], flags].concat()));
    let mut rehearsal = Rehearsal { reader, bridges, stage };
    let Some(mut desks) =
        rehearsal.bridges.each_ref().map(|(_, address)| start(address)).into_iter().collect::<Option<Vec<_>>>()
    else {
        for (bridge, _) in rehearsal.bridges {
            bridge.terminate().expect_clean();
        }
        drop(rehearsal.reader);
        server.stop();
        return;
    };
    for Example { desk, message } in examples() {
        let arguments = message.as_array().expect("a list");
        let name = arguments[0].as_str().and_then(|address| address.strip_prefix("/dragon/")).expect("our address");
        rehearsal.prepare(name);
        let with_secret = arguments.get(1).is_some_and(|argument| *argument == SECRET);
        let reply = desks[usize::from(with_secret)].ask(&message);
        assert_eq!((&reply[0], &reply[1]), (&json!(name), &json!(1)), "{desk}: {message}: {reply:?}");
        rehearsal.await_effect(name, arguments.last().and_then(Value::as_f64));
    }
    for (bridge, _) in rehearsal.bridges {
        bridge.terminate().expect_clean();
    }
    server.stop();
}

#[test]
fn each_desk_has_messages_with_and_without_a_secret() {
    let examples = examples();
    for desk in DESKS {
        let of_desk: Vec<&Example> = examples.iter().filter(|example| example.desk == desk).collect();
        let with_secret = of_desk.iter().filter(|example| example.message[1] == SECRET).count();
        assert!(of_desk.len() >= 5 && (1..of_desk.len()).contains(&with_secret), "{desk}: {of_desk:?}");
    }
    assert!(examples.iter().all(|example| DESKS.contains(&&*example.desk)), "{examples:?}");
}

#[test]
fn python_osc_sends_each_message_of_the_page_and_it_has_its_effect() {
    send_all(|address| Some(Desk::python(address, &[])));
}

#[test]
fn npm_osc_sends_each_message_of_the_page_and_it_has_its_effect() {
    send_all(Desk::node);
}
