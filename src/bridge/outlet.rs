//! Sending of packets: the packets of a frame, the trait of the senders, and the reporting of failed sends.

use std::io;

/// Sends packets to a receiver. An implementation blocks for a bounded time only, and reads nothing.
pub trait Outlet {
    /// Sends the packets of one frame. `now_ns` is the current time of `CLOCK_MONOTONIC`.
    fn send(&mut self, packets: &Packets, now_ns: u64) -> Delivery;
}

/// The result of sending one frame's packets.
#[derive(Debug, Default)]
pub struct Delivery {
    /// Packets passed to the network.
    pub packets: u64,
    /// Bytes passed to the network.
    pub bytes: u64,
    /// Sends that failed.
    pub errors: u64,
    /// Whether the whole frame was dropped because the receiver had not accepted all of the previous frame.
    pub is_dropped: bool,
    /// The first error.
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

/// Longest datagram in bytes that fits unfragmented into an Ethernet frame: 1,500 less 20 for IP and 8 for UDP.
pub const MAX_PACKET_LEN: usize = 1_472;

/// Packets stored one after another in one buffer. The buffer is reused from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Packets {
    bytes: Vec<u8>,
    ends: Vec<usize>,
}

impl Packets {
    /// Removes all packets.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.ends.clear();
    }

    /// Adds a packet: the bytes that `write` appends to the buffer.
    pub fn push(&mut self, write: impl FnOnce(&mut Vec<u8>)) {
        write(&mut self.bytes);
        self.ends.push(self.bytes.len());
    }

    /// The packets in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u8]> {
        (0..self.ends.len()).map(|index| {
            let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
            &self.bytes[start..self.ends[index]]
        })
    }

    /// Number of packets.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are no packets.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
}

/// An outage ends after this time without a failure. A host that rejects packets reports it only about once a second.
const CALM_NS: u64 = 3_000_000_000;

/// Detects the beginning and the end of a period in which sending fails.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outage {
    last_failure_ns: u64,
    /// Frames that failed since the outage began; 0 without an outage.
    failed_frames: u64,
}

/// A change that the bridge reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutageChange {
    /// Sending has begun to fail.
    Began,
    /// Sending has worked again for three seconds.
    Ended {
        /// Frames that were not sent, or only in part.
        failed_frames: u64,
    },
}

impl Outage {
    /// Records the result of one frame at `now_ns`. Returns a change that has to be reported, if any.
    pub fn note(&mut self, has_failed: bool, now_ns: u64) -> Option<OutageChange> {
        if has_failed {
            self.last_failure_ns = now_ns;
            self.failed_frames += 1;
            return (self.failed_frames == 1).then_some(OutageChange::Began);
        }
        let is_over = self.failed_frames > 0 && now_ns.saturating_sub(self.last_failure_ns) >= CALM_NS;
        is_over.then(|| OutageChange::Ended { failed_frames: std::mem::take(&mut self.failed_frames) })
    }
}
