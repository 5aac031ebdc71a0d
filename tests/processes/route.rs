//! Surveys of routes, and boards that leave the stage.

use std::fs;

use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

/// A figure of eight whose straights cross in the middle.
const EIGHT: &str = "[dragon]\nbenches = 20\n[route]\nkind = \"path\"\nclosed = true\nlaps = 2\nsegments = [
    { kind = \"line\", length_m = 40 }, { kind = \"arc\", radius_m = 20, turn_deg = 270 },
    { kind = \"line\", length_m = 40 }, { kind = \"arc\", radius_m = 20, turn_deg = -270 },\n]\n";

/// A path with a bend in which handle 1 stops.
const TIGHT: &str = "[dragon]\nbenches = 20\n[route]\nkind = \"path\"\nsegments = [
    { kind = \"line\", length_m = 20 }, { kind = \"arc\", radius_m = 1.2, turn_deg = 170 },
    { kind = \"line\", length_m = 20 },\n]\n";

/// A closed path with a bend before its beginning in which the dragon cannot stand.
const TOO_TIGHT: &str = "[dragon]\nbenches = 20\n[route]\nkind = \"path\"\nclosed = true\nsegments = [
    { kind = \"line\", length_m = 20 }, { kind = \"arc\", radius_m = 1.2, turn_deg = 180 },
    { kind = \"line\", length_m = 20 }, { kind = \"arc\", radius_m = 1.2, turn_deg = 180 },\n]\n";

/// The right side cuts through a loop of the eight.
const STAGE: &str = "[stage]\noutline = [[-25, -45], [50, -45], [50, 45], [-25, 45]]\n";

fn solve(stage: &Stage, text: &str, args: &[&str]) -> Ended {
    let file = stage.path("route.toml");
    fs::write(&file, text).expect("a file");
    let config = ["--config", file.to_str().expect("UTF-8")];
    Process::start(program(&[&["solve"], args, &config[..]].concat())).end()
}

fn answer(text: &str, question: &str) -> Value {
    solve(&Stage::new(), text, &[question, "--format", "json"]).expect_clean().last_json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn is_near(value: &Value, expected: &[f64]) -> bool {
    let values: Vec<f64> = value.as_array().expect("a point").iter().map(number).collect();
    values.len() == expected.len() && values.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-6)
}

#[test]
fn a_survey_has_the_named_keys() {
    let spiral = answer("", "route");
    let keys: Vec<&String> = spiral.as_object().expect("an object").keys().collect();
    let expected = [
        "cannot_follow",
        "crossing_points",
        "crossings",
        "drawing_size_m",
        "end_heading_deg",
        "end_m",
        "ends_because",
        "fit_error_m",
        "infeasible",
        "length_m",
        "run_end_m",
        "run_end_point_m",
        "run_end_s",
        "segments",
        "tightest_m",
        "tightest_radius_m",
        "tightest_travel_m",
    ];
    assert_eq!(keys, expected);
    assert_eq!(
        (&spiral["segments"], &spiral["crossings"], &spiral["fit_error_m"]),
        (&json!(1), &json!(0), &json!(null))
    );
    assert!((number(&spiral["length_m"]) - 442.590_256).abs() < 1e-6, "{spiral}");
    assert_eq!(spiral["ends_because"], "handle 1 would stop and walk backwards");
    assert_eq!(spiral["cannot_follow"]["travel_m"], spiral["run_end_m"], "the head's bench is the first");
}

#[test]
fn the_eight_crosses_itself_once() {
    let eight = answer(EIGHT, "route");
    let arc_m = 20.0 * 1.5 * std::f64::consts::PI;
    assert!((number(&eight["length_m"]) - 2.0 * (80.0 + 2.0 * arc_m)).abs() < 1e-9, "{eight}");
    assert_eq!(
        (&eight["crossings"], &eight["segments"], &eight["ends_because"]),
        (&json!(1), &json!(4), &json!("the route ends"))
    );
    let crossing = &eight["crossing_points"][0];
    assert!(
        is_near(&crossing["point_m"], &[20.0, 0.0]) && is_near(&crossing["travels_m"], &[20.0, 60.0 + arc_m]),
        "{eight}"
    );
    assert!(is_near(&eight["end_m"], &[0.0, 0.0]) && number(&eight["end_heading_deg"]).abs() < 1e-9, "{eight}");
    assert_eq!((&eight["tightest_radius_m"], &eight["cannot_follow"]), (&json!(20.0), &Value::Null));
}

#[test]
fn a_bend_that_is_too_tight_is_named_by_metres_and_point() {
    let stage = Stage::new();
    let tight = answer(TIGHT, "route");
    assert_eq!(tight["ends_because"], "handle 1 would stop and walk backwards");
    let place = &tight["cannot_follow"];
    assert_eq!((&place["bench"], &place["travel_m"]), (&json!(0), &tight["run_end_m"]));
    assert!(number(&place["travel_m"]) > 20.0 && number(&place["travel_m"]) < 20.0 + 1.2 * 3.0, "{tight}");
    assert_eq!(place["point_m"], tight["run_end_point_m"]);
    let text = solve(&stage, TIGHT, &["route"]).expect_clean().stdout;
    assert!(text.contains("cannot follow    bench 0, at 22.854529 m of travel, at (20.829154, 2.067470) m"), "{text}");
    let contact = solve(&stage, TIGHT, &["contact"]).expect_clean().stdout;
    let place = "bench 0 cannot follow at 22.855 m of travel, at (20.829, 2.067) m";
    assert!(contact.contains(&format!("where handle 1 would stop and walk backwards: {place}")), "{contact}");
    let served = stage.run(&["serve", "--config", "route.toml", "--start-at", "22", "--until", "22.1", "--rate", "50"]);
    assert!(
        served.stderr.contains(&format!(
            "the run ends at 22.854529 s, before the route ends: there handle 1 would stop and walk backwards: {place}"
        )),
        "{}",
        served.stderr
    );
}

#[test]
fn a_route_on_which_the_dragon_cannot_stand_is_surveyed_too() {
    let stage = Stage::new();
    let survey = answer(TOO_TIGHT, "route");
    assert!((number(&survey["length_m"]) - (40.0 + 1.2 * std::f64::consts::TAU)).abs() < 1e-9, "{survey}");
    let reason = "the route is too tight at its start: bench 0 cannot follow at 0.000 m of travel, at (0.000, 0.000) m: \
                  handle 1 cannot stand and walk 2.860 m behind handle 0";
    assert_eq!((&survey["infeasible"], &survey["run_end_m"]), (&json!(reason), &Value::Null));
    assert!(is_near(&survey["cannot_follow"]["point_m"], &[0.0, 0.0]), "{survey}");
    let refused = solve(&stage, TOO_TIGHT, &["contact"]);
    assert_eq!(refused.code(), Some(2));
    assert!(refused.stderr.contains(reason), "{}", refused.stderr);
    let figure = stage.path("tight.svg");
    let drawn = solve(&stage, TOO_TIGHT, &["route", "--figure", figure.to_str().expect("UTF-8")]).expect_clean();
    assert!(
        drawn.stdout.contains("drawn to")
            && fs::read_to_string(&figure).expect("a figure").contains("a bench cannot follow")
    );
    let unsaved = solve(&stage, TOO_TIGHT, &["route", "--save-config", stage.path("no.toml").to_str().expect("UTF-8")]);
    assert_eq!(unsaved.code(), Some(1));
    assert!(unsaved.stderr.contains("--save-config has nothing to save: the route is too tight"), "{}", unsaved.stderr);
}

#[test]
fn an_invalid_route_is_an_error_in_one_line() {
    let open = solve(
        &Stage::new(),
        "[route]\nkind = \"path\"\nclosed = true\nsegments = [{ kind = \"line\", length_m = 3 }]\n",
        &["route"],
    );
    assert_eq!((open.code(), open.stderr.lines().count()), (Some(2), 1), "{}", open.stderr);
    assert!(open.stderr.contains("[route] closed: the end is 3.000000 m from the beginning"), "{}", open.stderr);
}

#[test]
fn a_fault_beside_the_route_is_an_error_in_one_line() {
    let stage = Stage::new();
    for (text, expected) in [
        ("[[cues]]\nname = \"a\"\nat_s = 9999\n", "[[cues]] \"a\": at_s is 9999, must be"),
        (
            "[[cues]]\nname = \"a\"\nat_s = 1\n[[cues]]\nname = \"a\"\nat_s = 2\n",
            "[[cues]] \"a\": the name occurs twice",
        ),
    ] {
        let failed = solve(&stage, &format!("{EIGHT}{text}"), &["route"]);
        assert_eq!((failed.code(), failed.stderr.lines().count()), (Some(2), 1), "{}", failed.stderr);
        assert!(failed.stderr.contains(expected), "{}", failed.stderr);
    }
}

#[test]
fn a_saved_configuration_gives_the_same_survey() {
    let stage = Stage::new();
    let file = stage.path("saved.toml").display().to_string();
    let text = format!("{EIGHT}{STAGE}");
    let first = solve(&stage, &text, &["route", "--format", "json", "--save-config", &file]).expect_clean().last_json();
    let saved = fs::read_to_string(&file).expect("a configuration");
    assert!(saved.contains("[stage]") && saved.contains("[[route.segments]]"), "{saved}");
    assert_eq!(solve(&stage, &saved, &["route", "--format", "json"]).expect_clean().last_json(), first);
}

#[test]
fn the_first_board_that_leaves_the_stage_is_reported() {
    let text = format!("{EIGHT}{STAGE}");
    let (route, contact) = (answer(&text, "route"), answer(&text, "contact"));
    let leaving = &route["leaves_stage"];
    assert_eq!((leaving, &leaving["bench"]), (&contact["leaves_stage"], &json!(0)));
    assert!((number(&leaving["point_m"][0]) - 50.0).abs() < 1e-6, "{leaving}");
    let wide = format!("{EIGHT}[stage]\noutline = [[-25, -45], [65, -45], [65, 45], [-25, 45]]\n");
    assert_eq!(answer(&wide, "route").get("leaves_stage"), Some(&Value::Null));
    assert_eq!(answer(EIGHT, "contact").get("leaves_stage"), None);
    let stage = Stage::new();
    let texts = ["route", "contact"].map(|question| solve(&stage, &wide, &[question]).expect_clean().stdout);
    assert!(texts[0].ends_with("stage            no board leaves it\n"), "{}", texts[0]);
    assert!(texts[1].ends_with("stage: no board leaves it\n"), "{}", texts[1]);
}

#[test]
fn boards_that_come_onto_the_stage_stand_outside_and_do_not_leave_it() {
    let text = "[dragon]\nbenches = 10\n[head]\nspeed_mps = 2\n[route]\nkind = \"path\"\n\
                segments = [{ kind = \"line\", length_m = 60 }]\n\
                [stage]\noutline = [[-5, -5], [40, -5], [40, 5], [-5, 5]]\n";
    let route = answer(text, "route");
    assert_eq!((&route["outside_at_start"], &route["leaves_stage"]["bench"]), (&json!(8), &json!(0)), "{route}");
    assert!((number(&route["leaves_stage"]["time_s"]) - 19.8625).abs() < 1e-6, "{route}");
    let told = solve(&Stage::new(), text, &["contact"]).expect_clean().stdout;
    assert!(told.contains(" m; 8 boards stand outside at the start\n"), "{told}");
}

#[test]
fn times_beyond_the_route_name_their_key() {
    let text = |times: &str| {
        format!(
            "[head]\nspeed_mps = 2\n[route]\nkind = \"path\"\n{times}\nsegments = [{{ kind = \"line\", length_m = 30 }}]\n"
        )
    };
    for (times, reason) in [
        ("end_s = 100", "[route] end_s is 100, must be at most 15, when the head reaches the end of the route\n"),
        ("start_s = 100", "[route] start_s is 100, must be below 15, when the head reaches the end\n"),
    ] {
        let ended = solve(&Stage::new(), &text(times), &["route"]);
        assert!(ended.code() == Some(2) && ended.stderr.ends_with(reason), "{}", ended.stderr);
    }
    // A saved answer keeps the part of the route that the head walks.
    let stage = Stage::new();
    let file = stage.path("saved.toml").display().to_string();
    solve(&stage, &text("end_s = 14"), &["speed-limit", "--limit", "3", "--save-config", &file]).expect_clean();
    let saved = fs::read_to_string(&file).expect("a configuration");
    assert!(saved.contains("speed_mps = 3.0\n") && saved.contains("end_s = 9.333"), "{saved}");
}

#[test]
fn an_output_never_replaces_the_drawing_or_another_output() {
    let stage = Stage::new();
    let drawing = "<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0 H60'/></svg>";
    fs::write(stage.path("street.svg"), drawing).expect("a file");
    let text = "[dragon]\nbenches = 3\n[route]\nkind = \"drawing\"\nfile = \"street.svg\"\nmetres_per_unit = 1\n";
    let [street, other] = ["street.svg", "other.svg"].map(|name| stage.path(name).display().to_string());
    for (args, reason) in [
        (
            vec!["route", "--figure", &street],
            "--figure is street.svg, the drawing of the route, must be another file\n",
        ),
        (
            vec!["contact", "--figure", &street],
            "--figure is street.svg, the drawing of the route, must be another file\n",
        ),
        (
            vec!["route", "--save-config", &street],
            "--save-config is street.svg, the drawing of the route, must be another",
        ),
        (vec!["route", "--save-config", &other, "--figure", &other], "the file of --figure, must be another file\n"),
    ] {
        let ended = solve(&stage, text, &args);
        assert!(ended.code() == Some(2) && ended.stdout.is_empty(), "{args:?}: {}", ended.stdout);
        assert!(ended.stderr.lines().count() == 1 && ended.stderr.contains(reason), "{}", ended.stderr);
    }
    assert_eq!(fs::read_to_string(&street).expect("the drawing"), drawing);
    // Another spelling of the same file.
    let dotted = stage.path("./other.svg").display().to_string();
    let turn = Process::start(program(&["solve", "turn", "--save-config", &dotted, "--figure", &other])).end();
    assert!(turn.code() == Some(2) && turn.stderr.contains("the file of --figure, must be another"), "{}", turn.stderr);
}

#[test]
fn the_monitor_raises_an_alert_where_a_board_leaves_the_stage() {
    let stage = Stage::new();
    let text = format!("{EIGHT}{STAGE}");
    let leaving = answer(&text, "route")["leaves_stage"].clone();
    fs::write(stage.path("eight.toml"), text).expect("a file");
    let start_s = (number(&leaving["time_s"]) - 1.0).floor().to_string();
    let pace = ["--config", "eight.toml", "--start-at", &start_s, "--rate", "100", "--readers", "1"];
    let server = stage.serve(&pace);
    let mut monitor = stage.start(&["monitor", "--format", "json"]);
    let lines = monitor.json_until("an alert of kind outside", |line| line["kind"] == "outside");
    let alert = lines.last().expect("the line that was waited for");
    let late_s = number(&alert["time_s"]) - number(&leaving["time_s"]);
    assert!(late_s.abs() < 1e-7, "{late_s} s after the instant at which the board leaves: {alert}");
    assert_eq!(alert["border"], "outline");
    assert!(number(&alert["distance_m"]) < 1e-7, "{alert}");
    assert_eq!((&alert["bench"], &alert["benches"], &alert["clearance_m"]), (&json!(0), &Value::Null, &Value::Null));
    assert!(number(&alert["point_m"][0]) >= 50.0 - 1e-6, "{alert}");
    server.stop();
    monitor.terminate().expect_clean();
}
