//! Filter of packets: admits one sender, and limits floods. Pure: the present is an argument.

use std::net::IpAddr;

/// Admits one sender at a time: the first one, until it has been silent for the timeout.
///
/// A sender is a host, without its port: some programs open a new socket for each message.
#[derive(Clone, Copy, Debug)]
pub struct SenderLock {
    timeout_ns: u64,
    followed: Option<(IpAddr, u64)>,
}

impl SenderLock {
    /// Creates a lock without a sender. A sender loses the lock after a silence of `timeout_ns`.
    pub fn new(timeout_ns: u64) -> Self {
        Self { timeout_ns, followed: None }
    }

    /// Whether to accept timecode of this sender that arrives now.
    pub fn admits(&mut self, sender: IpAddr, now_ns: u64) -> bool {
        let is_other = self.followed.is_some_and(|(followed, heard_ns)| {
            followed != sender && now_ns.saturating_sub(heard_ns) <= self.timeout_ns
        });
        if !is_other {
            self.followed = Some((sender, now_ns));
        }
        !is_other
    }
}

/// Length of the counting periods, in nanoseconds.
pub(super) const PERIOD_NS: u64 = 100_000_000;
/// Greatest number of timecodes, valid or malformed, in a period: about twenty times the rate of a desk.
const MOST_TIMECODES: u32 = 200;
/// Greatest number of other packets in a period. On the Art-Net port every desk of a venue may send DMX: a thousand
/// universes at 44 frames a second.
const MOST_OTHERS: u32 = 5_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PacketKind {
    /// A timecode, valid or malformed.
    Timecode,
    /// A valid packet of other content.
    Other,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct FloodGuard {
    begun_ns: u64,
    timecodes: u32,
    others: u32,
}

impl FloodGuard {
    /// Creates a guard whose first period begins now.
    pub(super) fn new(now_ns: u64) -> Self {
        Self { begun_ns: now_ns, timecodes: 0, others: 0 }
    }

    /// Counts a packet that arrives now. When the limit of the period is reached, returns the rest of the period in
    /// nanoseconds.
    pub(super) fn count(&mut self, kind: PacketKind, now_ns: u64) -> Option<u64> {
        if now_ns.saturating_sub(self.begun_ns) >= PERIOD_NS {
            *self = Self::new(now_ns);
        }
        match kind {
            PacketKind::Timecode => self.timecodes += 1,
            PacketKind::Other => self.others += 1,
        }
        let is_full = self.timecodes >= MOST_TIMECODES || self.others >= MOST_OTHERS;
        is_full.then(|| (self.begun_ns + PERIOD_NS).saturating_sub(now_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW_NS: u64 = 5_000_000_000;

    fn count(flood_guard: &mut FloodGuard, kind: PacketKind, packets: u32) -> Option<u64> {
        (0..packets).find_map(|_| flood_guard.count(kind, NOW_NS + 30_000_000))
    }

    #[test]
    fn a_flood_stops_the_receiver_for_the_rest_of_the_period() {
        for (kind, most) in [(PacketKind::Timecode, MOST_TIMECODES), (PacketKind::Other, MOST_OTHERS)] {
            let mut flood_guard = FloodGuard::new(NOW_NS);
            assert_eq!(count(&mut flood_guard, kind, most - 1), None);
            assert_eq!(count(&mut flood_guard, kind, 1), Some(70_000_000));
            assert_eq!(flood_guard.count(kind, NOW_NS + PERIOD_NS), None, "a new period begins");
        }
    }

    /// A desk that sends DMX on the Art-Net port sends 44 packets a second for each of its universes.
    #[test]
    fn dmx_of_a_whole_venue_does_not_use_up_the_limit_of_timecodes() {
        let mut flood_guard = FloodGuard::new(NOW_NS);
        assert_eq!(count(&mut flood_guard, PacketKind::Other, MOST_OTHERS - 1), None);
        assert_eq!(count(&mut flood_guard, PacketKind::Timecode, MOST_TIMECODES - 1), None);
    }
}
