//! The figures that the planner's questions draw.

use std::fs;
use std::path::Path;

use crate::process::{Ended, Process};
use crate::stage::program;

fn solve(args: &[&str], folder: &Path) -> Ended {
    let mut command = program(&[&["solve"], args].concat());
    command.current_dir(folder);
    Process::start(command).end()
}

fn begins(path: &Path, beginning: &[u8]) -> bool {
    fs::read(path).expect("the figure is there").starts_with(beginning)
}

#[test]
fn the_suffix_says_what_kind_of_file_is_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = solve(&["poses", "--at", "300", "--figure", "plan.svg"], folder.path()).expect_clean();
    assert_eq!(ended.stdout, "the dragon at 300 s drawn to plan.svg\n");
    assert!(begins(&folder.path().join("plan.svg"), b"<svg "));
    solve(&["poses", "--at", "300", "--figure", "plan.PNG"], folder.path()).expect_clean();
    assert!(begins(&folder.path().join("plan.PNG"), b"\x89PNG"));
}

#[test]
fn the_contact_is_drawn_and_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let answer = solve(&["contact", "--figure", "contact.svg", "--format", "json"], folder.path()).expect_clean();
    assert_eq!(answer.last_json()["benches"], serde_json::json!([0, 8]));
    let figure = fs::read_to_string(folder.path().join("contact.svg")).expect("the figure is text");
    assert!(figure.contains("<title>First contact, at 412.473838 s: benches 0 and 8</title>"), "{}", &figure[..300]);
}

#[test]
fn a_turnaround_is_drawn_with_its_turning_circle() {
    let folder = tempfile::tempdir().expect("a folder");
    let route = "[route]\nkind = \"turnaround\"\npitch_m = 1.7\n";
    fs::write(folder.path().join("turn.toml"), route).expect("a file");
    let args = ["poses", "--config", "turn.toml", "--at", "-50", "--figure", "turn.svg"];
    solve(&args, folder.path()).expect_clean();
    let figure = fs::read_to_string(folder.path().join("turn.svg")).expect("the figure is text");
    assert!(figure.contains("aria-label=\"turning circle\""));
}

#[test]
fn what_cannot_be_drawn_is_told_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("pair.toml"), "[dragon]\nbenches = 2\n").expect("a file");
    let cases: &[(&[&str], i32, &str)] = &[
        (&["poses", "--at", "0", "--figure", "plan.pdf"], 2, "must end in .svg or .png"),
        (&["poses", "--at", "0", "--figure", "plan"], 2, "must end in .svg or .png"),
        (&["poses", "--at", "0,1", "--figure", "plan.svg"], 2, "--figure shows one time, not 2: give one with --at"),
        (&["poses", "--at", "0", "--figure", "none/plan.svg"], 1, "cannot write none/plan.svg: No such file"),
        (
            &["contact", "--config", "pair.toml", "--figure", "contact.svg"],
            1,
            "--figure has nothing to show: no benches touch before the run ends",
        ),
    ];
    for (args, code, told) in cases {
        let Ended { stdout, stderr, status } = solve(args, folder.path());
        assert_eq!((status.code(), stdout.as_str()), (Some(*code), ""), "{args:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.lines().count() == 1 && stderr.contains(told), "{stderr:?}");
    }
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

#[test]
fn sensitivity_is_drawn_and_tabled_and_names_why_there_is_no_number() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = ["--figure", "chart.svg", "--xlsx", "chart.xlsx"];
    let args =
        [&["sensitivity", "--parameter", "pitch,speed", "--steps", "1", "--format", "json"], &files[..]].concat();
    let answer = solve(&args, folder.path()).expect_clean().last_json();
    let contact = &answer["quantities"][0];
    assert_eq!(contact["quantity"], "first_contact_s");
    assert!((contact["value"].as_f64().expect("a number") - 412.473_838).abs() <= 5.001e-7, "{contact}");
    assert_eq!(contact["parameters"][1]["parameter"], "speed_mps");
    assert_eq!(contact["parameters"][1]["derivative"].as_f64(), contact["value"].as_f64().map(|time_s| -time_s));
    let pitch_of_pitch = &answer["quantities"][3]["parameters"][0];
    assert!(pitch_of_pitch["derivative"].is_null());
    assert_eq!(pitch_of_pitch["derivative_reason"], "the pitch is the answer, whatever is planned");
    assert!(begins(&folder.path().join("chart.svg"), b"<svg "));
    assert!(begins(&folder.path().join("chart.xlsx"), b"PK"));
}
