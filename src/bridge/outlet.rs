//! Where packets leave: the packets of a frame, what takes them to a receiver, and when a failure is worth a message.

use std::io;

/// Takes packets to a receiver. It never waits for one for long, and reads nothing.
pub trait Outlet {
    /// Sends the packets of one frame, `now_ns` being the present of `CLOCK_MONOTONIC`.
    fn send(&mut self, packets: &Packets, now_ns: u64) -> Delivery;
}

/// What became of a frame's packets.
#[derive(Debug, Default)]
pub struct Delivery {
    /// Packets that were handed over to the network.
    pub packets: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Sends that failed.
    pub errors: u64,
    /// Whether the whole frame was left out because the receiver had not taken the one before it.
    pub dropped: bool,
    /// The first reason of a failure.
    pub trouble: Option<io::Error>,
}

impl Delivery {
    /// Counts one send.
    pub fn count(&mut self, len: usize, sent: io::Result<()>) {
        match sent {
            Ok(()) => {
                self.packets += 1;
                self.bytes += len as u64;
            }
            Err(error) => {
                self.errors += 1;
                self.trouble.get_or_insert(error);
            }
        }
    }
}

/// Most bytes of a datagram that an Ethernet of 1,500 bytes carries in one piece: less 20 of IP and 8 of UDP.
pub const MAX_PACKET_LEN: usize = 1_472;

/// Packets one behind the other in one buffer, which is kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Packets {
    bytes: Vec<u8>,
    ends: Vec<usize>,
}

impl Packets {
    /// Forgets all packets.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.ends.clear();
    }

    /// Adds the packet that `write` appends to the buffer.
    pub fn push(&mut self, write: impl FnOnce(&mut Vec<u8>)) {
        write(&mut self.bytes);
        self.ends.push(self.bytes.len());
    }

    /// The packets in their order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u8]> {
        (0..self.ends.len()).map(|index| {
            let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
            &self.bytes[start..self.ends[index]]
        })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
}

/// How long nothing may fail before the trouble counts as over. A host that refuses packets says so about once a second.
const CALM_NS: u64 = 3_000_000_000;

/// Follows whether sending works.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outage {
    last_failure_ns: u64,
    /// Since the outage began; 0 without one.
    failed_frames: u64,
}

/// What is to be reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutageChange {
    /// Sending has begun to fail.
    Began,
    /// Sending has worked for a while again.
    Ended {
        /// Frames that were not sent, or not all of them.
        failed_frames: u64,
    },
}

impl Outage {
    /// Takes note of one frame at `now_ns`. Returns what is to be reported.
    pub fn note(&mut self, failed: bool, now_ns: u64) -> Option<OutageChange> {
        if failed {
            self.last_failure_ns = now_ns;
            self.failed_frames += 1;
            return (self.failed_frames == 1).then_some(OutageChange::Began);
        }
        let is_over = self.failed_frames > 0 && now_ns.saturating_sub(self.last_failure_ns) >= CALM_NS;
        is_over.then(|| OutageChange::Ended { failed_frames: std::mem::take(&mut self.failed_frames) })
    }
}
