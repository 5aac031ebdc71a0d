//! A zero has no sign: neither one that is rounded for people, nor a negative zero of the arithmetic.

use std::fs;

use test_support::process::Process;

use crate::stage::{Stage, program};

/// A dragon that walks west along the x axis, with its head at the origin at t = 0. Its coordinates, angles and speeds along y are
/// zeros of either sign, and numbers of about 10⁻¹⁶.
const WEST: &str = "[dragon]\nbenches = 4\n[route]\nkind = \"path\"\nstart_heading_deg = 180\nstart_s = -0.0001\nend_s = 6\n\
    segments = [{ kind = \"line\", length_m = 20 }]\n";

/// A closed eight whose crossing and ends are at the origin.
const EIGHT: &str = "[dragon]\nbenches = 8\n[route]\nkind = \"path\"\nclosed = true\nsegments = [\
    { kind = \"arc\", radius_m = 20, turn_deg = 360 }, { kind = \"arc\", radius_m = 20, turn_deg = -360 }]\n\
    [stage]\noutline = [[-0.0, -30], [10, -30], [10, 45], [-30, 45]]\n";

const TURN: &str = "[dragon]\nbenches = 12\n[route]\nkind = \"turnaround\"\n";

/// Returns the numbers of a text that are a zero with a sign.
fn signed_zeros(text: &str) -> Vec<&str> {
    let words = text.split(|char: char| !(char.is_ascii_alphanumeric() || "+-._−".contains(char)));
    let is_zero = |word: &&str| {
        word.strip_prefix(['-', '−']).and_then(|digits| digits.trim_end_matches('.').parse::<f64>().ok()) == Some(0.0)
    };
    words.filter(is_zero).collect()
}

#[track_caller]
fn assert_unsigned(what: &str, text: &str) {
    assert!(!text.is_empty(), "{what} is empty");
    let zeros = signed_zeros(text);
    assert!(zeros.is_empty(), "{what} has {zeros:?}:\n{text}");
}

#[test]
fn signed_zeros_are_found_in_any_text() {
    let text = "at (-0.000, 1.0) m, [-0.0,-0], -0.0001 of 4-0.0, tour-0.0.csv, −0.00 and -0e0.";
    assert_eq!(signed_zeros(text), ["-0.000", "-0.0", "-0", "−0.00", "-0e0."]);
}

#[test]
fn no_answer_of_the_planner_and_no_figure_has_a_zero_with_a_sign() {
    let stage = Stage::new();
    let poses = ["poses", "--at", "-0.0001,-0,1"];
    for (config, questions) in [
        (WEST, vec![&poses[..], &["contact"], &["contact", "--clearance", "-0"], &["route"]]),
        (
            EIGHT,
            vec![&["poses", "--at", "-0"], &["contact", "--profile"], &["contact", "--max-ratio", "1"], &["route"]],
        ),
        (
            TURN,
            vec![
                &["poses", "--at", "-0"],
                &["turn"],
                &["turn", "--max-ratio", "1"],
                &["speed-limit", "--limit", "2"],
                &["profile", "--limit", "2", "--accel", "1", "--speed", "0.5"],
            ],
        ),
    ] {
        fs::write(stage.path("asked.toml"), config).expect("a configuration");
        let ask = |args: &[&str]| {
            let mut command = program(&[&["solve"], args, &["--config", "asked.toml"]].concat());
            command.current_dir(stage.path(""));
            Process::start(command).end()
        };
        for args in questions {
            let formats = if args[0] == "poses" { &["text", "json", "csv"][..] } else { &["text", "json"] };
            for format in formats {
                let ended = ask(&[args, &["--format", format]].concat()).expect_clean();
                assert_unsigned(&format!("{args:?} as {format}"), &ended.stdout);
            }
        }
        for args in [&["poses", "--at", "0"][..], &["route"]] {
            ask(&[args, &["--figure", "figure.svg"]].concat()).expect_clean();
            assert_unsigned("a figure", &fs::read_to_string(stage.path("figure.svg")).expect("a figure"));
        }
    }
}

#[test]
fn no_reader_recording_or_report_of_a_show_has_a_zero_with_a_sign() {
    let stage = Stage::new();
    fs::write(stage.path("west.toml"), WEST).expect("a configuration");
    let server = stage.serve(&["--config", "west.toml", "--rate", "100", "--held"]);
    for args in [
        &["echo", "--count", "1"][..],
        &["echo", "--count", "1", "--format", "json"],
        &["ctl", "seek", "-0"],
        &["ctl", "speed", "-0"],
        &["ctl", "status"],
        &["ctl", "status", "--format", "json"],
    ] {
        let ended = stage.run(args);
        assert_unsigned(&format!("{args:?}"), &format!("{}{}", ended.stdout, ended.stderr));
    }
    server.stop();

    let show = ["show", "--config", "west.toml", "--rate", "1000", "--until", "0.01", "--out", "out"];
    let ended = stage.run(&show);
    assert_unsigned("the show", &format!("{}{}", ended.stdout, ended.stderr));
    for name in ["summary.json", "report.html", "config.toml"] {
        assert_unsigned(name, &fs::read_to_string(stage.path("out").join(name)).expect("a file of the show"));
    }
    for more in [&[][..], &["--benches"], &["--commands"]] {
        let args = [&["export", "out", "-", "--every", "0.001"], more].concat();
        let mut command = program(&args);
        command.current_dir(stage.path(""));
        assert_unsigned(&format!("{args:?}"), &Process::start(command).end().expect_clean().stdout);
    }
}
