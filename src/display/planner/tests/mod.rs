//! Plans of the planner as texts: edits by hand, answers to questions, and fixes.

mod answers;
mod edits;
mod fixes;
mod random_edits;

use std::path::Path;

use super::plan_folder::PlanFolder;
use crate::config::Config;

/// A street with two corners, with comments everywhere.
const STREET: &str = "# the street
[dragon]
benches = 12 # a short one

[route] # drawn by hand
kind = \"path\"
start_x_m = 0.0

# up the street
[[route.segments]]
kind = \"line\" # first
length_m = 20 # metres

[[route.segments]]
kind = \"arc\"
radius_m = 4.0 # at the well
turn_deg = 90.0

[[route.segments]]
kind = \"line\"
length_m = 20.0

[[route.segments]]
kind = \"arc\"
radius_m = 4.0
turn_deg = -90.0
[[route.segments]]
kind = \"line\"
length_m = 20.0 # the square

[stage]
outline = [[-40, -40], [60, -40], [60, 60], [-40, 60]] # ropes
";

const INLINE: &str = "[route]
kind = 'path'
segments = [
    { kind = 'line', length_m = 30 }, # in
    { kind = 'spiral', start_radius_m = 8.0, end_radius_m = 4.0, turn_deg = 360.0 },
    { kind = 'arc', radius_m = 2.0, turn_deg = 180.0 }, # round
    { kind = 'line', length_m = 10.0 },
]
[dragon]
benches = 10
";

const DRAGONS: &str = "[[dragons]]
name = 'gold' # leads
benches = 8
[dragons.route]
kind = 'turnaround'
start_s = -20.0
end_s = 20.0
[[dragons]]
name = 'silver'
benches = 8
[dragons.route]
kind = 'path'
start_x_m = -60.0
segments = [{ kind = 'line', length_m = 20 }, { kind = 'arc', radius_m = 5, turn_deg = 30 }, { kind = 'line', length_m = 20 }]
";

fn folder() -> PlanFolder {
    PlanFolder::of(Some(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/paper.toml"))).expect("the folder")
}

fn config(text: &str) -> Config {
    folder().config(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}
