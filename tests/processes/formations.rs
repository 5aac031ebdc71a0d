//! Several dragons in a configuration: what the planner answers about them, and what is refused.

use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

/// Two straight dragons: `gold` walks along the x axis, `silver` up the line x = 10, from 20 m below.
const CROSSING: &str = r#"
[[dragons]]
name = "gold"
benches = 4
[dragons.route]
kind = "path"
segments = [{ kind = "line", length_m = 40.0 }]

[[dragons]]
name = "silver"
benches = 3
[dragons.route]
kind = "path"
start_x_m = 10.0
start_y_m = -20.0
start_heading_deg = 90.0
segments = [{ kind = "line", length_m = 40.0 }]
[dragons.head]
speed_mps = 2.0
start_s = 2.0
"#;

/// Runs a subcommand that needs no instance with the configuration of the stage.
fn run(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[args, &["--config", "two.toml"]].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

fn solve(stage: &Stage, args: &[&str]) -> Value {
    run(stage, &[&["solve"], args, &["--format", "json"]].concat()).expect_clean().last_json()
}

fn stage_with(text: &str) -> Stage {
    let stage = Stage::new();
    std::fs::write(stage.path("two.toml"), text).expect("the folder is writable");
    stage
}

#[test]
fn the_first_contact_of_two_dragons_names_both_and_the_indices_within_them() {
    let stage = stage_with(CROSSING);
    let contact = solve(&stage, &["contact"]);
    // Gold's front edge reaches silver's lane at 10 − 0.15 − 0.275 m; silver's reaches gold's lane at 20 − 0.425 m, 2 m/s from 2 s.
    let silver_s = 2.0 + (20.0 - 0.425) / 2.0;
    assert!((contact["time_s"].as_f64().expect("a time") - silver_s).abs() < 1e-9, "{contact}");
    assert_eq!(contact["dragons"], json!(["gold", "silver"]));
    assert_eq!(contact["benches"], json!([0, 0]));
    let later = CROSSING.replace("start_s = 2.0", "start_s = 60.0");
    let apart = solve(&stage_with(&later), &["contact"]);
    assert_eq!(apart["time_s"], Value::Null, "{apart}");
    let text = run(&stage, &["solve", "contact"]).expect_clean();
    assert!(text.stdout.contains("gold bench 0 and silver bench 0"), "{}", text.stdout);
}

#[test]
fn of_dragons_that_overlap_at_the_start_the_deepest_pair_is_found_whatever_the_work() {
    // Two dragons beside each other, whose boards overlap by a centimetre, and one of which stands in itself by more.
    let text = "[[dragons]]\nname = \"a\"\nbenches = 2\n[dragons.route]\nkind = \"path\"\n\
        segments = [{ kind = \"line\", length_m = 40 }]\n[[dragons]]\nname = \"b\"\nbenches = 2\n[dragons.route]\n\
        kind = \"path\"\nstart_y_m = 0.29\nsegments = [{ kind = \"line\", length_m = 40 }]\n[[dragons]]\nname = \"c\"\n\
        benches = 2\n[dragons.route]\nkind = \"path\"\nstart_y_m = 0.39\nsegments = [{ kind = \"line\", length_m = 40 }]\n";
    let stage = stage_with(text);
    for work in [&[][..], &["--work", "1"]] {
        let contact = solve(&stage, &[&["contact"], work].concat());
        assert_eq!((&contact["time_s"], &contact["dragons"]), (&json!(0.0), &json!(["b", "c"])), "{contact}");
    }
    for command in ["serve", "show"] {
        let refused = run(&stage, &[command]);
        assert_eq!(refused.code(), Some(2), "{}", refused.stderr);
        let complaint =
            "[[dragons]] b and c stand in each other at the start, benches 0 and 0: begin a route elsewhere";
        assert!(refused.stderr.contains(complaint), "{}", refused.stderr);
        assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
    }
}

#[test]
fn a_dragon_that_stops_before_the_end_of_its_route_is_named() {
    let bend = "segments = [{ kind = \"line\", length_m = 5.0 }, { kind = \"arc\", radius_m = 0.5, turn_deg = 350 }]";
    let stage = stage_with(&CROSSING.replacen("segments = [{ kind = \"line\", length_m = 40.0 }]", bend, 1));
    let contact = solve(&stage, &["contact"]);
    let stopped = &contact["stopped"][0];
    assert_eq!((stopped["dragon"].as_str(), contact["stopped"].as_array().map(Vec::len)), (Some("gold"), Some(1)));
    assert!(stopped["because"].as_str().is_some_and(|because| because.contains("cannot follow")), "{contact}");
    let text = run(&stage, &["solve", "contact"]).expect_clean();
    assert!(text.stdout.contains("gold stops at ") && text.stdout.contains("bench 0 cannot follow"), "{}", text.stdout);
}

#[test]
fn poses_have_the_name_of_their_dragon_and_the_index_within_it() {
    let stage = stage_with(CROSSING);
    let poses = solve(&stage, &["poses", "--at", "1,7"]);
    let handles = |pose: usize| poses["poses"][pose]["handles"].as_array().expect("handles").clone();
    assert_eq!((handles(0).len(), handles(1).len()), (5 + 4, 5 + 4));
    let first_of_silver = |pose: usize| handles(pose)[5].clone();
    assert_eq!((&first_of_silver(0)["dragon"], &first_of_silver(0)["index"]), (&json!("silver"), &json!(0)));
    // Before it leaves, silver stands at its beginning.
    assert_eq!((&first_of_silver(0)["y_m"], &first_of_silver(0)["speed_mps"]), (&json!(-20.0), &json!(0.0)));
    assert!((first_of_silver(1)["y_m"].as_f64().expect("a number") + 10.0).abs() < 1e-9);
    assert!((first_of_silver(1)["speed_mps"].as_f64().expect("a number") - 2.0).abs() < 1e-12);
    let csv = run(&stage, &["solve", "poses", "--at", "1", "--format", "csv"]).expect_clean();
    assert!(csv.stdout.starts_with("time_s,dragon,handle,x_m,y_m,speed_mps"), "{}", csv.stdout);
}

#[test]
fn a_figure_has_every_dragon_by_its_name_and_colour() {
    let stage = stage_with(&CROSSING.replace("name = \"gold\"", "name = \"gold\"\ncolour = \"#c8a04a\""));
    for question in [&["contact"][..], &["poses", "--at", "5"]] {
        run(&stage, &[&["solve"], question, &["--figure", "two.svg"]].concat()).expect_clean();
        let svg = std::fs::read_to_string(stage.path("two.svg")).expect("the figure is written");
        assert!(svg.contains("gold bench 3") && svg.contains("silver bench 2") && svg.contains("#c8a04a"), "{svg}");
    }
    let apart = stage_with(&CROSSING.replace("start_s = 2.0", "start_s = 60.0"));
    let ended = run(&apart, &["solve", "contact", "--figure", "two.svg"]);
    assert_eq!(ended.code(), Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("--figure has nothing to show: no contact is found"), "{}", ended.stderr);
}

#[test]
fn route_and_speed_limit_answer_for_each_dragon() {
    let stage = stage_with(CROSSING);
    let routes = solve(&stage, &["route", "--figure", "routes.svg", "--save-config", "saved.toml"]);
    let names: Vec<&Value> =
        routes["dragons"].as_array().expect("a list").iter().map(|route| &route["dragon"]).collect();
    assert_eq!(names, ["gold", "silver"]);
    let silver = &routes["dragons"][1];
    // Plan time: silver leaves at 2 s, and walks 40 m at 2 m/s.
    assert_eq!(
        (&silver["length_m"], &silver["run_end_s"], &silver["end_m"][1]),
        (&json!(40.0), &json!(22.0), &json!(20.0))
    );
    assert!(std::fs::read_to_string(stage.path("routes.svg")).expect("a figure").contains("silver bench 2"));
    let saved = std::fs::read_to_string(stage.path("saved.toml")).expect("a configuration");
    assert_eq!(solve(&stage_with(&saved), &["contact"]), solve(&stage, &["contact"]));
    let text = run(&stage, &["solve", "route"]).expect_clean().stdout;
    assert!(text.contains("dragon           gold\n") && text.contains("dragon           silver\n"), "{text}");

    let limits = solve(&stage, &["speed-limit", "--limit", "1.5"]);
    let silver = &limits["dragons"][1];
    assert_eq!(
        (&silver["dragon"], &silver["head_speed_mps"], &silver["planned_speed_mps"]),
        (&json!("silver"), &json!(1.5), &json!(2.0))
    );
    let text = run(&stage, &["solve", "speed-limit", "--limit", "1.5"]).expect_clean().stdout;
    assert!(text.contains("gold: the head may walk at 1.500000 m/s, planned are 1 m/s, within the limit"), "{text}");
    assert!(text.contains("silver: the head may walk at 1.500000 m/s, planned are 2 m/s, too fast"), "{text}");
}

#[test]
fn sensitivity_is_that_of_the_contact_between_two_dragons() {
    // Silver comes at an angle, so that one corner touches gold.
    let slanted = CROSSING.replace("start_heading_deg = 90.0", "start_heading_deg = 100.0");
    let stage = stage_with(&slanted);
    let found = solve(&stage, &["sensitivity"]);
    assert_eq!((&found["dragons"], &found["benches"]), (&json!(["gold", "silver"]), &json!([2, 0])));
    let rate = |dragon: &str, parameter: &str| {
        let rows = found["parameters"].as_array().expect("a list");
        let row = rows.iter().find(|row| row["dragon"] == dragon && row["parameter"] == parameter);
        row.expect("a row")["derivative"].as_f64().expect("a number")
    };
    // If both leave later, the contact is as much later.
    assert!((rate("gold", "start_s") + rate("silver", "start_s") - 1.0).abs() < 1e-9, "{found}");
    let moved = |start_s: &str| {
        let stage = stage_with(&slanted.replace("start_s = 2.0", start_s));
        solve(&stage, &["contact"])["time_s"].as_f64().expect("a time")
    };
    let expected = (moved("start_s = 2.001") - moved("start_s = 1.999")) / 0.002;
    assert!((rate("silver", "start_s") - expected).abs() < 1e-5, "{found}");
    let text = run(&stage, &["solve", "sensitivity"]).expect_clean().stdout;
    assert!(text.contains("gold bench 2 and silver bench 0") && text.contains("hole_offset_m"), "{text}");
    let apart = stage_with(&CROSSING.replace("start_s = 2.0", "start_s = 60.0"));
    assert_eq!(solve(&apart, &["sensitivity"])["time_s"], Value::Null);
    for flags in
        [&["sensitivity", "--parameter", "width"][..], &["speed-limit", "--limit", "2", "--save-config", "x.toml"]]
    {
        let ended = run(&stage, &[&["solve"], flags].concat());
        assert_eq!(ended.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains("is for one dragon, the configuration has 2"), "{}", ended.stderr);
    }
}

#[test]
fn bad_dragons_and_commands_for_one_dragon_get_one_line() {
    for (text, line) in [
        (CROSSING.replace("\"silver\"", "\"gold\""), "[[dragons]] name is \"gold\" twice, must be unique"),
        (
            CROSSING.replace("\"silver\"", "\"Silver!\""),
            "[[dragons]] name of number 2 is \"Silver!\", must be 1 to 24 of a–z, 0–9 and -",
        ),
        (CROSSING.replace("name = \"silver\"\n", ""), "[[dragons]] name of number 2 is missing"),
        (CROSSING.replace("benches = 3", "benches = 0"), "dragon silver: [dragon] benches is 0"),
        (
            CROSSING.replace("benches = 3", "bench = 3"),
            "line 11, `bench = 3`: unknown field `bench`, expected one of `benches`, ",
        ),
        (
            CROSSING.replace("benches = 3", "benches = \"three\""),
            "line 11, `benches = \"three\"`: invalid type: string \"three\", expected a whole number",
        ),
        (
            CROSSING.replace("start_y_m = -20.0", "start_z_m = -20.0"),
            "line 15, `start_z_m = -20.0`: unknown field `start_z_m`",
        ),
        (
            CROSSING.replace("start_s = 2.0", "start_s = \"soon\""),
            "line 20, `start_s = \"soon\"`: invalid type: string \"soon\", expected a number",
        ),
        (CROSSING.replace("speed_mps = 2.0", "pace = 2.0"), "line 19, `pace = 2.0`: unknown field `pace`"),
        (
            CROSSING.replace("benches = 3", "colour = \"red\""),
            "dragon silver: colour is \"red\", must be as \"#c8a04a\"",
        ),
        (CROSSING.replace("start_s = 2.0", "start_s = -2.0"), "dragon silver: [head] start_s is -2, must be from 0"),
        (CROSSING.replace("benches = 3", "pole_diameter_m = 0.05"), "dragon silver: [dragon] pole_diameter_m"),
        (
            format!("[dragon]\nbenches = 7\n{CROSSING}"),
            "[dragon] and [[dragons]] exclude each other: put its keys into each entry",
        ),
        (format!("[head]\nspeed_mps = 2\n{CROSSING}"), "[head] and [[dragons]] exclude each other: use [dragons.head]"),
        ("dragons = []\n".to_owned(), "[[dragons]] occurs 0 times, must occur 1 to 32 times"),
        (
            format!("{CROSSING}[stage]\noutline = [[0, 0], [9, 0]]\n"),
            "[stage] outline has 2 points, must have from 3 to 256",
        ),
        (
            CROSSING.replace("benches = 4", "benches = 60000").replace("benches = 3", "benches = 60000"),
            "[[dragons]] have 120000 benches together, at most 100000 are allowed",
        ),
    ] {
        let ended = run(&stage_with(&text), &["solve", "contact"]);
        assert_eq!((ended.code(), &*ended.stdout), (Some(2), ""), "{}", ended.stderr);
        assert!(ended.stderr.contains(line) && ended.stderr.lines().count() == 1, "{line}: {}", ended.stderr);
    }
    let stage = stage_with(CROSSING);
    for args in [&["solve", "pitch"], &["solve", "turn"]] {
        let ended = run(&stage, args);
        assert_eq!(ended.code(), Some(2), "{args:?}: {}", ended.stderr);
        assert!(
            ended.stderr.contains("[[dragons]] is present (gold, silver), only one dragon is allowed here"),
            "{}",
            ended.stderr
        );
    }
    let profile = run(&stage, &["solve", "contact", "--profile"]);
    assert!(profile.stderr.contains("--profile is for one dragon, the configuration has 2"), "{}", profile.stderr);
}
