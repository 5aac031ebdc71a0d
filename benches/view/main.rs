//! Measures how many pictures per second the page draws, by the page's own count. It draws the paper's dragon and a dragon of
//! 10,000 benches, on a wide screen and on a phone's, in a headless Chromium without a graphics card.
//!
//! Server, view and browser share one machine, so these figures are a lower bound in practice. Before it counts, the bench
//! checks that the page draws: the page has the bus's number of benches, and its picture changes. The bench requires the
//! tools that `tests/run` installs.

#[path = "../shared/mod.rs"]
mod shared;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

use shared::{Figures, Program, domain, median, seconds_or};

/// Default time per page in seconds; `--seconds` overrides it.
const SECONDS: u32 = 10;
/// Frames per second of the server, as on most screens.
const RATE_HZ: &str = "60";
const BENCHES: [usize; 2] = [223, 10_000];
const SCREENS: [&str; 2] = ["wide", "phone"];

fn main() {
    let seconds = seconds_or(SECONDS);
    let mut figures = Figures::of("view");
    figures.set("seconds_per_page", seconds);
    for benches in BENCHES {
        let config = configuration(benches);
        let domain = domain(&format!("bench-view-{benches}"));
        let mut server =
            Program::start(&domain, &["serve", "--rate", RATE_HZ, "--config", &config.display().to_string()]);
        server.until("started");
        let mut view = Program::start(&domain, &["view", "--listen", "127.0.0.1:0"]);
        let listening = view.until("listening");
        let url = listening["url"].as_str().expect("an address");
        for screen in SCREENS {
            let mut drawn = count(url, screen, benches, seconds);
            drawn.sort_by(f64::total_cmp);
            figures.set(&format!("drawn_{benches}_{screen}_per_s"), median(&drawn));
            figures.set(&format!("drawn_{benches}_{screen}_least_per_s"), drawn[0]);
        }
        drop(view);
        server.stop("summary");
    }
    figures.write();
}

/// Writes a configuration with `benches` of the paper's benches on a spiral that has room for them.
fn configuration(benches: usize) -> PathBuf {
    let start_turns = if benches > 223 { 120 } else { 16 };
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("view-{benches}.toml"));
    let text = format!("[dragon]\nbenches = {benches}\n\n[route]\nkind = \"spiral\"\nstart_turns = {start_turns}\n");
    fs::write(&path, text).expect("cargo's target folder is writable");
    path
}

/// Returns the pictures that the page drew, for each second.
fn count(url: &str, screen: &str, benches: usize, seconds: u32) -> Vec<f64> {
    let output = Command::new("node")
        .args(["tests/node/page_pace.mjs", url, screen, &benches.to_string(), &seconds.to_string()])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stderr(Stdio::inherit())
        .output()
        .expect("node is installed");
    assert!(output.status.success(), "the page does not draw, see stderr");
    let line: Value = serde_json::from_slice(&output.stdout).expect("the scenario prints a line of JSON");
    line["drawn_per_s"]
        .as_array()
        .expect("an array with one count per second")
        .iter()
        .filter_map(Value::as_f64)
        .collect()
}
