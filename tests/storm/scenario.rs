//! Scenarios: seeds of the simulator on the real bus. A show plays the seed's configuration in real time. Its children get the seed's
//! signals, and its server the seed's commands, at their instants. Then a captain leads the show to its end, as in the simulator.
//!
//!     cargo test --release --test storm -- --scenarios 200 --seed 7
//!     cargo test --release --test storm -- --scenarios 1 --seed 7 --only 17,21
//!
//! The instants of a machine differ from those of the simulator, so nothing is asserted about them. What must hold at any instants
//! is checked from outside (`outside.rs`).

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bench_dragon::command_queue::{CommandQueue, call};
use bench_dragon::recording::Parts;
use bench_dragon::source::replay::verify::{RunVerdict, RunVerification, verify};
use bench_dragon_ipc::{CommandReply, FrameHeader, Request, Sender, ShowState, Status, Stop};
use rustix::process::Signal;
use simulator::{Operator, Part, Scenario, Script, ScriptAction, request_to_walk};
use test_support::children::{children, send};
use test_support::eventually::{DEADLINE, before_deadline};
use test_support::process::{Ended, Process};

use crate::lies::find_lies;
use crate::outside::check;
use crate::stage::Stage;
use crate::troupe::Failure;
use crate::witness::{Seen, Witness};

/// Folder of the recordings of a show.
const FOLDER: &str = "night";
/// The children of a show.
const PARTS: [Part; 3] = [Part::Server, Part::Guard, Part::Recorder];

/// A command with its reply; `None` if no server has answered.
pub(crate) type Answer = (Request, Option<CommandReply>);

/// What happened in the show of a scenario.
#[derive(Clone, Debug)]
pub(crate) struct Played {
    pub(crate) seen: Seen,
    pub(crate) answers: Vec<Answer>,
    pub(crate) kills: u64,
    pub(crate) ended: Ended,
}

/// An account of a show in which no promise was broken.
pub(crate) struct Account {
    /// A line about the show.
    pub(crate) told: String,
    /// The lies about it that were found.
    pub(crate) lies: Vec<&'static str>,
}

/// Plays the scenario of a seed with faults for some seconds, or with only some of them. Returns `None` for a seed that
/// real processes cannot repeat.
pub(crate) fn play_scenario(seed: u64, seconds: f64, only: Option<&[usize]>) -> Result<Option<Account>, Failure> {
    let whole = Scenario::of(seed, seconds / 3600.0);
    let scenario = only.map_or_else(|| whole.clone(), |numbers| whole.only(numbers));
    let Some(script) = scenario.script() else { return Ok(None) };
    let stage = Stage::new();
    let played = perform(&stage, &scenario, &script)?;
    let checked = check(&scenario, &script, &played)?;
    let verified = verify_recording(&stage)?;
    let lies = find_lies(&scenario, &script, &played)?;
    let (frames, runs) = (played.seen.frames.len(), played.seen.covered.len());
    let (answers, kills, left_out) = (played.answers.len(), played.kills, script.left_out);
    let answered = played.answers.iter().filter(|(_, reply)| reply.is_some()).count();
    let told = format!(
        "seed {seed}: {kills} kills, {answered} of {answers} commands answered, {frames} frames of {runs} runs, {checked} of them \
         compared with the commands, {verified} verified in the recording; {} lies about it are found; {left_out} faults left out",
        lies.len()
    );
    Ok(Some(Account { told, lies }))
}

/// Simulates the recorded runs from their commands. Returns the number of equal frames.
fn verify_recording(stage: &Stage) -> Result<u64, Failure> {
    let parts = Parts::find(&stage.path(FOLDER)).map_err(|error| error.to_string())?;
    let verification = verify(&parts, &AtomicBool::new(false), |_| ()).map_err(|error| error.to_string())?;
    let differs = |run: &&RunVerification| matches!(run.verdict, RunVerdict::Differs { .. });
    match verification.runs.iter().find(differs) {
        Some(run) => Err(format!("the recording is not that of its commands: {run:?}")),
        None => Ok(verification.runs.iter().map(|run| run.verified).sum()),
    }
}

/// Plays the show of a script from its start to its end.
fn perform(stage: &Stage, scenario: &Scenario, script: &Script) -> Result<Played, Failure> {
    std::fs::write(stage.path("scenario.toml"), &scenario.toml).expect("the stage has a folder");
    let args: Vec<&str> = ["show", "--config", "scenario.toml", "--format", "json", "--out", FOLDER]
        .into_iter()
        .chain(script.args.iter().map(String::as_str))
        .collect();
    let show = stage.start(&args);
    let witness = Witness::join(stage.domain(), scenario.config());
    await_state("the first frame", || (!witness.seen().frames.is_empty()).then_some(()).ok_or_else(String::new))?;
    let mut cast = Cast::new(stage, show);
    cast.play(script);
    for part in PARTS {
        cast.signal(part, Signal::CONT);
    }
    let answers = cast.end_operators();
    lead(stage, scenario, &witness)?;
    let show = cast.show.pid();
    await_state("all children run", || {
        let running = children(show);
        if running.len() == PARTS.len() { Ok(()) } else { Err(format!("{running:?}")) }
    })?;
    let ended = end_show(stage, cast.show)?;
    Ok(Played { seen: witness.end()?, answers, kills: cast.kills, ended })
}

/// The show with those who act on it.
struct Cast<'a> {
    stage: &'a Stage,
    show: Process,
    operators: Operators,
    kills: u64,
}

/// The operators: two desks, and tools that send one command each.
struct Operators {
    desks: Vec<CommandQueue>,
    tools: Vec<JoinHandle<()>>,
    answers: Arc<Mutex<Vec<Answer>>>,
}

impl<'a> Cast<'a> {
    fn new(stage: &'a Stage, show: Process) -> Self {
        let desk = |_| CommandQueue::open(stage.domain().clone(), "desk", Sender::Page).expect("two threads");
        let desks = (0..2).map(desk).collect();
        let operators = Operators { desks, tools: Vec::new(), answers: Arc::default() };
        Self { stage, show, operators, kills: 0 }
    }

    /// Carries the steps out, each at its instant.
    fn play(&mut self, script: &Script) {
        let begun = Instant::now();
        for step in &script.steps {
            thread::sleep(Duration::from_nanos(step.at_ns).saturating_sub(begun.elapsed()));
            match step.action {
                ScriptAction::Kill(part) => self.kills += self.signal(part, Signal::KILL),
                ScriptAction::Stop(part) => {
                    self.signal(part, Signal::STOP);
                }
                ScriptAction::Continue(part) => {
                    self.signal(part, Signal::CONT);
                }
                ScriptAction::Command(operator, request) => self.operators.send(self.stage, operator, request),
            }
        }
    }

    /// Sends a signal to the process of a part. Returns the number of processes that got it.
    fn signal(&self, part: Part, signal: Signal) -> u64 {
        let name = match part {
            Part::Server => "serve",
            Part::Guard => "monitor",
            Part::Recorder => "record",
        };
        let child = children(self.show.pid()).into_iter().find(|(_, child)| child == name);
        u64::from(child.is_some_and(|(pid, _)| send(pid, signal).is_ok()))
    }

    /// Waits for the answers of all commands.
    fn end_operators(&mut self) -> Vec<Answer> {
        let Operators { desks, tools, answers } = &mut self.operators;
        for desk in desks.drain(..) {
            desk.close(DEADLINE, |_| true);
        }
        tools.drain(..).for_each(|tool| tool.join().expect("a tool ends"));
        std::mem::take(&mut *answers.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Operators {
    fn send(&mut self, stage: &Stage, operator: Operator, request: Request) {
        let answers = Arc::clone(&self.answers);
        let note = move |reply| answers.lock().unwrap_or_else(PoisonError::into_inner).push((request, reply));
        match operator {
            Operator::Desk(desk) => {
                self.desks[desk].submit(request, move |outcome| note(outcome.ok()));
            }
            Operator::Tool => {
                let domain = stage.domain().clone();
                let tool = move || note(call(&domain, "tool", Sender::Ctl, request, &|| false, &|| false).ok());
                self.tools.push(thread::spawn(tool));
            }
        }
    }
}

/// Sends the commands that let the show walk on, until it walks or stands where no command but a seek moves it.
fn lead(stage: &Stage, scenario: &Scenario, witness: &Witness) -> Result<(), Failure> {
    let (speed_mps, margin_m) =
        (scenario.config().tables().head.speed_mps, scenario.config().tables().monitor.margin_m);
    await_state("the show walks on", || {
        let seen = witness.seen();
        let newest = seen.frames.last().copied();
        let status = seen.status;
        drop(seen);
        let (Some((header, clearance_m)), Some(status)) = (newest, status) else { return Err("no status".to_owned()) };
        if has_arrived(&header, &status, clearance_m < margin_m) {
            return Ok(());
        }
        let stops = status.stops();
        let request = request_to_walk(stops, speed_mps);
        let reply = call(stage.domain(), "captain", Sender::Ctl, request, &|| false, &|| false);
        Err(format!("{header:?}, stops {stops:?}, {request:?} gets {reply:?}"))
    })
}

/// Whether the show walks, or stands where no command but a seek moves it: also on travel below the margin, which no guard proves.
fn has_arrived(header: &FrameHeader, status: &Status, is_below: bool) -> bool {
    status.run_id == header.run_id
        && match header.show_state() {
            Some(ShowState::Running) => header.course_mps > 0.0,
            Some(ShowState::Held) => {
                let is_final = status.guard_end().is_some_and(|end_m| header.course_m >= end_m);
                (is_final || is_below) && !status.stops().has(Stop::Held)
            }
            Some(ShowState::Finished) => true,
            _ => false,
        }
}

/// Stops the show, and waits for its end.
fn end_show(stage: &Stage, show: Process) -> Result<Ended, Failure> {
    await_state("a stop is accepted", || {
        let reply = call(stage.domain(), "captain", Sender::Ctl, Request::Stop, &|| false, &|| false);
        reply.map(drop).map_err(|error| error.to_string())
    })?;
    Ok(show.end())
}

/// Calls `look` until it succeeds.
fn await_state(what: &str, look: impl FnMut() -> Result<(), String>) -> Result<(), Failure> {
    before_deadline(look).map_err(|state| format!("waited {DEADLINE:?} until {what}; last seen: {state}"))
}
