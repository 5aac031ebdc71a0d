//! One task, solved by our program and by the scripts in turns.

use std::fmt::Debug;
use std::hint::black_box;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::peer::Peer;
use crate::shared::{Figures, median, nanoseconds_a_call};

/// A script runs again until its runs have taken this many seconds in total.
const ENOUGH_S: f64 = 10.0;
/// Most runs of a script.
const MOST_RUNS: usize = 5;
/// Calls of our library and runs of our program, before the first script and after every run of a script.
const CALLS: usize = 20;
const PROCESSES: usize = 5;

/// The answer to a task, in the same form from the library, the program and the scripts.
pub trait Answer: Debug + DeserializeOwned + PartialEq {
    /// Name of the task in keys.
    const TASK: &'static str;

    /// Keys of the values that compare a script's answer with ours.
    const MEASURES: [&'static str; 2];

    /// Returns the script's arguments. A search begins at `from_s`.
    fn question(from_s: &str) -> Vec<&str>;

    /// Returns the library's answer, computed from the dimensions of the benches.
    fn solved() -> Self;

    /// Returns the seconds that the program takes, and the answer that it prints.
    fn printed() -> (f64, Self);

    /// Compares our own answer with known values, to all of their six decimals.
    ///
    /// # Panics
    /// If a value differs.
    fn assert_known(&self);

    /// Returns the values of [`Answer::MEASURES`].
    ///
    /// # Panics
    /// If a script's answer differs from ours by more than the method explains.
    fn measures(&self, script: &Self) -> [f64; 2];
}

/// A script that takes part if its interpreter is installed.
#[derive(Debug)]
pub struct Contestant {
    /// Name in keys.
    pub name: &'static str,
    /// `None` if the script cannot run.
    pub peer: Option<Peer>,
    /// Show time in seconds at which the script begins a search.
    pub from_s: &'static str,
}

/// Runs the task with our program and with all scripts, and sets the figures. The figures of a script that cannot run are null.
///
/// # Panics
/// If an answer is wrong.
pub fn run<A: Answer>(contestants: &[Contestant], figures: &mut Figures) {
    let answer = A::solved();
    answer.assert_known();
    assert_eq!(A::printed().1, answer, "the program prints the library's answer");
    let mut ours = Runs::default();
    ours.add_ours::<A>();
    let scripts: Vec<_> = contestants.iter().map(|contestant| run_script(contestant, &answer, &mut ours)).collect();

    let (ours_s, ours_process_s) = ours.middle();
    figures.set(&format!("ours_{}_s", A::TASK), ours_s);
    figures.set(&format!("ours_{}_process_s", A::TASK), ours_process_s);
    for (Contestant { name, .. }, script) in contestants.iter().zip(scripts) {
        let mut set = |key: &str, value: Option<Value>| figures.set(&format!("{name}_{}_{key}", A::TASK), value);
        let times = script.as_ref().map(|script| script.runs.middle());
        set("runs", script.as_ref().map(|script| script.runs.work_s.len().into()));
        set("s", times.map(|(work_s, _)| work_s.into()));
        set("process_s", times.map(|(_, process_s)| process_s.into()));
        set("ratio", times.map(|(work_s, _)| (work_s / ours_s).into()));
        set("process_ratio", times.map(|(_, process_s)| (process_s / ours_process_s).into()));
        for (index, key) in A::MEASURES.into_iter().enumerate() {
            set(key, script.as_ref().map(|script| script.measures[index].into()));
        }
    }
}

/// Seconds of the work alone and of the whole process, for each run.
#[derive(Debug, Default)]
struct Runs {
    work_s: Vec<f64>,
    process_s: Vec<f64>,
}

impl Runs {
    fn add_ours<A: Answer>(&mut self) {
        self.work_s.push(1e-9 * nanoseconds_a_call(CALLS, || drop(black_box(A::solved()))));
        self.process_s.extend((0..PROCESSES).map(|_| A::printed().0));
    }

    /// Returns the medians of both.
    fn middle(&self) -> (f64, f64) {
        (middle(&self.work_s), middle(&self.process_s))
    }
}

/// Results of a script.
struct Script {
    runs: Runs,
    /// Values of [`Answer::MEASURES`] for its last answer.
    measures: [f64; 2],
}

/// Runs a script, compares each answer with ours, and runs our program after each run. Returns `None` if the script cannot run.
fn run_script<A: Answer>(contestant: &Contestant, answer: &A, ours: &mut Runs) -> Option<Script> {
    let peer = contestant.peer.as_ref()?;
    let question = A::question(contestant.from_s);
    println!("{} {} …", contestant.name, question.join(" "));
    let mut runs = Runs::default();
    loop {
        let reply = peer.ask::<A>(&question);
        let measures = answer.measures(&reply.answer);
        runs.work_s.push(reply.work_s);
        runs.process_s.push(reply.process_s);
        ours.add_ours::<A>();
        if runs.work_s.len() == MOST_RUNS || runs.process_s.iter().sum::<f64>() >= ENOUGH_S {
            return Some(Script { runs, measures });
        }
    }
}

fn middle(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    median(&values)
}
