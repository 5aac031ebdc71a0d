//! The task `contact`: the first contact of two benches.

use bench_dragon_geometry::clearance::first_contact;
use serde::Deserialize;
use test_support::dragons::paper_dragon_of;

use crate::process::{solve, timed_output};
use crate::race::Answer;

/// A first contact.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
pub struct FirstContact {
    /// Show time in seconds.
    pub time_s: f64,
    /// The benches that touch.
    pub benches: [usize; 2],
}

impl Answer for FirstContact {
    const TASK: &'static str = "contact";
    const MEASURES: [&'static str; 2] = ["time_s", "late_s"];

    fn question(from_s: &str) -> Vec<&str> {
        vec!["contact", from_s]
    }

    fn solved() -> Self {
        let dragon = paper_dragon_of(223);
        let contact = first_contact(&dragon, 0.0, dragon.end_travel_m())
            .expect("the search has no limit")
            .expect("the paper's dragon touches itself");
        // The head walks at 1 m/s.
        Self { time_s: contact.travel_m, benches: contact.benches }
    }

    fn printed() -> (f64, Self) {
        let (seconds, stdout) = timed_output(&mut solve(&["contact"]));
        (seconds, serde_json::from_slice(&stdout).expect("the program prints its answer as JSON"))
    }

    fn assert_known(&self) {
        assert!(self.benches == [0, 8] && (self.time_s - 412.473_838).abs() <= 5.001e-7, "{self:?}");
    }

    /// Returns the first step of 0.01 s at which the benches overlap, and its delay after the exact contact.
    fn measures(&self, script: &Self) -> [f64; 2] {
        let late_s = script.time_s - self.time_s;
        assert!(
            script.benches == self.benches && (0.0..=0.01).contains(&late_s),
            "the script's answer is {script:?}, must be at most 0.01 s after {self:?}"
        );
        [script.time_s, late_s]
    }
}
