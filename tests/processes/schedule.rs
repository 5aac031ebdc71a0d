//! `solve schedule`: crossings, starts, figures and saved configurations of several dragons, and what is refused.

use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

/// `gold` walks along the x axis, `silver` up the line x = 10: both get to the crossing at the same time.
const CROSSING: &str = r#"
[[dragons]]
name = "gold"
benches = 4
[dragons.route]
kind = "path"
segments = [{ kind = "line", length_m = 40.0 }]

[[dragons]]
name = "silver"
benches = 4
[dragons.route]
kind = "path"
start_x_m = 10.0
start_y_m = -10.0
start_heading_deg = 90.0
segments = [{ kind = "line", length_m = 40.0 }]
"#;

/// Length of the links of such a dragon, and what its front and its half width add on either side of a crossing.
const PASSING_M: f64 = (3.41 - 0.55) + 3.0 * (2.20 - 0.55) + 2.0 * (0.275 + 0.15);

fn stage_with(text: &str) -> Stage {
    let stage = Stage::new();
    std::fs::write(stage.path("plan.toml"), text).expect("the folder is writable");
    stage
}

fn run(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[&["solve", "schedule", "--config", "plan.toml"], args].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

fn schedule(stage: &Stage, args: &[&str]) -> Value {
    run(stage, &[args, &["--format", "json"]].concat()).expect_clean().last_json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is a number"))
}

#[test]
fn a_plan_is_surveyed_as_it_is_without_a_clearance() {
    let met = schedule(&stage_with(CROSSING), &[]);
    assert_eq!((&met["starts_s"], &met["order"]), (&json!({"gold": 0.0, "silver": 0.0}), &Value::Null));
    let crossing = &met["crossings"][0];
    assert_eq!((&crossing["dragons"], &crossing["first"]), (&json!(["gold", "silver"]), &Value::Null));
    assert!((number(&crossing["slack_s"]) + PASSING_M).abs() < 2e-3, "{crossing}");
    assert_eq!((&met["dragons"][1]["meets"], &met["dragons"][1]["earlier_s"]), (&json!(true), &Value::Null));
    // Silver leaves ten seconds after gold has passed.
    let later = CROSSING.to_owned() + &format!("[dragons.head]\nstart_s = {}\n", PASSING_M + 10.0);
    let passed = schedule(&stage_with(&later), &[]);
    let crossing = &passed["crossings"][0];
    assert_eq!(crossing["first"], "gold");
    assert!((number(&crossing["slack_s"]) - 10.0).abs() < 2e-3, "{crossing}");
    // Gold's tail leaves silver's lane, and silver's front gets to gold's.
    let passes_s = 10.0 - 0.425 + PASSING_M;
    assert!((number(&crossing["passes_s"]) - passes_s).abs() < 2e-3, "{crossing}");
    assert!((number(&crossing["arrives_s"]) - passes_s - 10.0).abs() < 2e-3, "{crossing}");
    let silver = &passed["dragons"][1];
    assert!((number(&silver["earlier_s"]) - 10.0).abs() < 2e-3 && silver["later_s"] == Value::Null, "{silver}");
    assert!((number(&passed["dragons"][0]["later_s"]) - 10.0).abs() < 2e-3, "{passed}");
}

#[test]
fn dragons_are_delayed_until_they_keep_the_clearance() {
    let stage = stage_with(CROSSING);
    let found = schedule(&stage, &["--clearance", "0.5", "--save-config", "saved.toml"]);
    assert_eq!((&found["order"], &found["clearance_m"]), (&json!(["gold", "silver"]), &json!(0.5)));
    let start_s = number(&found["starts_s"]["silver"]);
    // Gold's tail passes silver's front at a distance of 0.5 m.
    assert!((PASSING_M..PASSING_M + 1.0).contains(&start_s), "{found}");
    let least_m = number(&found["least_clearance_m"]);
    assert!((0.5..0.502).contains(&least_m), "{found}");
    assert_eq!(number(&found["dragons"][1]["delay_s"]), start_s);
    // The saved configuration has the starts, and needs no further delay.
    let saved = std::fs::read_to_string(stage.path("saved.toml")).expect("a file");
    let again = stage_with(&saved);
    let kept = schedule(&again, &["--clearance", "0.5"]);
    assert_eq!((&kept["starts_s"], number(&kept["dragons"][1]["delay_s"])), (&found["starts_s"], 0.0));
    let mut contact =
        program(&["solve", "contact", "--clearance", "0.499", "--format", "json", "--config", "plan.toml"]);
    contact.current_dir(again.path(""));
    assert_eq!(Process::start(contact).end().expect_clean().last_json()["time_s"], Value::Null);
    let text = run(&stage, &["--clearance", "0.5"]).expect_clean().stdout;
    assert!(text.contains("any two dragons stay over 0.5 m apart, which is proved"), "{text}");
}

#[test]
fn a_dragon_that_ends_on_the_way_of_another_one_needs_another_order() {
    // Gold ends on silver's lane.
    let stage = stage_with(&CROSSING.replacen("length_m = 40.0", "length_m = 10.0", 1));
    let listed = schedule(&stage, &["--clearance", "0.5"]);
    let reason = listed["impossible"].as_str().expect("a reason");
    assert!(reason.starts_with("no schedule in this order: silver has to leave at least "), "{reason}");
    assert!(reason.ends_with("change the order of the list, or use --order"), "{reason}");
    assert_eq!((&listed["starts_s"], &listed["crossings"]), (&Value::Null, &json!([])));
    let free = schedule(&stage, &["--clearance", "0.5", "--order"]);
    assert_eq!((&free["order"], &free["starts_s"]["silver"]), (&json!(["silver", "gold"]), &json!(0.0)));
    let saved = run(&stage, &["--clearance", "0.5", "--save-config", "saved.toml"]);
    assert_eq!(saved.code(), Some(1), "{}", saved.stderr);
    assert!(saved.stderr.contains("--save-config has nothing to save: no schedule in this order"), "{}", saved.stderr);
}

#[test]
fn dragons_that_wait_for_each_other_in_a_circle_get_one_line() {
    // Each head is just before the body of the next dragon, around a triangle with sides of 4 m.
    let corner = |k: u32| (f64::from(k) * 120.0).to_radians().sin_cos();
    let dragons: Vec<String> = (0..3)
        .map(|k| {
            let [(y0, x0), (y1, x1)] = [corner(k), corner(k + 1)];
            let radius_m = 4.0 / 3.0_f64.sqrt();
            let along = (y1 - y0).atan2(x1 - x0);
            let (x, y) = (radius_m * x1 - 1.2 * along.cos(), radius_m * y1 - 1.2 * along.sin());
            let heading_deg = along.to_degrees();
            format!(
                "[[dragons]]\nname = \"d{k}\"\nbenches = 3\n[dragons.route]\nkind = \"path\"\nstart_x_m = {x:?}\n\
                 start_y_m = {y:?}\nstart_heading_deg = {heading_deg:?}\n\
                 segments = [{{ kind = \"line\", length_m = 40 }}]\n"
            )
        })
        .collect();
    let stage = stage_with(&dragons.concat());
    for order in [&[][..], &["--order"]] {
        let text = run(&stage, &[&["--clearance", "0"], order].concat()).expect_clean().stdout;
        assert!(
            text.starts_with("no schedule: dragons wait for each other in a circle, each has to leave before"),
            "{text}"
        );
        assert_eq!(text.lines().count(), 1, "{text}");
    }
}

#[test]
fn figures_show_all_dragons_over_time_or_two_over_each_other() {
    let stage = stage_with(CROSSING);
    let svg = |args: &[&str]| {
        run(&stage, &[&["--clearance", "0.5", "--figure", "drawn.svg"], args].concat()).expect_clean();
        std::fs::read_to_string(stage.path("drawn.svg")).expect("the figure is written")
    };
    let chart = svg(&[]);
    assert!(
        ["gold", "silver", "plan time (s)", "has passed", "gold and silver"].iter().all(|name| chart.contains(name))
    );
    let diagram = svg(&["--pair", "silver,gold"]);
    assert!(
        ["travel of silver (m)", "travel of gold (m)", "forbidden", "plan"].iter().all(|name| diagram.contains(name))
    );
}

#[test]
fn bad_input_gets_one_line() {
    let stage = stage_with(CROSSING);
    for (args, line) in [
        (&["--order"][..], "--clearance <METRES>"),
        (&["--clearance", "-1"], "--clearance"),
        (&["--figure", "drawn.svg", "--pair", "gold"], "--pair is gold, must be two of gold, silver"),
        (&["--figure", "drawn.svg", "--pair", "gold,gold"], "--pair is gold,gold, must be two of gold, silver"),
        (&["--figure", "drawn.svg", "--pair", "gold,jade"], "--pair is gold,jade, must be two of gold, silver"),
        (&["--pair", "gold,silver"], "--figure <FILE>"),
    ] {
        let ended = run(&stage, args);
        assert_eq!((ended.code(), &*ended.stdout), (Some(2), ""), "{args:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(line) && ended.stderr.lines().count() == 1, "{line}: {}", ended.stderr);
    }
    let one = run(&stage_with("[dragon]\nbenches = 3\n"), &[]);
    assert_eq!(one.code(), Some(2), "{}", one.stderr);
    assert!(one.stderr.contains("must have 2 or more for solve schedule"), "{}", one.stderr);
    let little = schedule(&stage_with(&CROSSING.replace("benches = 4", "benches = 3000")), &["--work", "1"]);
    assert!(little["undecided"].as_str().is_some_and(|reason| reason.contains("gold and silver")), "{little}");
}

#[test]
fn the_starts_of_the_square_are_those_of_the_program() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/square.toml");
    let text = std::fs::read_to_string(example).expect("the example");
    let unscheduled: String =
        text.lines().filter(|line| !line.starts_with("start_s")).map(|line| line.to_owned() + "\n").collect();
    let found = schedule(&stage_with(&unscheduled), &["--clearance", "0.5"]);
    let planned = schedule(&stage_with(&text), &[]);
    assert_eq!(found["starts_s"], planned["starts_s"]);
    assert!(number(&found["least_clearance_m"]) > 0.5, "{found}");
    assert_eq!(found["crossings"].as_array().map(Vec::len), Some(40));
}
