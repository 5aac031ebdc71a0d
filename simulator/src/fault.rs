//! The faults of a scenario, and the commands of its operators, each with its instant.

use std::fmt;

use bench_dragon_ipc::Request;

use crate::dice::Dice;
use crate::scenario::SECOND_NS;

/// Something that happens to a show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// Instant of the simulated clock, in nanoseconds from the start.
    pub at_ns: u64,
    /// The fault.
    pub kind: FaultKind,
}

/// A part of the show that is a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The server.
    Server,
    /// The monitor, which is the guard of a guarded show.
    Guard,
    /// The recorder.
    Recorder,
}

/// The way in which an operator sends a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// A tool that sends one command, such as `ctl`.
    Tool,
    /// A program with a queue, such as the page.
    Desk(usize),
}

/// A fault of a timecode's sender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimecodeFault {
    /// It jumps by so many seconds.
    Jump(f64),
    /// It stands, or runs again.
    Stand,
    /// It sends nothing for so many nanoseconds.
    Silent(u64),
    /// One packet has another position.
    Stray(f64),
    /// Its pace changes, in seconds a second.
    Pace(f64),
}

/// The fault itself. Durations are in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// SIGKILL.
    Kill(Part),
    /// SIGSTOP, and SIGCONT after the duration.
    Stop(Part, u64),
    /// The server's next tick takes this long.
    Overrun(u64),
    /// For this time the server reads the same instant from its clock.
    ClockStands(u64),
    /// Commands and grants that are sent in this time never arrive.
    LoseRequests(u64),
    /// Commands and grants that are sent in this time arrive later by the second duration.
    DelayRequests(u64, u64),
    /// Replies that are sent in this time never arrive.
    LoseReplies(u64),
    /// Frames of this time do not reach the monitor.
    LoseFrames(u64),
    /// The guard's proofs of this time take longer by the second duration.
    SlowProofs(u64, u64),
    /// Another guard starts, and ends after the duration.
    SecondGuard(u64),
    /// The recorder is killed when it has written so many more bytes.
    KillInWrite(u64),
    /// The disk has only so many free bytes, for the duration.
    FullDisk(u64, u64),
    /// Each write and sync of the duration takes so many times longer.
    SlowDisk(u64, u64),
    /// The machine loses its power. What was not synced is lost. A new show begins.
    PowerLoss,
    /// Another observer begins to look, as `ctl status` does.
    FreshObserver,
    /// An operator sends a command.
    Command(Operator, Request),
    /// An operator submits so many commands of a seed at a desk, at once.
    Flurry(usize, u64, u64),
    /// The timecode's sender fails.
    Timecode(TimecodeFault),
}

impl FaultKind {
    /// Time for which the fault may disturb a process; `None` for what is no fault of one.
    pub(crate) fn disturbs_ns(self) -> Option<u64> {
        match self {
            Self::Command(..) | Self::Flurry(..) | Self::Timecode(_) | Self::FreshObserver => None,
            Self::Kill(_) | Self::KillInWrite(_) | Self::PowerLoss => Some(0),
            Self::Stop(_, ns)
            | Self::Overrun(ns)
            | Self::ClockStands(ns)
            | Self::LoseRequests(ns)
            | Self::LoseReplies(ns)
            | Self::LoseFrames(ns)
            | Self::SecondGuard(ns)
            | Self::FullDisk(_, ns)
            | Self::SlowDisk(_, ns) => Some(ns),
            Self::DelayRequests(ns, later_ns) | Self::SlowProofs(ns, later_ns) => Some(ns + later_ns),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.6} s {:?}", self.at_ns as f64 * 1e-9, self.kind)
    }
}

/// A usual kind of fault, which a seed turns on or off.
#[derive(Clone, Copy)]
enum Usual {
    Kill(Part),
    Stop(Part),
    Overrun,
    ClockStands,
    LoseRequests,
    DelayRequests,
    SlowProofs,
    SecondGuard,
    Command,
    LoseReplies,
    LoseFrames,
}

impl Usual {
    /// All kinds. Commands are as frequent as two others.
    const ALL: [Self; 14] = [
        Self::Kill(Part::Server),
        Self::Kill(Part::Guard),
        Self::Stop(Part::Server),
        Self::Stop(Part::Guard),
        Self::Overrun,
        Self::ClockStands,
        Self::LoseRequests,
        Self::DelayRequests,
        Self::SlowProofs,
        Self::SecondGuard,
        Self::Command,
        Self::Command,
        Self::LoseReplies,
        Self::LoseFrames,
    ];
}

/// Draws all faults of a scenario up to an instant, in the order of their instants.
pub(crate) fn draw(seed: u64, until_ns: u64, seek_s: [f64; 2], has_timecode: bool) -> Vec<Fault> {
    let mut faults = draw_usual(seed, until_ns, seek_s, has_timecode);
    faults.extend(draw_flurries(seed, until_ns));
    faults.extend(draw_recorder(seed, until_ns));
    let mut dice = Dice::new(seed, 14);
    let mean_s = dice.scaled(5.0, 600.0);
    faults.extend(instants(&mut dice, mean_s, until_ns, |_, _| FaultKind::FreshObserver));
    faults.sort_by_key(|fault| fault.at_ns);
    faults
}

/// Draws bursts of commands at the desks, for some seeds.
fn draw_flurries(seed: u64, until_ns: u64) -> Vec<Fault> {
    let mut dice = Dice::new(seed, 8);
    if dice.chance(0.5) {
        return Vec::new();
    }
    let mean_s = dice.scaled(2.0, 300.0);
    instants(&mut dice, mean_s, until_ns, |dice, _| {
        FaultKind::Flurry(dice.below(2), dice.next() >> 40, 2 + dice.below(16) as u64)
    })
}

/// Draws the faults of the recorder and its disk, for some seeds.
fn draw_recorder(seed: u64, until_ns: u64) -> Vec<Fault> {
    let mut dice = Dice::new(seed, 10);
    let kinds: Vec<usize> = (0..7).filter(|_| dice.chance(0.5)).collect();
    if kinds.is_empty() {
        return Vec::new();
    }
    let (mean_s, longest_s) = (dice.scaled(1.0, 200.0), dice.scaled(0.1, 60.0));
    instants(&mut dice, mean_s, until_ns, |dice, _| {
        let duration_ns = (dice.scaled(0.01, longest_s.max(0.02)) * 1e9) as u64;
        match dice.one_of(&kinds) {
            0 => FaultKind::Kill(Part::Recorder),
            1 | 2 => FaultKind::KillInWrite(dice.scaled(1.0, 1e6) as u64),
            3 => FaultKind::Stop(Part::Recorder, duration_ns),
            4 => FaultKind::FullDisk(dice.below(400_000) as u64, duration_ns),
            5 => FaultKind::SlowDisk(dice.scaled(1.0, 1e5) as u64, duration_ns),
            _ if dice.chance(0.2) => FaultKind::PowerLoss,
            _ => FaultKind::Kill(Part::Recorder),
        }
    })
}

/// Draws the commands of a plan with several dragons or with cues. Without GO, a show that waits once would wait for the rest.
pub(crate) fn draw_plan_commands(seed: u64, until_ns: u64, cues_s: &[f64]) -> Vec<Fault> {
    /// Longest time from a GO to the second press of it.
    const SECOND_PRESS_S: f64 = 0.6;
    let mut dice = Dice::new(seed, 16);
    let kinds: Vec<usize> = (2..6).filter(|_| dice.chance(0.5)).collect();
    let kinds = [vec![0, 1], kinds].concat();
    let (mean_s, presses_twice) = (dice.scaled(2.0, 60.0), dice.chance(0.5));
    let mut faults = instants(&mut dice, mean_s, until_ns, |dice, _| {
        let operator = dice.one_of(&[Operator::Tool, Operator::Desk(0), Operator::Desk(1)]);
        let request = match dice.one_of(&kinds) {
            2 => Request::Pace { factor: dice.scaled(0.2, 4.0) },
            3 => Request::Pace { factor: dice.one_of(&[0.0, 1.0, 1.0, -1.0, 1e4, f64::NAN]) },
            4 | 5 if !cues_s.is_empty() => Request::Seek { show_time_s: dice.one_of(cues_s) },
            _ => Request::Go,
        };
        FaultKind::Command(operator, request)
    });
    if presses_twice {
        let again = faults.iter().filter(|fault| matches!(fault.kind, FaultKind::Command(_, Request::Go)));
        let again = again.map(|go| Fault { at_ns: go.at_ns + (dice.within(0.0, SECOND_PRESS_S) * 1e9) as u64, ..*go });
        let again: Vec<Fault> = again.collect();
        faults.extend(again);
    }
    faults
}

/// Draws faults at random instants with a mean distance. `kind` gets the instant.
fn instants(
    dice: &mut Dice,
    mean_s: f64,
    until_ns: u64,
    mut kind: impl FnMut(&mut Dice, u64) -> FaultKind,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut at_s = 0.0;
    loop {
        at_s -= mean_s * (1.0 - dice.unit()).ln();
        let at_ns = (at_s * 1e9) as u64;
        if at_ns >= until_ns {
            return faults;
        }
        faults.push(Fault { at_ns, kind: kind(dice, at_ns) });
    }
}

/// Draws the usual faults. Each seed leaves out about half of the kinds, and has its own mean distance
/// between faults: long quiet runs and storms both occur.
fn draw_usual(seed: u64, until_ns: u64, seek_s: [f64; 2], has_timecode: bool) -> Vec<Fault> {
    let mut dice = Dice::new(seed, 2);
    let kinds: Vec<Usual> = Usual::ALL.into_iter().filter(|_| dice.chance(0.5)).collect();
    // Without commands a show that was held once would stand for the rest.
    let kinds = [kinds, vec![Usual::Command; 2]].concat();
    let mean_s = dice.scaled(0.3, 120.0);
    let longest_s = dice.scaled(0.1, 60.0);
    instants(&mut dice, mean_s, until_ns, |dice, at_ns| {
        let usual = dice.one_of(&kinds);
        let mut durations = Dice::new(seed ^ at_ns, 5);
        let mut duration_ns = || (durations.scaled(0.001, longest_s.max(0.002)) * 1e9) as u64;
        let kind = match usual {
            Usual::Kill(part) => FaultKind::Kill(part),
            Usual::Stop(part) => FaultKind::Stop(part, duration_ns()),
            Usual::Overrun => FaultKind::Overrun(duration_ns()),
            Usual::ClockStands => FaultKind::ClockStands(duration_ns()),
            Usual::LoseRequests => FaultKind::LoseRequests(duration_ns()),
            Usual::DelayRequests => FaultKind::DelayRequests(duration_ns(), duration_ns().min(8 * SECOND_NS)),
            Usual::SlowProofs => FaultKind::SlowProofs(duration_ns(), duration_ns().min(3 * SECOND_NS)),
            Usual::SecondGuard => FaultKind::SecondGuard(duration_ns()),
            Usual::Command => {
                let operator =
                    durations.one_of(&[Operator::Tool, Operator::Desk(0), Operator::Desk(0), Operator::Desk(1)]);
                FaultKind::Command(operator, command(dice, seek_s))
            }
            Usual::LoseReplies => FaultKind::LoseReplies(duration_ns()),
            Usual::LoseFrames => FaultKind::LoseFrames(duration_ns()),
        };
        if has_timecode && dice.chance(0.2) { FaultKind::Timecode(timecode(dice)) } else { kind }
    })
}

/// Any command, those that go on more often than those that stop. Some have values out of range.
fn command(dice: &mut Dice, [first_s, last_s]: [f64; 2]) -> Request {
    match dice.below(24) {
        0..=2 => Request::Pause,
        3..=6 => Request::Resume,
        7..=8 => Request::Hold,
        9..=13 => Request::Release,
        14..=16 => Request::Speed { speed_mps: dice.scaled(0.01, 12.0) },
        17 => Request::Speed { speed_mps: dice.one_of(&[0.0, 1.0, -1.0, f64::NAN]) },
        18..=21 => {
            let past_s = 0.05 * (last_s - first_s);
            Request::Seek { show_time_s: dice.within(first_s - past_s, last_s + past_s) }
        }
        22 => Request::Seek { show_time_s: dice.one_of(&[first_s, last_s, f64::INFINITY]) },
        _ if dice.chance(0.3) => Request::Stop,
        _ => Request::Pace { factor: 2.0 },
    }
}

/// The commands of a burst: so many, of a seed.
pub(crate) fn flurry(seed: u64, count: u64, seek_s: [f64; 2]) -> impl Iterator<Item = Request> {
    let mut dice = Dice::new(seed, 9);
    (0..count).map(move |_| command(&mut dice, seek_s))
}

fn timecode(dice: &mut Dice) -> TimecodeFault {
    match dice.below(5) {
        0 => TimecodeFault::Jump(dice.within(-60.0, 60.0)),
        1 => TimecodeFault::Stand,
        2 => TimecodeFault::Silent((dice.scaled(0.05, 20.0) * 1e9) as u64),
        3 => TimecodeFault::Stray(dice.within(-100.0, 100.0)),
        _ => TimecodeFault::Pace(dice.within(0.93, 1.07)),
    }
}
