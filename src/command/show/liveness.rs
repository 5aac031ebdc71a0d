//! The liveness of a child: whether it gives signs of life, and when it is started again. Knows no process and no clock.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How long a child may be stopped, or a server without a frame, or another child without a sign of life while frames come.
pub(super) const LONGEST_SILENCE: Duration = Duration::from_secs(5);
/// The same of a recorder that is not stopped: its disk may stand still for a while.
pub(super) const LONGEST_DISK_SILENCE: Duration = Duration::from_secs(30);
/// How long a child may take to its first sign of life: a server waits ten seconds for its readers.
const LONGEST_START: Duration = Duration::from_secs(30);

/// The liveness of a child, over its restarts.
pub(super) struct Liveness {
    pub(super) phase: Phase,
    backoff: RestartBackoff,
    longest_silence: Duration,
    /// How long it has been stopped.
    stopped: Duration,
    /// Whether it has given a sign of life since it was started.
    pub(super) has_lived: bool,
}

/// Where a child stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// It has not been started yet, or it is to be killed.
    Idle,
    /// It has been started, or its frames have been interrupted, so long ago, without a sign of life since.
    Starting(Duration),
    /// It gave its last sign of life so long ago.
    Living(Duration),
    /// It has ended, and is to be started again.
    Due(Instant),
    /// It has ended, and waits for something that is missing, such as room on the disk. Its owner makes it due.
    Waiting,
    /// It has ended too often.
    Over,
}

/// What was seen of a child between two looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// The time between the looks.
    pub(super) elapsed: Duration,
    /// Whether the kernel has stopped it.
    pub(super) is_stopped: bool,
    /// Whether there was something of which it could give a sign of life.
    pub(super) has_occasion: bool,
}

impl Liveness {
    /// A child that has not been started. `longest_silence` is what a child that is not stopped is allowed.
    pub(super) fn new(longest_silence: Duration) -> Self {
        Self {
            phase: Phase::Idle,
            backoff: RestartBackoff::default(),
            longest_silence,
            stopped: Duration::ZERO,
            has_lived: false,
        }
    }

    pub(super) fn start(&mut self) {
        (self.phase, self.stopped, self.has_lived) = (Phase::Starting(Duration::ZERO), Duration::ZERO, false);
    }

    pub(super) fn hear(&mut self) {
        if matches!(self.phase, Phase::Starting(_) | Phase::Living(_)) {
            (self.phase, self.has_lived) = (Phase::Living(Duration::ZERO), true);
        }
    }

    /// The child has ended. Returns whether it is to be started again, and plans that.
    pub(super) fn end(&mut self, now: Instant) -> bool {
        let wait = self.backoff.after_end(now);
        self.phase = wait.map_or(Phase::Over, |wait| Phase::Due(now + wait));
        wait.is_some()
    }

    pub(super) fn is_due(&self, now: Instant) -> bool {
        matches!(self.phase, Phase::Due(at) if at <= now)
    }

    /// How long the child has been silent; `None` without a sign of life.
    pub(super) fn silence(&self) -> Option<Duration> {
        match self.phase {
            Phase::Living(silence) => Some(silence),
            _ => None,
        }
    }

    /// Takes note of a look at a running child. Returns the limit that it has overrun, once.
    pub(super) fn look(&mut self, look: Look) -> Option<Duration> {
        let Look { elapsed, is_stopped, has_occasion } = look;
        self.stopped = if is_stopped { self.stopped + elapsed } else { Duration::ZERO };
        let overrun = |silence, limit| (silence > limit).then_some(limit);
        let silent = match &mut self.phase {
            Phase::Idle | Phase::Due(_) | Phase::Waiting | Phase::Over => return None,
            phase if !has_occasion => {
                *phase = Phase::Starting(Duration::ZERO);
                None
            }
            Phase::Starting(silence) => {
                *silence += elapsed;
                overrun(*silence, LONGEST_START)
            }
            Phase::Living(silence) => {
                *silence += elapsed;
                overrun(*silence, self.longest_silence)
            }
        };
        let overrun = overrun(self.stopped, LONGEST_SILENCE).or(silent);
        if overrun.is_some() {
            self.phase = Phase::Idle;
        }
        overrun
    }
}

/// How often one child is started again within a window before the show goes on without it, or without a server ends.
pub(super) const MAX_RESTARTS: usize = 5;
/// The window: what was longer ago is forgotten, so that a show of many hours outlives now and then a crash.
pub(super) const WINDOW: Duration = Duration::from_mins(5);
/// How long the show waits before it starts a child again for the first time; twice as long each further time.
const FIRST_BACKOFF: Duration = Duration::from_millis(50);

/// When one child is started again.
#[derive(Debug, Default)]
pub(super) struct RestartBackoff {
    /// When it was started again within the window, oldest first.
    restarts: VecDeque<Instant>,
}

impl RestartBackoff {
    /// Takes note of an end at `now`, and says how long to wait before the child is started again; `None` where it has ended
    /// too often.
    pub(super) fn after_end(&mut self, now: Instant) -> Option<Duration> {
        while self.restarts.front().is_some_and(|&at| now.duration_since(at) > WINDOW) {
            self.restarts.pop_front();
        }
        if self.restarts.len() >= MAX_RESTARTS {
            return None;
        }
        let backoff = FIRST_BACKOFF * (1 << self.restarts.len());
        self.restarts.push_back(now);
        Some(backoff)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Duration = Duration::from_millis(100);
    const NEVER: [Duration; 0] = [];

    /// Looks ten times a second, for so long. Returns what limits were overrun.
    fn look(life: &mut Liveness, seconds: u32, is_heard: bool, look: Look) -> Vec<Duration> {
        (0..seconds * 10)
            .filter_map(|_| {
                if is_heard {
                    life.hear();
                }
                life.look(look)
            })
            .collect()
    }

    fn running() -> Look {
        Look { elapsed: LOOK, is_stopped: false, has_occasion: true }
    }

    fn started(longest_silence: Duration) -> Liveness {
        let mut life = Liveness::new(longest_silence);
        life.start();
        life
    }

    #[test]
    fn a_silent_child_overruns_its_limit_once() {
        let mut life = started(LONGEST_SILENCE);
        assert_eq!(look(&mut life, 20, true, running()), NEVER);
        assert_eq!(look(&mut life, 40, false, running()), [LONGEST_SILENCE]);
    }

    #[test]
    fn a_child_has_longer_to_its_first_sign_of_life() {
        let mut life = started(LONGEST_SILENCE);
        assert_eq!(look(&mut life, 29, false, running()), NEVER);
        assert!(!life.has_lived);
        assert_eq!(look(&mut life, 20, false, running()), [LONGEST_START]);
    }

    #[test]
    fn a_child_without_an_occasion_is_not_silent_and_has_time_to_find_the_next_one() {
        let mut life = started(LONGEST_SILENCE);
        assert_eq!(look(&mut life, 1, true, running()), NEVER);
        assert_eq!(look(&mut life, 100, false, Look { has_occasion: false, ..running() }), NEVER);
        assert_eq!(look(&mut life, 29, false, running()), NEVER);
        assert_eq!(look(&mut life, 1, true, running()), NEVER);
        assert_eq!(look(&mut life, 20, false, running()), [LONGEST_SILENCE]);
    }

    #[test]
    fn a_stopped_child_overruns_the_shorter_limit_at_any_time() {
        for longest_silence in [LONGEST_SILENCE, LONGEST_DISK_SILENCE] {
            for (is_heard, has_occasion) in [(false, false), (false, true), (true, true)] {
                let mut life = started(longest_silence);
                look(&mut life, 1, is_heard, running());
                let stopped = Look { is_stopped: true, has_occasion, ..running() };
                assert_eq!(look(&mut life, 20, false, stopped), [LONGEST_SILENCE]);
            }
        }
    }

    #[test]
    fn a_child_that_was_stopped_for_a_moment_lives() {
        let mut life = started(LONGEST_SILENCE);
        for _ in 0..5 {
            assert_eq!(look(&mut life, 4, false, Look { is_stopped: true, ..running() }), NEVER);
            assert_eq!(look(&mut life, 1, true, running()), NEVER);
        }
    }

    #[test]
    fn a_recorder_that_is_not_stopped_may_wait_for_its_disk() {
        let mut life = started(LONGEST_DISK_SILENCE);
        look(&mut life, 1, true, running());
        assert_eq!(look(&mut life, 29, false, running()), NEVER);
        assert_eq!(look(&mut life, 20, false, running()), [LONGEST_DISK_SILENCE]);
    }

    #[test]
    fn a_child_that_has_ended_is_due_after_its_backoff_and_in_the_end_over() {
        let mut life = Liveness::new(LONGEST_SILENCE);
        let mut now = Instant::now();
        life.start();
        while life.end(now) {
            assert!(!life.is_due(now) && life.phase != Phase::Over);
            assert_eq!(look(&mut life, 100, false, running()), NEVER, "it does not run");
            now += Duration::from_secs(1);
            assert!(life.is_due(now));
            life.start();
        }
        assert!(life.phase == Phase::Over && !life.is_due(now + Duration::from_hours(1)));
    }

    #[test]
    fn a_child_that_keeps_ending_is_started_again_ever_later_and_then_no_more() {
        let (mut backoff, now) = (RestartBackoff::default(), Instant::now());
        let waits_ms: Vec<u128> =
            (0..MAX_RESTARTS).map(|_| backoff.after_end(now).expect("its first ends").as_millis()).collect();
        assert_eq!(waits_ms, [50, 100, 200, 400, 800]);
        assert_eq!(backoff.after_end(now + WINDOW), None);
    }

    #[test]
    fn what_happened_long_ago_is_forgotten() {
        let (mut backoff, mut now) = (RestartBackoff::default(), Instant::now());
        for _ in 0..100 {
            assert_eq!(backoff.after_end(now), Some(FIRST_BACKOFF));
            now += WINDOW + Duration::from_nanos(1);
        }
    }

    #[test]
    fn an_end_falls_out_of_the_window_by_itself() {
        let (mut backoff, now) = (RestartBackoff::default(), Instant::now());
        let ends = [0, 100, 200, 299, 300].map(|second| now + Duration::from_secs(second));
        for end in ends {
            assert!(backoff.after_end(end).is_some());
        }
        assert_eq!(backoff.after_end(ends[4]), None);
        assert_eq!(backoff.after_end(now + Duration::from_secs(301)), Some(FIRST_BACKOFF * 16));
    }
}
