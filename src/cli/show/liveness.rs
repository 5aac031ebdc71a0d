//! The liveness of a child: whether it gives signs of life, and when it is restarted. Pure: without processes and clocks.

use std::time::{Duration, Instant};

/// Longest time for which a child may be stopped, a server may send no frame, or, while frames arrive, another child may give
/// no sign of life.
pub const LONGEST_SILENCE: Duration = Duration::from_secs(5);
/// Longest silence of a recorder that is not stopped. Its disk may block for some time.
pub const LONGEST_DISK_SILENCE: Duration = Duration::from_secs(30);
/// Longest time that counts between two looks. So a suspension of the show itself does not count as silence of the children.
pub const LONGEST_LOOK: Duration = Duration::from_millis(200);
/// Longest time between two frames. The lowest rate is 1 Hz.
const LONGEST_PERIOD: Duration = Duration::from_millis(1500);
/// Longest time from a child's start to its first sign of life. A server waits up to 25 seconds for its readers.
const LONGEST_START: Duration = Duration::from_secs(30);

/// The liveness of a child, over its restarts.
#[derive(Debug)]
pub struct Liveness {
    pub(super) phase: Phase,
    backoff: RestartBackoff,
    longest_silence: Duration,
    /// Time for which the child has been stopped.
    stopped: Duration,
    /// Whether the child has given a sign of life since its start.
    pub(super) has_lived: bool,
    /// Time since its start in which the child gave signs of life.
    lived: Duration,
}

/// The phase of a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The child has not been started yet, or the show is killing it.
    Idle,
    /// Time since the child's start, or since an interruption of the frames, without a sign of life.
    Starting(Duration),
    /// Time since the child's last sign of life.
    Living(Duration),
    /// The child has ended; instant of its restart.
    Due(Instant),
    /// The child has ended, and waits for a resource such as room on the disk. Its owner makes it due.
    Waiting,
    /// The child has ended too often.
    Over,
}

/// The observation of a child between two looks.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// The time between the looks.
    pub elapsed: Duration,
    /// Whether the child is stopped, as the kernel reports.
    pub is_stopped: bool,
    /// Whether the child had an occasion for a sign of life, such as frames.
    pub has_occasion: bool,
}

impl Liveness {
    /// A child that has not been started. `longest_silence` is the limit for a child that is not stopped, `most_restarts` the
    /// limit of its restarts in a row.
    pub fn new(longest_silence: Duration, most_restarts: Option<u32>) -> Self {
        Self {
            phase: Phase::Idle,
            backoff: RestartBackoff::new(most_restarts),
            longest_silence,
            stopped: Duration::ZERO,
            has_lived: false,
            lived: Duration::ZERO,
        }
    }

    /// Notes the start of the child.
    pub fn start(&mut self) {
        (self.phase, self.has_lived) = (Phase::Starting(Duration::ZERO), false);
        (self.stopped, self.lived) = (Duration::ZERO, Duration::ZERO);
    }

    /// Notes a sign of life.
    pub fn hear(&mut self) {
        if matches!(self.phase, Phase::Starting(_) | Phase::Living(_)) {
            (self.phase, self.has_lived) = (Phase::Living(Duration::ZERO), true);
        }
    }

    /// Notes the end of the child, and plans its restart. Returns the delay before it; `None` if the child has ended too
    /// often.
    pub fn end(&mut self, now: Instant) -> Option<Duration> {
        let wait = self.backoff.after_end(std::mem::take(&mut self.lived));
        self.phase = wait.map_or(Phase::Over, |wait| Phase::Due(now + wait));
        wait
    }

    /// The phase of the child.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Lets a child that has ended wait for a resource.
    pub fn wait(&mut self) {
        self.phase = Phase::Waiting;
    }

    /// Plans the restart of a waiting child for now. Returns whether it has waited.
    pub fn end_wait(&mut self, now: Instant) -> bool {
        let has_waited = self.phase == Phase::Waiting;
        if has_waited {
            self.phase = Phase::Due(now);
        }
        has_waited
    }

    /// Whether the restart of the child is due.
    pub fn is_due(&self, now: Instant) -> bool {
        matches!(self.phase, Phase::Due(at) if at <= now)
    }

    /// Time since the last sign of life; `None` unless the child is in [`Phase::Living`].
    pub fn silence(&self) -> Option<Duration> {
        match self.phase {
            Phase::Living(silence) => Some(silence),
            _ => None,
        }
    }

    /// Whether this child, a server, sends frames.
    pub fn sends_frames(&self) -> bool {
        self.silence().is_some_and(|silence| silence < LONGEST_PERIOD)
    }

    /// Notes a look at a running child. Returns the limit that the child has exceeded, once.
    pub fn look(&mut self, look: Look) -> Option<Duration> {
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
                self.lived += elapsed;
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

/// Most restarts of one child in a row at a rehearsal: the last one comes some 80 seconds after the first end. After one more
/// end the show goes on without the child, or fails if the child is vital. A performance never gives up.
pub const MAX_RESTARTS: u32 = 11;
/// Delay before the first restart of a child. Each further restart in a row doubles it, up to [`LONGEST_BACKOFF`].
const FIRST_BACKOFF: Duration = Duration::from_millis(50);
/// Longest delay before a restart.
pub(super) const LONGEST_BACKOFF: Duration = Duration::from_secs(30);
/// Time with signs of life after which the restarts in a row begin anew. So a long show survives occasional crashes.
const LONG_LIFE: Duration = Duration::from_mins(1);

/// The delays before the restarts of one child.
#[derive(Debug)]
pub(super) struct RestartBackoff {
    /// Most restarts in a row; `None` for any number.
    most: Option<u32>,
    in_a_row: u32,
}

impl RestartBackoff {
    fn new(most: Option<u32>) -> Self {
        Self { most, in_a_row: 0 }
    }

    /// Notes the end of a child that gave signs of life for this time. Returns the delay before its restart; `None` if the
    /// child has ended too often.
    fn after_end(&mut self, lived: Duration) -> Option<Duration> {
        if lived >= LONG_LIFE {
            self.in_a_row = 0;
        }
        if self.most.is_some_and(|most| self.in_a_row >= most) {
            return None;
        }
        let doubled = 1_u32.checked_shl(self.in_a_row).unwrap_or(u32::MAX);
        self.in_a_row = self.in_a_row.saturating_add(1);
        Some(FIRST_BACKOFF.saturating_mul(doubled).min(LONGEST_BACKOFF))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Duration = Duration::from_millis(100);
    const NEVER: [Duration; 0] = [];

    /// Looks ten times a second for this number of seconds. Returns the exceeded limits.
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
        let mut life = Liveness::new(longest_silence, Some(MAX_RESTARTS));
        life.start();
        life
    }

    #[test]
    fn a_silent_child_exceeds_its_limit_once() {
        let mut life = started(LONGEST_SILENCE);
        assert_eq!(look(&mut life, 20, true, running()), NEVER);
        assert_eq!(look(&mut life, 40, false, running()), [LONGEST_SILENCE]);
    }

    #[test]
    fn a_limit_is_exceeded_only_after_it() {
        let living = || {
            let mut life = started(LONGEST_DISK_SILENCE);
            life.hear();
            life
        };
        let stopped = Look { is_stopped: true, ..running() };
        for (mut life, looks, limit) in [
            (started(LONGEST_SILENCE), running(), LONGEST_START),
            (living(), running(), LONGEST_DISK_SILENCE),
            (living(), stopped, LONGEST_SILENCE),
        ] {
            assert_eq!(look(&mut life, limit.as_secs() as u32, false, looks), NEVER);
            assert_eq!(look(&mut life, 1, false, looks), [limit]);
        }
    }

    #[test]
    fn a_server_sends_frames_until_one_is_late() {
        let mut life = started(LONGEST_SILENCE);
        assert_eq!((life.silence(), life.sends_frames()), (None, false), "before the first frame");
        life.hear();
        let just_before = LONGEST_PERIOD.checked_sub(LOOK).expect("a look is shorter");
        assert_eq!((life.silence(), life.sends_frames()), (Some(Duration::ZERO), true));
        life.look(Look { elapsed: just_before, ..running() });
        assert_eq!((life.silence(), life.sends_frames()), (Some(just_before), true));
        life.look(running());
        assert_eq!((life.silence(), life.sends_frames()), (Some(LONGEST_PERIOD), false));
    }

    #[test]
    fn a_child_that_waits_for_a_resource_is_due_when_its_owner_ends_the_wait() {
        let (mut life, earlier) = (started(LONGEST_SILENCE), Instant::now());
        let now = earlier + LOOK;
        assert!(!life.end_wait(now), "it runs");
        assert_eq!(life.phase(), Phase::Starting(Duration::ZERO));
        life.wait();
        assert!(life.phase() == Phase::Waiting && !life.is_due(now + LONGEST_BACKOFF));
        assert!(life.end_wait(now) && life.is_due(now) && !life.is_due(earlier));
        assert!(!life.end_wait(now), "it no longer waits");
    }

    #[test]
    fn a_child_has_longer_to_its_first_sign_of_life() {
        let mut life = started(LONGEST_SILENCE);
        assert_eq!(look(&mut life, 29, false, running()), NEVER);
        assert!(!life.has_lived);
        assert_eq!(look(&mut life, 20, false, running()), [LONGEST_START]);
    }

    #[test]
    fn a_child_without_frames_is_not_silent_and_has_the_start_limit_afterwards() {
        let mut life = started(LONGEST_SILENCE);
        assert_eq!(look(&mut life, 1, true, running()), NEVER);
        assert_eq!(look(&mut life, 100, false, Look { has_occasion: false, ..running() }), NEVER);
        assert_eq!(look(&mut life, 29, false, running()), NEVER);
        assert_eq!(look(&mut life, 1, true, running()), NEVER);
        assert_eq!(look(&mut life, 20, false, running()), [LONGEST_SILENCE]);
    }

    #[test]
    fn a_stopped_child_exceeds_the_shorter_limit_at_any_time() {
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
    fn a_child_that_was_stopped_briefly_is_alive() {
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
    fn an_ended_child_is_due_after_its_backoff_and_after_too_many_ends_over() {
        let mut life = started(LONGEST_SILENCE);
        let mut now = Instant::now();
        while let Some(wait) = life.end(now) {
            assert!(!life.is_due(now) && life.phase != Phase::Over);
            assert_eq!(look(&mut life, 100, false, running()), NEVER, "it does not run");
            now += wait;
            assert!(life.is_due(now));
            life.start();
        }
        assert!(life.phase == Phase::Over && !life.is_due(now + Duration::from_hours(1)));
    }

    const SHORT: Duration = Duration::from_secs(59);

    #[test]
    fn a_child_that_keeps_ending_restarts_after_doubling_delays_and_then_never() {
        let mut backoff = RestartBackoff::new(Some(MAX_RESTARTS));
        let waits: Vec<Duration> = std::iter::from_fn(|| backoff.after_end(SHORT)).collect();
        let waits_ms: Vec<u128> = waits.iter().map(Duration::as_millis).collect();
        assert_eq!(waits_ms, [50, 100, 200, 400, 800, 1600, 3200, 6400, 12_800, 25_600, 30_000]);
        assert!(waits.iter().sum::<Duration>() > Duration::from_mins(1), "an outage of a minute is survived");
        assert_eq!(backoff.after_end(Duration::ZERO), None);
    }

    #[test]
    fn a_child_of_a_performance_restarts_for_ever_with_the_longest_delay() {
        let mut backoff = RestartBackoff::new(None);
        let waits: Vec<Duration> = (0..1000).filter_map(|_| backoff.after_end(SHORT)).collect();
        assert_eq!((waits.len(), waits[0]), (1000, FIRST_BACKOFF));
        assert!(waits[10..].iter().all(|wait| *wait == LONGEST_BACKOFF));
    }

    #[test]
    fn after_a_long_life_the_delays_begin_anew() {
        let mut backoff = RestartBackoff::new(Some(MAX_RESTARTS));
        for _ in 0..MAX_RESTARTS {
            assert!(backoff.after_end(SHORT).is_some());
        }
        for _ in 0..100 {
            assert_eq!(backoff.after_end(LONG_LIFE), Some(FIRST_BACKOFF));
        }
    }

    #[test]
    fn only_time_with_signs_of_life_makes_a_life_long() {
        for (seconds, is_heard, has_occasion, last_ms) in
            [(60, true, true, 50), (29, false, true, 100), (120, false, false, 100)]
        {
            let mut life = started(LONGEST_DISK_SILENCE);
            assert_eq!(life.end(Instant::now()), Some(FIRST_BACKOFF));
            life.start();
            assert_eq!(look(&mut life, seconds, is_heard, Look { has_occasion, ..running() }), NEVER);
            assert_eq!(life.end(Instant::now()), Some(Duration::from_millis(last_ms)), "{seconds} s");
        }
    }
}
