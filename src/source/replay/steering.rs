//! The requests of clients to a replay.

use bench_dragon_ipc::{Refusal, Request};

use super::RATE;

/// The state of a replay that clients control.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steering {
    pub(super) is_stopped: bool,
    pub(super) is_paused: bool,
    /// Recorded seconds per second.
    pub(super) pace: f64,
    /// Position to seek, in nanoseconds.
    pub(super) sought_ns: Option<u64>,
    /// Number of accepted requests, so that a waiting replay notices them.
    pub(super) changes: u64,
}

impl Steering {
    pub(super) fn new(is_paused: bool, pace: f64) -> Self {
        Self { is_stopped: false, is_paused, pace, sought_ns: None, changes: 0 }
    }

    /// Takes a request of a client. A position beyond the end of the recording, which is `length_ns` long, is its end.
    pub(super) fn take(&mut self, request: Request, length_ns: u64) -> Result<(), Refusal> {
        match request {
            Request::Stop => self.is_stopped = true,
            Request::Pause => self.is_paused = true,
            Request::Resume => self.is_paused = false,
            Request::Seek { show_time_s } if show_time_s.is_nan() => {
                return Err(Refusal::OutOfRange { lowest: 0.0, highest: length_ns as f64 / 1e9 });
            }
            Request::Seek { show_time_s } => self.sought_ns = Some(((show_time_s * 1e9) as u64).min(length_ns)),
            Request::Pace { factor } if RATE.contains(&factor) => self.pace = factor,
            Request::Pace { .. } => {
                return Err(Refusal::OutOfRange { lowest: *RATE.start(), highest: *RATE.end() });
            }
            Request::Speed { .. } | Request::Hold | Request::Release | Request::Go | Request::Grant { .. } => {
                return Err(Refusal::Replayed);
            }
        }
        self.changes += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seek_stays_in_the_recording_and_a_pace_in_its_range() {
        let mut steering = Steering::new(false, 1.0);
        for (show_time_s, sought_ns) in
            [(-3.0, 0), (1.5, 1_500_000_000), (99.0, 2_000_000_000), (f64::INFINITY, 2_000_000_000)]
        {
            assert_eq!(steering.take(Request::Seek { show_time_s }, 2_000_000_000), Ok(()));
            assert_eq!(steering.sought_ns, Some(sought_ns));
        }
        let refused = Err(Refusal::OutOfRange { lowest: 0.01, highest: 100.0 });
        for factor in [0.0, -1.0, 100.1, f64::NAN] {
            assert_eq!(steering.take(Request::Pace { factor }, 0), refused);
        }
        assert_eq!((steering.take(Request::Pace { factor: 4.0 }, 0), steering.pace), (Ok(()), 4.0));
        assert!(steering.take(Request::Seek { show_time_s: f64::NAN }, 0).is_err());
        assert_eq!(steering.take(Request::Speed { speed_mps: 1.0 }, 0), Err(Refusal::Replayed));
    }
}
