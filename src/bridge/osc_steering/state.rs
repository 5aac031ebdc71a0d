//! The state of the show for desks, and its receivers. Pure: the time is an argument.

use std::net::SocketAddr;

use bench_dragon_ipc::ShowState;

use crate::bridge::LatestFrame;

/// The state before the first frame.
const NONE: &str = "none";
/// The state while the server is silent.
const SILENT: &str = "silent";

/// The state of the show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ShowReport {
    /// The name of the state, `none` before the first frame, or `silent` if none arrive.
    pub(super) state: &'static str,
    pub(super) show_time_s: f64,
    /// Speed of the (leading) head in metres per second of wall time.
    pub(super) speed_mps: f64,
    pub(super) tick: u64,
}

impl ShowReport {
    pub(super) const NONE: Self = Self { state: NONE, show_time_s: 0.0, speed_mps: 0.0, tick: 0 };

    /// The same while nobody knows more.
    pub(super) fn silent(self) -> Self {
        Self { state: SILENT, speed_mps: 0.0, ..self }
    }

    pub(super) fn of(latest: &LatestFrame) -> Self {
        let header = &latest.header;
        let state =
            if latest.freshness.is_fresh() { header.show_state().map_or("unknown", ShowState::name) } else { SILENT };
        let speed_mps = header.head_speed_mps * latest.speed_factor();
        Self { state, show_time_s: header.show_time_s(), speed_mps, tick: header.tick }
    }
}

/// Greatest number of senders that get the state.
const MAX_SENDERS: usize = 32;
/// Time after a sender's last message in which it gets the state.
const SENDER_NS: u64 = 60_000_000_000;
/// Time between two messages about an unchanged state.
const PERIOD_NS: u64 = 1_000_000_000;

/// The receivers of the state, and when it is due.
#[derive(Debug)]
pub(super) struct StateReceivers {
    fixed: Vec<SocketAddr>,
    /// Senders of commands, each with the instant of its last message.
    senders: Vec<(SocketAddr, u64)>,
    /// The state that was sent last, and when.
    last: Option<(&'static str, u64)>,
}

impl StateReceivers {
    /// Returns receivers that always get the state.
    pub(super) fn new(fixed: Vec<SocketAddr>) -> Self {
        Self { fixed, senders: Vec::new(), last: None }
    }

    /// Adds the sender of a message. If there are too many, it replaces the one that has been silent the longest.
    pub(super) fn note(&mut self, sender: SocketAddr, now_ns: u64) {
        self.senders.retain(|(known, heard_ns)| *known != sender && now_ns.saturating_sub(*heard_ns) <= SENDER_NS);
        if self.senders.len() == MAX_SENDERS {
            // The order is that of the last messages.
            self.senders.remove(0);
        }
        self.senders.push((sender, now_ns));
    }

    /// The receivers, if the state has changed or a second has passed.
    pub(super) fn due(&mut self, report: &ShowReport, now_ns: u64) -> Vec<SocketAddr> {
        let is_due = self
            .last
            .is_none_or(|(state, sent_ns)| state != report.state || now_ns.saturating_sub(sent_ns) >= PERIOD_NS);
        if !is_due {
            return Vec::new();
        }
        self.last = Some((report.state, now_ns));
        self.present(now_ns).collect()
    }

    /// All receivers.
    pub(super) fn present(&mut self, now_ns: u64) -> impl Iterator<Item = SocketAddr> {
        self.senders.retain(|(_, heard_ns)| now_ns.saturating_sub(*heard_ns) <= SENDER_NS);
        let senders = self.senders.iter().map(|(sender, _)| *sender).filter(|sender| !self.fixed.contains(sender));
        self.fixed.iter().copied().chain(senders)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    fn address(port: u16) -> SocketAddr {
        ([10, 0, 0, 7], port).into()
    }

    fn report(state: &'static str) -> ShowReport {
        ShowReport { state, ..ShowReport::NONE }
    }

    #[test]
    fn the_state_is_due_at_each_change_and_once_a_second() {
        let mut receivers = StateReceivers::new(vec![address(1)]);
        let sent = [
            ("running", 0, 1),
            ("running", 1, 0),
            ("held", 2, 1),
            ("held", SECOND_NS + 1, 0),
            ("held", SECOND_NS + 2, 1),
        ];
        for (state, now_ns, count) in sent {
            assert_eq!(receivers.due(&report(state), now_ns).len(), count, "{state} at {now_ns}");
        }
    }

    #[test]
    fn a_sender_gets_the_state_once_for_a_minute_after_its_last_message() {
        let mut receivers = StateReceivers::new(vec![address(1)]);
        for (sender, now_ns) in [(2, 0), (1, 0), (3, 0), (2, 30 * SECOND_NS)] {
            receivers.note(address(sender), now_ns);
        }
        assert_eq!(receivers.due(&report("held"), 60 * SECOND_NS), [1, 3, 2].map(address));
        assert_eq!(receivers.due(&report("held"), 90 * SECOND_NS), [1, 2].map(address));
        assert_eq!(receivers.due(&report("held"), 91 * SECOND_NS), [address(1)]);
    }

    #[test]
    fn the_newest_senders_stay() {
        let mut receivers = StateReceivers::new(Vec::new());
        for port in 0..100 {
            receivers.note(address(port), u64::from(port));
        }
        let ports: Vec<u16> = receivers.due(&report("held"), 200).iter().map(SocketAddr::port).collect();
        assert_eq!(ports, (68..100).collect::<Vec<_>>());
    }
}
