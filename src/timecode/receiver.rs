//! Taking timecode off a socket, on a thread of its own.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::inbox::{Inbox, Slot, inbox};
use super::{Admission, FrameRate, Sample, TimecodeSource};
use crate::clock::monotonic_ns;

/// More than any timecode has, and too little for bundles in bundles to do harm. What is longer is cut, and malformed.
const LONGEST_PACKET_BYTES: usize = 2048;
/// Packets that are looked at in each period; then the rest of it is slept through, and what comes meanwhile is the kernel's
/// to keep or to drop.
const PACKETS_PER_PERIOD: u32 = 200;
const PERIOD: Duration = Duration::from_millis(100);

/// What has come so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimecodeCounts {
    /// Timecodes that were taken.
    pub taken: u64,
    /// Packets that were no timecode and should have been.
    pub malformed: u64,
    /// Timecodes of others than the sender that was followed.
    pub of_others: u64,
    /// How often packets came so fast that they were left to the kernel for a while.
    pub floods: u64,
}

/// Why timecode cannot be received.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen for timecode on {listen}")]
pub struct ReceiverError {
    listen: SocketAddr,
    source: io::Error,
}

/// The running thread.
#[derive(Debug)]
pub struct Receiver {
    listen: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    taken: AtomicU64,
    malformed: AtomicU64,
    of_others: AtomicU64,
    floods: AtomicU64,
    is_over: AtomicBool,
}

impl Receiver {
    /// Binds the socket and begins to listen; the newest sample is in the inbox. Frames whose number a second is not told are of
    /// `rate`; a sender that is silent for `timeout_ns` gives way to another.
    ///
    /// # Errors
    /// Where the address is not this machine's, the port is taken or is not to be had.
    pub fn start(source: TimecodeSource, rate: FrameRate, timeout_ns: u64) -> Result<(Self, Inbox), ReceiverError> {
        let listen = source.listen();
        let failed = |source| ReceiverError { listen, source };
        let socket = UdpSocket::bind(listen).map_err(failed)?;
        socket.set_read_timeout(Some(PERIOD)).map_err(failed)?;
        let listen = socket.local_addr().map_err(failed)?;
        let (slot, inbox) = inbox();
        let shared = Arc::new(Shared::default());
        let admission = Admission::new(timeout_ns);
        let listening = Listening { socket, source, rate, admission, slot, shared: Arc::clone(&shared) };
        let thread = thread::Builder::new()
            .name("timecode".to_owned())
            .spawn(move || listening.run())
            .map_err(|source| ReceiverError { listen, source })?;
        Ok((Self { listen, shared, thread: Some(thread) }, inbox))
    }

    /// Where it listens.
    pub fn listen(&self) -> SocketAddr {
        self.listen
    }

    /// What has come so far.
    pub fn counts(&self) -> TimecodeCounts {
        let Shared { taken, malformed, of_others, floods, .. } = &*self.shared;
        let [taken, malformed, of_others, floods] =
            [taken, malformed, of_others, floods].map(|count| count.load(Ordering::Relaxed));
        TimecodeCounts { taken, malformed, of_others, floods }
    }
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        // It does not panic, and here nobody could be told.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// What the thread works with.
struct Listening {
    socket: UdpSocket,
    source: TimecodeSource,
    rate: FrameRate,
    admission: Admission,
    slot: Slot,
    shared: Arc<Shared>,
}

impl Listening {
    fn run(mut self) {
        let mut packet = [0; LONGEST_PACKET_BYTES + 1];
        let (mut begun_ns, mut packets) = (monotonic_ns(), 0);
        while !self.shared.is_over.load(Ordering::Relaxed) {
            // A failure is the silence that ends a wait, or the answer of a host that is none of ours.
            let Ok((length, sender)) = self.socket.recv_from(&mut packet) else { continue };
            let arrived_ns = monotonic_ns();
            self.take(&packet[..length], sender, arrived_ns);
            packets += 1;
            let period_ns = PERIOD.as_nanos() as u64;
            let elapsed_ns = arrived_ns.saturating_sub(begun_ns);
            if elapsed_ns >= period_ns {
                (begun_ns, packets) = (arrived_ns, 0);
            } else if packets >= PACKETS_PER_PERIOD {
                count(&self.shared.floods);
                thread::sleep(Duration::from_nanos(period_ns - elapsed_ns));
                (begun_ns, packets) = (monotonic_ns(), 0);
            }
        }
    }

    fn take(&mut self, packet: &[u8], sender: SocketAddr, arrived_ns: u64) {
        let position = if packet.len() > LONGEST_PACKET_BYTES {
            Err(super::Malformed)
        } else {
            self.source.position_s(packet, self.rate)
        };
        match position {
            Err(super::Malformed) => count(&self.shared.malformed),
            Ok(None) => {}
            Ok(Some(_)) if !self.admission.admits(sender.ip(), arrived_ns) => count(&self.shared.of_others),
            Ok(Some(position_s)) => {
                count(&self.shared.taken);
                self.slot.leave(Sample { position_s, arrived_ns });
            }
        }
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}
