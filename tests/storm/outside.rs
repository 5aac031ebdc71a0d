//! The promises that can be seen from outside: by the frames, the record of commands, the replies, and the summary of a show.
//!
//! No check depends on when something happened. A killed server takes the events of its last tenth of a second with it, so frames
//! are compared with the commands only up to the tick that a status covers.

use std::collections::BTreeSet;

use bench_dragon_ipc::{CommandEvent, EventKind, FrameHeader, Request, ShowState};
use simulator::{Promise, Scenario, Script};

use crate::scenario::Played;
use crate::troupe::Failure;
use crate::witness::Seen;

/// Rounding of a clearance or a travel, in metres.
const ROUNDING_M: f64 = 1e-9;
/// Children of a show.
const CHILDREN: [&str; 3] = ["serve", "monitor", "record"];

/// A settled truth about a show.
struct Show<'a> {
    is_guarded: bool,
    margin_m: f64,
    accel_mps2: Option<f64>,
    period_ns: f64,
    waits_m: Vec<f64>,
    script: &'a Script,
    played: &'a Played,
}

/// A frame with the least clearance in it.
type SeenFrame = (FrameHeader, f64);

/// Checks a show from outside. Returns the number of frames that were compared with the commands.
pub(crate) fn check(scenario: &Scenario, script: &Script, played: &Played) -> Result<usize, Failure> {
    let (config, tables) = (scenario.config(), scenario.config().tables());
    let show = Show {
        is_guarded: tables.monitor.guard,
        margin_m: tables.monitor.margin_m,
        accel_mps2: config.accel_mps2(),
        period_ns: 1e9 / f64::from(tables.serve.rate_hz),
        waits_m: config.waits_m().to_vec(),
        script,
        played,
    };
    let runs: Vec<&[SeenFrame]> = played.seen.frames.chunk_by(|one, next| one.0.run_id == next.0.run_id).collect();
    let numbers: BTreeSet<u64> = runs.iter().map(|run| run[0].0.run_id).collect();
    require(Promise::TicksWithoutHole, numbers.len() == runs.len(), || "frames of two runs are mixed".to_owned())?;
    let mut compared = 0;
    for (number, run) in runs.iter().enumerate() {
        show.check_ticks(run)?;
        show.check_margin(run)?;
        if number > 0 {
            show.check_restart(runs[number - 1], run)?;
        }
        compared += show.check_commands(run, number == 0)?;
    }
    show.check_replies()?;
    show.check_end()?;
    Ok(compared)
}

/// The events of a run, and the tick up to which they are all there; `None` if some are missing. Nobody commands the
/// first server before the witness has its first frame.
pub(crate) fn followed(seen: &Seen, run_id: u64, is_first: bool) -> Option<(&[CommandEvent], u64)> {
    let &covered = seen.covered.get(&run_id)?;
    let events = seen.events.get(&run_id).map_or(&[] as &[CommandEvent], Vec::as_slice);
    let is_whole = events.windows(2).all(|pair| pair[0].number + 1 == pair[1].number);
    (is_whole && (is_first || events.first().is_none_or(|first| first.number == 0))).then_some((events, covered))
}

fn require(promise: Promise, holds: bool, what: impl FnOnce() -> String) -> Result<(), Failure> {
    if holds { Ok(()) } else { Err(format!("promise {} {promise:?} is broken: {}", promise.number(), what())) }
}

impl Show<'_> {
    /// Ticks go up by one for each frame that was read or lost, and frames are due a whole number of periods apart.
    fn check_ticks(&self, run: &[SeenFrame]) -> Result<(), Failure> {
        for pair in run.windows(2) {
            let [(before, _), (next, _)] = pair else { unreachable!("windows of two") };
            require(Promise::TicksWithoutHole, before.tick < next.tick, || format!("{next:?} follows {before:?}"))?;
            let due_ns = (next.scheduled_ns as f64) - before.scheduled_ns as f64;
            let periods = (due_ns / self.period_ns).round();
            let is_whole = (due_ns - periods * self.period_ns).abs() <= 2.0;
            let is_right = is_whole && periods >= (next.tick - before.tick) as f64;
            require(Promise::PeriodsAreSkipped, is_right, || format!("{due_ns} ns from {before:?} to {next:?}"))?;
        }
        let (ticks, lost) = (run[run.len() - 1].0.tick - run[0].0.tick + 1, self.played.seen.lost);
        require(Promise::TicksWithoutHole, ticks <= run.len() as u64 + lost, || {
            format!("{} frames of {ticks} ticks are read, and {lost} are counted as lost", run.len())
        })
    }

    /// No clearance is below the margin, but where the run began or was so before.
    fn check_margin(&self, run: &[SeenFrame]) -> Result<(), Failure> {
        let mut exempt_m = Some(run[0].0.course_m);
        let mut was_below = false;
        for (header, clearance_m) in run {
            exempt_m = exempt_m.filter(|exempt_m| *exempt_m == header.course_m);
            let is_kept = *clearance_m >= self.margin_m - ROUNDING_M || exempt_m.is_some() || was_below;
            require(Promise::MarginKept, !self.is_guarded || is_kept, || format!("{clearance_m} m in {header:?}"))?;
            was_below = *clearance_m < self.margin_m;
        }
        Ok(())
    }

    /// A restarted server begins where the last one stood, and does not walk before a release unless the show resumes by itself.
    fn check_restart(&self, before: &[SeenFrame], run: &[SeenFrame]) -> Result<(), Failure> {
        let ((last, _), (first, _)) = (before[before.len() - 1], run[0]);
        if first.tick > 0 {
            return Ok(());
        }
        // A kill within the sending of a frame leaves it to some readers, and not to others.
        let step_m = Request::MAX_SPEED_MPS * self.period_ns * 1e-9 * last.time_scale.max(1.0);
        let off_m = first.course_m - last.course_m;
        require(Promise::ResumesWhereItStood, off_m.abs() <= step_m + ROUNDING_M, || {
            format!("{first:?} follows {last:?}")
        })?;
        let walks = first.show_state() == Some(ShowState::Running);
        require(Promise::ResumesWhereItStood, self.script.auto_resume || !walks, || format!("{first:?} walks"))
    }

    /// Follows the accepted commands of a run through its frames. Returns the number of frames.
    fn check_commands(&self, run: &[SeenFrame], is_first: bool) -> Result<usize, Failure> {
        let Some((events, covered)) = followed(&self.played.seen, run[0].0.run_id, is_first) else { return Ok(0) };
        if events.is_empty() {
            return Ok(0);
        }
        let mut book = Book::new(events, is_first && self.script.args.iter().any(|arg| arg == "--held"));
        let frames: Vec<&FrameHeader> =
            run.iter().map(|(header, _)| header).filter(|header| header.tick <= covered).collect();
        let mut last: Option<&FrameHeader> = None;
        for header in &frames {
            let has_sought = book.advance(header);
            book.check_stand(header, self.accel_mps2)?;
            if let Some(last) = last.filter(|_| !has_sought) {
                Self::check_step(last, header)?;
                self.check_waits(&mut book, last, header)?;
            }
            last = Some(header);
        }
        Ok(frames.len())
    }

    /// Travel neither goes back nor jumps.
    fn check_step(last: &FrameHeader, next: &FrameHeader) -> Result<(), Failure> {
        let step_m = next.course_m - last.course_m;
        let show_s = (next.show_time_ns - last.show_time_ns + 4) as f64 * 1e-9;
        require(Promise::NoJump, step_m >= 0.0 && step_m <= Request::MAX_SPEED_MPS * show_s, || {
            format!("{step_m} m from {last:?} to {next:?}")
        })
    }

    /// No wait is left or passed without GO.
    fn check_waits(&self, book: &mut Book<'_>, last: &FrameHeader, next: &FrameHeader) -> Result<(), Failure> {
        for &wait_m in &self.waits_m {
            let is_left = last.course_m <= wait_m && wait_m < next.course_m;
            let since = if last.course_m == wait_m { book.arrived } else { last.tick + 1 };
            require(Promise::WaitsForGo, !is_left || book.goes.iter().any(|&tick| tick >= since), || {
                format!("the wait at {wait_m} m is left from {last:?} to {next:?} after GO at {:?}", book.goes)
            })?;
        }
        if last.course_m != next.course_m {
            book.arrived = last.tick + 1;
        }
        Ok(())
    }

    /// Each reply is in the record of its run, and no command is accepted more often than it was sent, but a hold.
    fn check_replies(&self) -> Result<(), Failure> {
        let seen = &self.played.seen;
        for (request, reply) in &self.played.answers {
            let Some(reply) = reply else { continue };
            let Some((events, covered)) = followed(seen, reply.run_id, true) else { continue };
            let kind = request.to_wire().kind;
            let is_recorded = |event: &CommandEvent| {
                event.kind == kind && event.tick == reply.tick && event.outcome().is_ok() == reply.outcome().is_ok()
            };
            require(Promise::RepliesAreTrue, covered <= reply.tick || events.iter().any(is_recorded), || {
                format!("{request:?} has the reply {reply:?}, and the record of its run has no such event")
            })?;
        }
        Ok(())
    }

    /// The show ends in order, has started each killed child again, and reports no more frames than were published.
    fn check_end(&self) -> Result<(), Failure> {
        let Played { ended, kills, .. } = self.played;
        let summary = ended.json_lines().pop().unwrap_or_default();
        let restarts: u64 = CHILDREN.iter().filter_map(|child| summary["restarts"][child].as_u64()).sum();
        let frames = |name: &str| summary["frames"][name].as_u64();
        require(Promise::EndsWhenTold, ended.code() == Some(0), || format!("{summary}\n{}", ended.stderr))?;
        require(Promise::DeadChildReturns, restarts >= *kills, || format!("{restarts} restarts after {kills} kills"))?;
        require(Promise::RecordingIsPrefix, frames("recorded") <= frames("published"), || summary.to_string())
    }
}

/// The stops of a run, by its accepted commands.
struct Book<'a> {
    events: std::iter::Peekable<std::slice::Iter<'a, CommandEvent>>,
    is_held: bool,
    is_paused: bool,
    is_ending: bool,
    /// Where a head that must stand has begun to brake, and its speed there.
    stand: Option<[f64; 2]>,
    /// Ticks of GO.
    goes: Vec<u64>,
    /// First tick at which the show may have come to where it is.
    arrived: u64,
}

impl<'a> Book<'a> {
    fn new(events: &'a [CommandEvent], is_held: bool) -> Self {
        let (events, goes) = (events.iter().peekable(), Vec::new());
        Self { events, is_held, is_paused: false, is_ending: false, stand: None, goes, arrived: 0 }
    }

    fn must_stand(&self) -> bool {
        self.is_held || self.is_paused || self.is_ending
    }

    /// Takes all events up to the tick of a frame. Returns whether a seek was among them.
    fn advance(&mut self, header: &FrameHeader) -> bool {
        let mut has_sought = false;
        while let Some(event) = self.events.next_if(|event| event.tick <= header.tick) {
            if let Some(start) = event.run_start() {
                (self.is_held, self.is_paused) = (start.is_held || start.is_ready, start.is_paused);
            }
            if event.outcome().is_err() {
                continue;
            }
            match event.event_kind() {
                Some(EventKind::Hold) => self.is_held = true,
                Some(EventKind::Release) => self.is_held = false,
                Some(EventKind::Pause) => self.is_paused = true,
                Some(EventKind::Resume) => self.is_paused = false,
                Some(EventKind::Stop) => self.is_ending = true,
                Some(EventKind::Go) => self.goes.push(event.tick),
                Some(EventKind::Seek) => (has_sought, self.stand, self.arrived) = (true, None, event.tick),
                _ => {}
            }
            if !self.must_stand() {
                self.stand = None;
            }
        }
        if self.must_stand() && self.stand.is_none() {
            self.stand = Some([header.course_m, header.course_mps]);
        }
        has_sought
    }

    /// A head that must stand does not run, and rests within its braking distance.
    fn check_stand(&self, header: &FrameHeader, accel_mps2: Option<f64>) -> Result<(), Failure> {
        let Some([from_m, speed_mps]) = self.stand else { return Ok(()) };
        let braking_m = accel_mps2.map_or(0.0, |accel_mps2| 0.5 * speed_mps * speed_mps / accel_mps2);
        let moved_m = header.course_m - from_m;
        let stands = (-ROUNDING_M..=braking_m + ROUNDING_M).contains(&moved_m);
        let [is_held, is_paused, is_ending] = [self.is_held, self.is_paused, self.is_ending];
        require(Promise::StandsUntilRelease, stands, || {
            format!("the show moves {moved_m} m, held {is_held}, paused {is_paused}, ending {is_ending}: {header:?}")
        })?;
        require(Promise::StopsAreTrue, header.show_state() != Some(ShowState::Running), || {
            format!("the show runs, held {is_held}, paused {is_paused}, ending {is_ending}: {header:?}")
        })
    }
}
