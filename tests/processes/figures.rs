//! The figures that the planner's questions draw.

use std::fs;
use std::path::Path;

use test_support::process::{Ended, Process};

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
fn the_suffix_selects_the_kind_of_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = solve(&["poses", "--at", "300", "--figure", "plan.svg"], folder.path()).expect_clean();
    assert!(ended.stdout.starts_with("at 300 s\n"), "{}", ended.stdout);
    assert!(ended.stdout.ends_with("the dragon at 300 s drawn to plan.svg\n"), "{}", ended.stdout);
    assert!(begins(&folder.path().join("plan.svg"), b"<svg "));
    solve(&["poses", "--at", "300", "--figure", "plan.PNG"], folder.path()).expect_clean();
    assert!(begins(&folder.path().join("plan.PNG"), b"\x89PNG"));
    solve(&["poses", "--at", "300", "--figure", "plan.pdf"], folder.path()).expect_clean();
    assert!(begins(&folder.path().join("plan.pdf"), b"%PDF-1.4\n"));
}

#[test]
fn the_contact_is_drawn_and_printed() {
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
fn impossible_figures_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("pair.toml"), "[dragon]\nbenches = 2\n").expect("a file");
    let cases: &[(&[&str], i32, &str)] = &[
        (&["poses", "--at", "0", "--figure", "plan.tif"], 2, "must end in .svg, .pdf or .png"),
        (&["poses", "--at", "0", "--figure", "plan"], 2, "must end in .svg, .pdf or .png"),
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
        // The answer is printed unless the question is refused.
        assert_eq!((status.code(), stdout.is_empty()), (Some(*code), *code == 2), "{args:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.lines().count() == 1 && stderr.contains(told), "{stderr:?}");
    }
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

#[test]
fn sensitivity_is_drawn_and_tabled_with_a_reason_for_each_missing_number() {
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
    assert_eq!(
        pitch_of_pitch["derivative_reason"],
        "the pitch is the answer itself and does not depend on the planned pitch"
    );
    assert!(begins(&folder.path().join("chart.svg"), b"<svg "));
    assert!(begins(&folder.path().join("chart.xlsx"), b"PK"));
}

/// Returns the text of a vector figure, with its labels for screen readers.
fn words(path: &Path) -> String {
    fs::read_to_string(path).expect("the figure is text")
}

#[test]
fn a_turn_is_drawn_with_its_nearest_pair_and_its_clearance() {
    let folder = tempfile::tempdir().expect("a folder");
    let answer = solve(&["turn", "--figure", "turn.svg", "--format", "json"], folder.path()).expect_clean().last_json();
    let nearest = &answer["least_clearance"];
    let clearance_mm = 1000.0 * nearest["clearance_m"].as_f64().expect("a number");
    let told =
        format!("Benches {} and {}: clearance {clearance_mm:.3} mm", nearest["benches"][0], nearest["benches"][1]);
    let figure = words(&folder.path().join("turn.svg"));
    // The label of the pair, and the dimension between its boards.
    assert_eq!(figure.matches(&format!("aria-label=\"{told}\"")).count(), 2, "{told}");
    assert!(figure.contains("aria-label=\"nearest pair\""));
}

#[test]
fn the_smallest_pitch_is_drawn_with_the_pair_that_binds() {
    let folder = tempfile::tempdir().expect("a folder");
    let answer =
        solve(&["pitch", "--figure", "pitch.svg", "--format", "json"], folder.path()).expect_clean().last_json();
    let benches = &answer["limit"]["benches"];
    let figure = words(&folder.path().join("pitch.svg"));
    for told in [format!("Benches {} and {} touch", benches[0], benches[1]), "circle of diameter 9 m".to_owned()] {
        assert!(figure.contains(&format!("aria-label=\"{told}\"")), "{told}");
    }
    assert!(figure.contains("<title>The tightest spiral, pitch 0.450337 m, at "), "{}", &figure[..300]);
    // The head's link is the limit and not a pair of benches, so the nearest pair is shown.
    fs::write(folder.path().join("one.toml"), "[dragon]\nbenches = 3\n").expect("a file");
    let args = ["pitch", "--config", "one.toml", "--turn-diameter", "1", "--figure", "one.svg"];
    let ended = solve(&args, folder.path()).expect_clean();
    assert!(ended.stdout.ends_with("drawn to one.svg\n"), "{}", ended.stdout);
    assert!(words(&folder.path().join("one.svg")).contains("aria-label=\"Benches 0 and 2: clearance "));
}

#[test]
fn a_figure_carries_a_title_and_the_dragons_data_and_fills_its_paper() {
    let folder = tempfile::tempdir().expect("a folder");
    let poster = ["--title", "Gate <North> & \"South\"", "--paper", "A3"];
    let args = [&["poses", "--at", "300", "--figure", "plan.svg"], &poster[..]].concat();
    solve(&args, folder.path()).expect_clean();
    let figure = words(&folder.path().join("plan.svg"));
    for told in [
        "width=\"297mm\" height=\"420mm\"",
        "<title>Gate &lt;North&gt; &amp; &quot;South&quot;: The dragon at 300 s</title>",
        "aria-label=\"Gate &lt;North&gt; &amp; &quot;South&quot;\"",
        "aria-label=\"223 benches · head 3.41 m, others 2.2 m · 0.3 m wide · holes at 0.275 m · spiral, pitch 0.55 m · \
         head 1 m/s\"",
    ] {
        assert!(figure.contains(told), "{told}: {}", &figure[..400]);
    }
    let args = ["contact", "--figure", "contact.png", "--paper", "letter"];
    solve(&args, folder.path()).expect_clean();
    let image = fs::read(folder.path().join("contact.png")).expect("a file");
    // 300 dots per inch.
    assert_eq!(image[16..24], [[0, 0], 3300_u16.to_be_bytes(), [0, 0], 2550_u16.to_be_bytes()].concat()[..]);
}

#[test]
fn a_title_that_cannot_be_drawn_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = "x".repeat(81);
    let cases = [
        (["--title", "板凳龙"], "'板' cannot be drawn"),
        (["--title", &long], "must have 1 to 80 letters"),
        (["--title", " "], "must have 1 to 80 letters"),
        (["--paper", "a9"], "must be one of a0, a1, a2, a3, a4, letter, tabloid"),
    ];
    for (option, told) in cases {
        let args = [&["contact", "--figure", "contact.svg"], &option[..]].concat();
        let Ended { stdout, stderr, status } = solve(&args, folder.path());
        assert_eq!((status.code(), stdout.as_str()), (Some(2), ""), "{option:?}: {stderr}");
        assert!(stderr.contains(told), "{stderr:?}");
    }
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
}
