//! Where packets leave.

use std::io;

use super::packets::Packets;

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
