//! Which packets are taken: those of one sender, and no flood. Pure: the present is an argument.

use std::net::IpAddr;

/// Keeps to one sender at a time: the first that is heard, until it has been silent for long enough to be lost.
///
/// A sender is a host: one that opens a socket for each message has another port each time.
#[derive(Clone, Copy, Debug)]
pub struct SenderLock {
    timeout_ns: u64,
    followed: Option<(IpAddr, u64)>,
}

impl SenderLock {
    /// Nobody is followed yet; silence of so many nanoseconds loses a sender.
    pub fn new(timeout_ns: u64) -> Self {
        Self { timeout_ns, followed: None }
    }

    /// Whether timecode that this sender sent, and that arrived now, is taken.
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

/// Length of the periods in which packets are counted, in nanoseconds.
pub(super) const PERIOD_NS: u64 = 100_000_000;
/// Timecodes, and packets that should be, of each period: some twenty times what a desk sends.
const MOST_TIMECODES: u32 = 200;
/// Packets about something else: on the port of Art-Net every desk of the house may send its light, a thousand universes at 44
/// frames a second.
const MOST_OTHERS: u32 = 5_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PacketKind {
    /// A timecode, or what should be one.
    Timecode,
    /// Something else, and sound.
    Other,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct FloodGuard {
    begun_ns: u64,
    timecodes: u32,
    others: u32,
}

impl FloodGuard {
    /// A guard whose first period begins now.
    pub(super) fn new(now_ns: u64) -> Self {
        Self { begun_ns: now_ns, timecodes: 0, others: 0 }
    }

    /// Counts a packet that arrived now. Where that was the last one that is looked at in this period: how long the rest of it
    /// is, in nanoseconds.
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
    fn a_flood_is_left_to_the_kernel_for_the_rest_of_its_period() {
        for (kind, most) in [(PacketKind::Timecode, MOST_TIMECODES), (PacketKind::Other, MOST_OTHERS)] {
            let mut flood_guard = FloodGuard::new(NOW_NS);
            assert_eq!(count(&mut flood_guard, kind, most - 1), None);
            assert_eq!(count(&mut flood_guard, kind, 1), Some(70_000_000));
            assert_eq!(flood_guard.count(kind, NOW_NS + PERIOD_NS), None, "the next period begins anew");
        }
    }

    /// A desk that plays DMX on the port of Art-Net sends 44 packets a second for each of its universes.
    #[test]
    fn the_light_of_a_whole_house_leaves_the_timecode_its_room() {
        let mut flood_guard = FloodGuard::new(NOW_NS);
        assert_eq!(count(&mut flood_guard, PacketKind::Other, MOST_OTHERS - 1), None);
        assert_eq!(count(&mut flood_guard, PacketKind::Timecode, MOST_TIMECODES - 1), None);
    }
}
