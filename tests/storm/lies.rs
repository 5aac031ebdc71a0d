//! Lies about a show: what a witness saw, changed in one place. Each check from outside must find its lie, so no check is one that cannot
//! fail.

use std::ops::Range;

use bench_dragon_ipc::{CommandEvent, EventKind, FrameHeader, ShowState};
use simulator::{Promise, Scenario, Script};

use crate::outside::{check, followed};
use crate::scenario::Played;
use crate::troupe::Failure;

/// A lie. It returns false where the show had nothing to lie about.
struct Lie {
    claim: &'static str,
    promise: Promise,
    tell: fn(&Scenario, &mut Played) -> bool,
}

const LIES: [Lie; 12] = [
    Lie { claim: "a frame comes twice", promise: Promise::TicksWithoutHole, tell: repeat_frame },
    Lie { claim: "frames are neither read nor lost", promise: Promise::TicksWithoutHole, tell: withhold_frames },
    Lie { claim: "a frame is half a period late", promise: Promise::PeriodsAreSkipped, tell: shift_frame },
    Lie { claim: "boards are nearer than the margin", promise: Promise::MarginKept, tell: approach },
    Lie {
        claim: "a restarted server begins elsewhere",
        promise: Promise::ResumesWhereItStood,
        tell: restart_elsewhere,
    },
    Lie { claim: "a held show runs", promise: Promise::StopsAreTrue, tell: hold },
    Lie { claim: "the head walks back", promise: Promise::NoJump, tell: walk_back },
    Lie { claim: "a wait is left without GO", promise: Promise::WaitsForGo, tell: forget_go },
    Lie { claim: "a reply has another tick", promise: Promise::RepliesAreTrue, tell: delay_reply },
    Lie { claim: "the show has failed", promise: Promise::EndsWhenTold, tell: fail },
    Lie { claim: "a killed child has not returned", promise: Promise::DeadChildReturns, tell: kill_more },
    Lie { claim: "more is recorded than published", promise: Promise::RecordingIsPrefix, tell: record_more },
];

/// The claims of all lies.
pub(crate) fn claims() -> impl Iterator<Item = &'static str> {
    LIES.into_iter().map(|lie| lie.claim)
}

/// Tells every lie that the show allows. Returns those that were found.
///
/// # Errors
/// A lie was believed, or found by another check than its own.
pub(crate) fn find_lies(scenario: &Scenario, script: &Script, played: &Played) -> Result<Vec<&'static str>, Failure> {
    let mut found = Vec::new();
    for Lie { claim, promise, tell } in LIES {
        let mut told = played.clone();
        if !tell(scenario, &mut told) {
            continue;
        }
        match check(scenario, script, &told) {
            Err(failure) if failure.starts_with(&format!("promise {} ", promise.number())) => found.push(claim),
            outcome => return Err(format!("the lie that {claim} has the outcome {outcome:?}")),
        }
    }
    Ok(found)
}

/// The frames of each run, as a range of all frames.
fn runs(played: &Played) -> Vec<Range<usize>> {
    let mut end = 0;
    let range = |run: &[_]| {
        let start = end;
        end += run.len();
        start..end
    };
    played.seen.frames.chunk_by(|one, next| one.0.run_id == next.0.run_id).map(range).collect()
}

/// The run with most frames.
fn longest_run(played: &Played) -> Range<usize> {
    runs(played).into_iter().max_by_key(ExactSizeIterator::len).expect("a show has frames")
}

fn repeat_frame(_: &Scenario, played: &mut Played) -> bool {
    let at = longest_run(played).start;
    let frame = played.seen.frames[at];
    played.seen.frames.insert(at, frame);
    true
}

fn withhold_frames(_: &Scenario, played: &mut Played) -> bool {
    let run = longest_run(played);
    let some = 1..2 + played.seen.lost as usize;
    let is_possible = run.len() > some.end;
    if is_possible {
        played.seen.frames.drain(run.start + some.start..run.start + some.end);
    }
    is_possible
}

fn shift_frame(scenario: &Scenario, played: &mut Played) -> bool {
    let run = longest_run(played);
    let half_ns = 5e8 / f64::from(scenario.config().tables().serve.rate_hz);
    played.seen.frames[run.end - 1].0.scheduled_ns += half_ns as u64;
    run.len() > 1
}

fn approach(scenario: &Scenario, played: &mut Played) -> bool {
    let monitor = &scenario.config().tables().monitor;
    let is_kept = |played: &Played, at: usize| played.seen.frames[at].1 >= monitor.margin_m;
    let at = runs(played).into_iter().flat_map(|run| (run.start + 1..run.end).map(move |at| (run.start, at))).find(
        |&(start, at)| {
            let [first, here] = [start, at].map(|at| played.seen.frames[at].0.course_m);
            here != first && is_kept(played, at - 1) && is_kept(played, at)
        },
    );
    if let Some((_, at)) = at.filter(|_| monitor.guard) {
        played.seen.frames[at].1 = monitor.margin_m - 1e-6;
    }
    monitor.guard && at.is_some()
}

fn restart_elsewhere(_: &Scenario, played: &mut Played) -> bool {
    let restarted = runs(played).into_iter().skip(1).find(|run| played.seen.frames[run.start].0.tick == 0);
    for (header, _) in restarted.clone().map_or(&mut [] as &mut [_], |run| &mut played.seen.frames[run]) {
        header.course_m += 1e6;
    }
    restarted.is_some()
}

/// The first frame that is compared with the commands, and for which a condition on it and the frame before holds.
fn followed_frame(played: &Played, is_wanted: impl Fn(&FrameHeader, &FrameHeader) -> bool) -> Option<usize> {
    runs(played).into_iter().enumerate().find_map(|(number, run)| {
        let frames = &played.seen.frames;
        let (events, covered) = followed(&played.seen, frames[run.start].0.run_id, number == 0)?;
        let seeks: Vec<u64> =
            events.iter().filter(|event| is_accepted(event, EventKind::Seek)).map(|event| event.tick).collect();
        (run.start + 1..run.end).find(|&at| {
            let [before, header] = [at - 1, at].map(|at| &frames[at].0);
            let has_sought = seeks.iter().any(|&tick| before.tick < tick && tick <= header.tick);
            header.tick <= covered && !has_sought && is_wanted(before, header)
        })
    })
}

fn is_accepted(event: &CommandEvent, kind: EventKind) -> bool {
    event.event_kind() == Some(kind) && event.outcome().is_ok()
}

/// Numbers the events of a run again.
fn number(events: &mut [CommandEvent]) {
    let first = events.first().map_or(0, |event| event.number);
    for (event, number) in events.iter_mut().zip(first..) {
        event.number = number;
    }
}

fn walks(before: &FrameHeader, header: &FrameHeader) -> bool {
    let runs = |header: &FrameHeader| header.show_state() == Some(ShowState::Running);
    runs(before) && runs(header) && header.course_m > before.course_m
}

fn hold(_: &Scenario, played: &mut Played) -> bool {
    let Some(at) = followed_frame(played, walks) else { return false };
    let FrameHeader { run_id, tick, .. } = played.seen.frames[at].0;
    let events = played.seen.events.get_mut(&run_id).expect("the run has events");
    let after = events.partition_point(|event| event.tick <= tick);
    let Some(&before) = events[..after].last() else { return false };
    events.insert(after, CommandEvent { tick, kind: EventKind::Hold as u32, refusal: 0, ..before });
    number(events);
    true
}

fn walk_back(_: &Scenario, played: &mut Played) -> bool {
    let Some(at) = followed_frame(played, walks) else { return false };
    played.seen.frames[at].0.course_m = played.seen.frames[at - 1].0.course_m - 0.01;
    true
}

fn forget_go(scenario: &Scenario, played: &mut Played) -> bool {
    let waits_m = scenario.config().waits_m();
    let leaves = |before: &FrameHeader, header: &FrameHeader| {
        waits_m.iter().any(|&wait_m| before.course_m <= wait_m && wait_m < header.course_m)
    };
    let Some(at) = followed_frame(played, leaves) else { return false };
    let run_id = played.seen.frames[at].0.run_id;
    let events = played.seen.events.get_mut(&run_id).expect("the run has events");
    events.retain(|event| !is_accepted(event, EventKind::Go));
    number(events);
    true
}

fn delay_reply(_: &Scenario, played: &mut Played) -> bool {
    let Played { seen, answers, .. } = played;
    let delayed = answers.iter_mut().find_map(|(request, reply)| {
        let reply = reply.as_mut()?;
        let (events, covered) = followed(seen, reply.run_id, true)?;
        let kind = request.to_wire().kind;
        let is_free = events.iter().all(|event| event.kind != kind || event.tick != reply.tick + 1);
        (is_free && covered > reply.tick + 1).then_some(reply)
    });
    let is_possible = delayed.is_some();
    if let Some(reply) = delayed {
        reply.tick += 1;
    }
    is_possible
}

fn fail(_: &Scenario, played: &mut Played) -> bool {
    use std::os::unix::process::ExitStatusExt as _;
    played.ended.status = std::process::ExitStatus::from_raw(1 << 8);
    true
}

fn kill_more(_: &Scenario, played: &mut Played) -> bool {
    played.kills += 1000;
    true
}

fn record_more(_: &Scenario, played: &mut Played) -> bool {
    let Some(mut summary) = played.ended.json_lines().pop() else { return false };
    summary["frames"]["recorded"] = u64::MAX.into();
    played.ended.stdout = summary.to_string();
    true
}
