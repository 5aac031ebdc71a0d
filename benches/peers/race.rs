//! One task, done by ours and by the scripts in turns.

use std::fmt::Debug;
use std::hint::black_box;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::peer::Peer;
use crate::shared::{Figures, median, nanoseconds_a_call};

/// A script runs again until it has had so many seconds …
const ENOUGH_S: f64 = 10.0;
/// … or so many runs.
const MOST_RUNS: usize = 5;
/// Calls and processes of ours, before the first script and after every run of one.
const CALLS: usize = 20;
const PROCESSES: usize = 5;

/// A task, which the library, the program and the scripts answer alike.
pub trait Answer: Debug + DeserializeOwned + PartialEq {
    /// What the task is called in keys.
    const TASK: &'static str;

    /// Keys of what a script's answer is measured by, beside ours.
    const MEASURES: [&'static str; 2];

    /// What a script is asked. Where it searches, it begins at `from_s`.
    fn question(from_s: &str) -> Vec<&str>;

    /// As the library solves it, from the dimensions of the benches on.
    fn solved() -> Self;

    /// As the program prints it, and the seconds that the process takes.
    fn printed() -> (f64, Self);

    /// Holds our own answer against known values, to the last of their six decimals.
    ///
    /// # Panics
    /// If a value differs.
    fn assert_known(&self);

    /// Values to [`Answer::MEASURES`].
    ///
    /// # Panics
    /// If a script's answer is further from ours than its method is.
    fn measures(&self, script: &Self) -> [f64; 2];
}

/// A script that may take part.
#[derive(Debug)]
pub struct Contestant {
    /// What it is called in keys.
    pub name: &'static str,
    /// None where it cannot run.
    pub peer: Option<Peer>,
    /// Show time in seconds at which it begins a search.
    pub from_s: &'static str,
}

/// Has the task done by all who can, and sets the figures. Those of a script that cannot run are null.
///
/// # Panics
/// If an answer is wrong.
pub fn run<A: Answer>(contestants: &[Contestant], figures: &mut Figures) {
    let answer = A::solved();
    answer.assert_known();
    assert_eq!(A::printed().1, answer, "the program prints what the library solves");
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

/// Seconds of the work alone and of the whole process, run by run.
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

    /// The middle one of either.
    fn middle(&self) -> (f64, f64) {
        (middle(&self.work_s), middle(&self.process_s))
    }
}

/// What a script has to show.
struct Script {
    runs: Runs,
    /// Of its last answer.
    measures: [f64; 2],
}

/// A script's runs, each answer held against ours, and with runs of ours in between.
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
