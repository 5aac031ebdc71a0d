//! `docs/paper.md`: its numbers are those that the commands on it print.

use std::fs;

use serde_json::Value;
use test_support::process::Process;

use crate::stage::{Stage, program};

fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/paper.md");
    fs::read_to_string(path).expect("the page about the paper exists")
}

fn solve(args: &[&str]) -> Value {
    Process::start(program(&[&["solve"], args, &["--format", "json"]].concat())).end().expect_clean().last_json()
}

/// Returns a number as the page has it: six decimals, and the typographic minus sign.
fn written(value: &Value) -> String {
    let value = value.as_f64().expect("a number");
    // A negative zero becomes 0.
    let value = if value.abs() < 5e-7 { 0.0 } else { value };
    format!("{value:.6}").replace('-', "−")
}

/// Fails unless the page has a text.
fn assert_has(page: &str, text: &str) {
    assert!(page.contains(text), "docs/paper.md has no {text}");
}

#[test]
fn the_page_has_the_poses_of_the_program() {
    let page = page();
    let answer = solve(&["poses", "--at", "0,60,120,300"]);
    for pose in answer["poses"].as_array().expect("a list") {
        for handle in [0, 1, 51, 101, 151, 201, 223] {
            let handle = &pose["handles"][handle];
            let [x, y, speed] = ["x_m", "y_m", "speed_mps"].map(|key| written(&handle[key]));
            assert_has(&page, &format!("({x}, {y}) {speed}"));
        }
    }
}

#[test]
fn the_page_has_the_contacts_of_the_program() {
    let page = page();
    let (_, narrow) = page.split_once("```toml\n").expect("the page has a configuration");
    let narrow = narrow.split("```").next().expect("a block has an end");
    let stage = Stage::new();
    let path = stage.path("narrow.toml");
    fs::write(&path, narrow).expect("the folder is writable");
    let path = path.to_str().expect("the path is UTF-8");
    for args in [&["contact"][..], &["contact", "--config", path]] {
        let answer = solve(args);
        let point = &answer["point_m"];
        assert_has(
            &page,
            &format!(
                "**{} s** | 0 and 8, at ({}, {})",
                written(&answer["time_s"]),
                written(&point[0]),
                written(&point[1])
            ),
        );
        assert_eq!(answer["benches"], serde_json::json!([0, 8]));
    }
    let profile = solve(&["contact", "--profile", "--step", "100"]);
    for miss in profile["near_misses"].as_array().expect("a list") {
        let millimetres = miss["clearance_m"].as_f64().expect("a number") * 1e3;
        let benches = format!("{} and {}", miss["benches"][0], miss["benches"][1]);
        assert_has(&page, &format!("| {} s | {millimetres:.3} mm | {benches} |", written(&miss["time_s"])));
    }
    let points = profile["profile"].as_array().expect("a list");
    let row: Vec<String> = points.iter().take(5).map(|point| written(&point["clearance_m"])).collect();
    assert_has(&page, &format!("| {} |", row.join(" | ")));
}

#[test]
fn the_page_has_the_sensitivity_of_the_program() {
    let page = page();
    let answer = solve(&["sensitivity", "--range", "5", "--steps", "1"]);
    let contact = &answer["quantities"][0];
    assert_eq!(contact["quantity"], "first_contact_s");
    for parameter in contact["parameters"].as_array().expect("a list") {
        let samples = parameter["samples"].as_array().expect("a list");
        let mut cells: Vec<String> = samples.iter().map(|sample| written(&sample["value"])).collect();
        cells.push(written(&parameter["derivative"]));
        assert_has(&page, &format!("| {} |", cells.join(" | ")));
    }
}

#[test]
fn the_page_has_the_further_answers_of_the_program() {
    let page = page();
    assert_has(&page, &format!("| {} m;", written(&solve(&["pitch", "--turn-diameter", "9"])["pitch_m"])));
    let turn = solve(&["turn"]);
    let [radii, length] = ["radii_m", "length_m"].map(|key| turn[key].clone());
    assert_has(&page, &format!("{} and {} m; {} m", written(&radii[0]), written(&radii[1]), written(&length)));
    let limit = solve(&["speed-limit", "--limit", "2"]);
    assert_has(&page, &format!("| {}, handle {} at", written(&limit["largest_ratio"]), limit["handle"]));
    assert_has(&page, &format!("| {} m/s |", written(&limit["head_speed_mps"])));
}
