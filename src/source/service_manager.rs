//! What is reported to the service manager, where one has started the server and listens: systemd's `sd_notify(3)`.
//!
//! Without a `NOTIFY_SOCKET` in the environment all of this does nothing.

use std::time::{Duration, Instant};

use sd_notify::NotifyState;

/// How often the state of the show is reported to the service manager.
const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// Signs of life in the time that the service manager waits for one.
const SIGNS_A_WAIT: u32 = 4;

/// The service manager as the reporting thread sees it.
#[derive(Debug)]
pub(super) struct ServiceManager {
    sign_period: Option<Duration>,
    last_sign: Instant,
    last_status: Option<Instant>,
    last_beats: u64,
}

impl ServiceManager {
    pub(super) fn of_environment() -> Self {
        Self {
            sign_period: sd_notify::watchdog_enabled().map(|wait| wait / SIGNS_A_WAIT),
            last_sign: Instant::now(),
            last_status: None,
            last_beats: 0,
        }
    }

    /// Passes on that the loop lives, where its `beats` have moved on since the last time, and now and then how it stands.
    pub(super) fn look(&mut self, beats: u64, status: impl FnOnce() -> String) {
        let now = Instant::now();
        if self.takes_sign(beats, now) {
            tell(&NotifyState::Watchdog);
        }
        if self.last_status.is_none_or(|last| now - last >= STATUS_PERIOD) {
            tell(&NotifyState::Status(&status()));
            self.last_status = Some(now);
        }
    }

    /// Whether a sign of life is due, and the loop has given one.
    fn takes_sign(&mut self, beats: u64, now: Instant) -> bool {
        let is_due = self.sign_period.is_some_and(|period| now - self.last_sign >= period);
        let is_taken = is_due && beats != self.last_beats;
        if is_taken {
            (self.last_sign, self.last_beats) = (now, beats);
        }
        is_taken
    }
}

/// Tells that the services are there: clients can come.
pub(crate) fn ready() {
    tell(&NotifyState::Ready);
}

/// Tells that the server is ending.
pub(crate) fn stopping() {
    tell(&NotifyState::Stopping);
}

fn tell(state: &NotifyState<'_>) {
    // A service manager that does not listen is its own affair; it will say so where it misses something.
    let _ = sd_notify::notify(std::slice::from_ref(state));
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_secs(2);

    fn manager(sign_period: Option<Duration>) -> (ServiceManager, Instant) {
        let start = Instant::now();
        (ServiceManager { sign_period, last_sign: start, last_status: None, last_beats: 0 }, start)
    }

    #[test]
    fn a_loop_that_does_not_turn_gives_no_sign_of_life() {
        let (mut manager, start) = manager(Some(PERIOD));
        assert!(manager.takes_sign(1, start + PERIOD));
        assert!(!manager.takes_sign(1, start + 2 * PERIOD), "it stands");
        assert!(!manager.takes_sign(1, start + 9 * PERIOD), "it stands");
        assert!(manager.takes_sign(2, start + 9 * PERIOD), "it goes on");
    }

    #[test]
    fn signs_of_life_come_no_more_often_than_they_are_wanted() {
        let (mut manager, start) = manager(Some(PERIOD));
        assert!(!manager.takes_sign(1, start + PERIOD / 2));
        assert!(manager.takes_sign(2, start + PERIOD));
        assert!(!manager.takes_sign(3, start + PERIOD * 3 / 2));
    }

    #[test]
    fn nobody_who_does_not_ask_is_given_signs_of_life() {
        let (mut manager, start) = manager(None);
        assert!(!manager.takes_sign(1, start + 100 * PERIOD));
    }
}
