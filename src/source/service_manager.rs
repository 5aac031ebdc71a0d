//! Reports to the service manager that started the server: systemd's `sd_notify(3)`.
//!
//! Without `NOTIFY_SOCKET` in the environment, these functions do nothing.

use std::time::{Duration, Instant};

use sd_notify::NotifyState;

/// Period of the reports of the show's state.
const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// Signs of life in each watchdog interval of the service manager.
const SIGNS_PER_INTERVAL: u32 = 4;

/// The reporting thread's connection to the service manager.
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
            sign_period: sd_notify::watchdog_enabled().map(|wait| wait / SIGNS_PER_INTERVAL),
            last_sign: Instant::now(),
            last_status: None,
            last_beats: 0,
        }
    }

    /// Sends a sign of life if one is due and `beats` has increased since the last one. Sends the show's state once a
    /// second.
    pub(super) fn look(&mut self, beats: u64, status: impl FnOnce() -> String) {
        let now = Instant::now();
        if self.takes_sign(beats, now) {
            notify(&NotifyState::Watchdog);
        }
        if self.last_status.is_none_or(|last| now - last >= STATUS_PERIOD) {
            notify(&NotifyState::Status(&status()));
            self.last_status = Some(now);
        }
    }

    /// Whether a sign of life is due and the loop has turned since the last one.
    fn takes_sign(&mut self, beats: u64, now: Instant) -> bool {
        let is_due = self.sign_period.is_some_and(|period| now - self.last_sign >= period);
        let is_taken = is_due && beats != self.last_beats;
        if is_taken {
            (self.last_sign, self.last_beats) = (now, beats);
        }
        is_taken
    }
}

/// Reports that the services exist and clients can connect.
pub(crate) fn ready() {
    notify(&NotifyState::Ready);
}

/// Reports that the server is ending.
pub(crate) fn stopping() {
    notify(&NotifyState::Stopping);
}

fn notify(state: &NotifyState<'_>) {
    // A failed report is not an error of the show. A service manager that misses a sign of life reports it.
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
    fn a_stopped_loop_gives_no_sign_of_life() {
        let (mut manager, start) = manager(Some(PERIOD));
        assert!(manager.takes_sign(1, start + PERIOD));
        assert!(!manager.takes_sign(1, start + 2 * PERIOD), "the loop has stopped");
        assert!(!manager.takes_sign(1, start + 9 * PERIOD), "the loop has stopped");
        assert!(manager.takes_sign(2, start + 9 * PERIOD), "the loop turns again");
    }

    #[test]
    fn signs_of_life_keep_their_period() {
        let (mut manager, start) = manager(Some(PERIOD));
        assert!(!manager.takes_sign(1, start + PERIOD / 2));
        assert!(manager.takes_sign(2, start + PERIOD));
        assert!(!manager.takes_sign(3, start + PERIOD * 3 / 2));
    }

    #[test]
    fn without_a_watchdog_there_are_no_signs_of_life() {
        let (mut manager, start) = manager(None);
        assert!(!manager.takes_sign(1, start + 100 * PERIOD));
    }
}
