//! Fixes: changes that take a problem of a plan away.

use bench_dragon_geometry::dragon::{Meter, Question};
use serde_json::{Value, json};

use super::{config, folder};
use crate::display::planner::edit::Edit;
use crate::display::planner::fix::fixes;
use crate::display::planner::plan::{Plan, Touch};

/// Two dragons that cross each other's way at the same time.
const CROSSING: &str = "# two streets
[[dragons]]
name = 'gold' # leads
benches = 8
[dragons.route]
kind = 'path'
start_x_m = -30.0
segments = [{ kind = 'line', length_m = 60 }]
[[dragons]]
name = 'silver'
benches = 8
[dragons.route]
kind = 'path'
start_y_m = -30.0
start_heading_deg = 90.0
segments = [{ kind = 'line', length_m = 60 }]
";

fn fixed(text: &str) -> Vec<(String, Plan)> {
    let plan = Plan { text: text.to_owned(), config: config(text) };
    let touch = plan.touch(plan.times_s(), &Meter::of(1_000_000_000));
    let fixes = fixes(&plan, &folder(), touch, &Question::default());
    let after = |fix: &Value| {
        let edit: Edit = serde_json::from_value(json!({ "kind": "put", "puts": fix["puts"] })).expect("an edit");
        let text = edit.apply(text, &plan.config).expect("the text has this place");
        (fix["words"].as_str().expect("words").to_owned(), Plan { config: config(&text), text })
    };
    fixes.iter().map(after).collect()
}

#[test]
fn each_fix_takes_its_problem_away_and_keeps_every_comment() {
    let spiral = "[route] # ours\nkind = \"spiral\"\npitch_m = 0.5 # narrow\nend_s = 360\n";
    let found = fixed(spiral);
    assert!(found[0].0.starts_with("pitch 0.5") && found[1].0.starts_with("end at "), "{found:?}");
    let crossing = fixed(CROSSING);
    let [(words, later)] = &crossing[..] else { panic!("{crossing:?}") };
    assert!(words.starts_with("start ") && words.ends_with(" s later"), "{words}");
    assert!(later.text.contains("# two streets") && later.text.contains("'gold' # leads"), "{}", later.text);
    for (words, plan) in found.iter().chain(&crossing) {
        let touch = plan.touch(plan.times_s(), &Meter::of(1_000_000_000));
        assert!(matches!(touch, Touch::Free { to_s } if to_s >= plan.times_s()[1]), "{words}: {touch:?}");
    }
    let tight = "[dragon]\nbenches = 8\n[route]\nkind = 'path'\nsegments = [{ kind = 'line', length_m = 20 }, \
                 { kind = 'arc', radius_m = 0.6, turn_deg = 180 }, # round\n{ kind = 'line', length_m = 20 }]\n";
    let bend = fixed(tight);
    let (words, plan) = bend.last().unwrap_or_else(|| panic!("so tight a bend stops the dragon"));
    assert!(words.starts_with("radius ") && plan.text.contains("# round"), "{words}\n{}", plan.text);
    assert!(plan.planned()[0].dragon.tight_spot().is_none(), "{words}");
}
