//! Receiver of timecode: a thread reads a socket and passes samples to the loop through a queue.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rtrb::{Consumer, Producer, RingBuffer};
use serde::{Deserialize, Serialize};

use super::packet_filter::{FloodGuard, PacketKind, SenderLock};
use super::{FrameRate, Malformed, TimecodeSample, TimecodeSource};
use crate::system::clock::monotonic_ns;

/// Greatest length of a packet: more than any timecode needs, too little for harmful nesting of bundles. A longer
/// packet is malformed.
const LONGEST_PACKET_BYTES: usize = 2048;
/// Period at which an idle thread checks whether to end.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// Counters of a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimecodeCounts {
    /// Timecodes passed to the loop.
    pub taken: u64,
    /// Packets that should contain a timecode and do not.
    pub malformed: u64,
    /// Timecodes from senders other than the followed one.
    pub of_others: u64,
    /// Number of times that packets came too fast, so that the receiver stopped reading for the rest of a period.
    pub floods: u64,
}

/// Reason why timecode cannot be received.
#[derive(Debug, thiserror::Error)]
pub enum ReceiverError {
    /// Another program uses the port.
    #[error(
        "cannot listen for timecode on {listen}: another program uses this port; end that program or send the \
         timecode to another port"
    )]
    Busy {
        /// Address to listen on.
        listen: SocketAddr,
    },
    /// The address does not belong to this machine, or the port is not available.
    #[error("cannot listen for timecode on {listen}")]
    Failed {
        /// Address to listen on.
        listen: SocketAddr,
        /// The kernel's error.
        source: io::Error,
    },
}

/// A running receiver. Dropping it ends its thread.
#[derive(Debug)]
pub struct TimecodeReceiver {
    /// Address that the receiver listens on.
    pub listen: SocketAddr,
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

impl TimecodeReceiver {
    /// Binds the socket and starts to receive; samples go to the queue. `rate` applies to frames of packets that do not
    /// contain a rate. After a silence of `timeout_ns` the receiver follows another sender.
    ///
    /// # Errors
    /// Another program uses the port, the address does not belong to this machine, or the port is not available.
    pub fn start(
        source: TimecodeSource,
        rate: FrameRate,
        timeout_ns: u64,
    ) -> Result<(Self, SampleQueue), ReceiverError> {
        let listen = source.listen;
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => ReceiverError::Busy { listen },
            _ => ReceiverError::Failed { listen, source },
        };
        let socket = UdpSocket::bind(listen).map_err(failed)?;
        socket.set_read_timeout(Some(LOOK_PERIOD)).map_err(failed)?;
        let listen = socket.local_addr().map_err(failed)?;
        let (samples, inbox) = SampleQueue::with_sender();
        let shared = Arc::new(Shared::default());
        let sender_lock = SenderLock::new(timeout_ns);
        let listening = Listening { socket, source, rate, sender_lock, samples, shared: Arc::clone(&shared) };
        let thread =
            thread::Builder::new().name("timecode".to_owned()).spawn(move || listening.run()).map_err(failed)?;
        Ok((Self { listen, shared, thread: Some(thread) }, inbox))
    }

    /// The present counters.
    pub fn counts(&self) -> TimecodeCounts {
        let Shared { taken, malformed, of_others, floods, .. } = &*self.shared;
        let [taken, malformed, of_others, floods] =
            [taken, malformed, of_others, floods].map(|count| count.load(Ordering::Relaxed));
        TimecodeCounts { taken, malformed, of_others, floods }
    }
}

impl Drop for TimecodeReceiver {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        // The thread does not panic, and an error could not be reported here.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

struct Listening {
    socket: UdpSocket,
    source: TimecodeSource,
    rate: FrameRate,
    sender_lock: SenderLock,
    samples: Producer<TimecodeSample>,
    shared: Arc<Shared>,
}

impl Listening {
    fn run(mut self) {
        let mut packet = [0; LONGEST_PACKET_BYTES + 1];
        let mut flood_guard = FloodGuard::new(monotonic_ns());
        while !self.shared.is_over.load(Ordering::Relaxed) {
            // An error is the read timeout, or an ICMP error from some host. Both are ignored.
            let Ok((length, sender)) = self.socket.recv_from(&mut packet) else { continue };
            let arrived_ns = monotonic_ns();
            let kind = self.take(&packet[..length], sender, arrived_ns);
            if let Some(rest_ns) = flood_guard.count(kind, arrived_ns) {
                // Until the end of the period the kernel buffers or drops packets.
                count(&self.shared.floods);
                thread::sleep(Duration::from_nanos(rest_ns));
            }
        }
    }

    /// Decodes a packet, counts it, and queues its timecode. Returns the kind of the packet.
    fn take(&mut self, packet: &[u8], sender: SocketAddr, arrived_ns: u64) -> PacketKind {
        let position =
            if packet.len() > LONGEST_PACKET_BYTES { Err(Malformed) } else { self.source.position(packet, self.rate) };
        match position {
            Err(Malformed) => count(&self.shared.malformed),
            Ok(None) => return PacketKind::Other,
            Ok(Some(_)) if !self.sender_lock.admits(sender.ip(), arrived_ns) => count(&self.shared.of_others),
            Ok(Some(position)) => {
                count(&self.shared.taken);
                let _ = self.samples.push(TimecodeSample { position, arrived_ns });
            }
        }
        PacketKind::Timecode
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// Capacity of the queue: a second of the fastest timecode that the receiver accepts, for the slowest server.
const MOST_SAMPLES: usize = 2048;

/// The loop's end of the queue.
#[derive(Debug)]
pub struct SampleQueue(Consumer<TimecodeSample>);

impl SampleQueue {
    /// Creates an empty queue. If the loop reads too slowly, the queue fills up and samples are dropped.
    pub fn with_sender() -> (Producer<TimecodeSample>, Self) {
        let (samples, inbox) = RingBuffer::new(MOST_SAMPLES);
        (samples, Self(inbox))
    }

    /// Takes all queued samples, oldest first.
    pub fn take(&mut self) -> impl Iterator<Item = TimecodeSample> {
        (0..self.0.slots()).map_while(|_| self.0.pop().ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::timecode::Position;

    #[test]
    fn malformed_and_foreign_timecodes_count_as_timecode_and_dmx_does_not() {
        let (samples, mut inbox) = SampleQueue::with_sender();
        let mut listening = Listening {
            socket: UdpSocket::bind("127.0.0.1:0").expect("a port"),
            source: "artnet".parse().expect("a source"),
            rate: FrameRate::default(),
            sender_lock: SenderLock::new(1_000_000_000),
            samples,
            shared: Arc::default(),
        };
        let timecode = b"Art-Net\0\x00\x97\x00\x0e\x00\x00\x05\x02\x01\x00\x01";
        let light = b"Art-Net\0\x00\x50\x00\x0e";
        let [desk, other] = ["127.0.0.1:9", "127.0.0.2:9"].map(|sender| sender.parse().expect("an address"));
        let kinds = [(&timecode[..], desk), (timecode, other), (&timecode[..18], desk), (light, desk)]
            .map(|(packet, sender)| listening.take(packet, sender, 5));
        assert_eq!(kinds, [PacketKind::Timecode, PacketKind::Timecode, PacketKind::Timecode, PacketKind::Other]);
        assert_eq!(inbox.take().map(|sample| sample.arrived_ns).collect::<Vec<_>>(), [5]);
    }

    fn sample(arrived_ns: u64) -> TimecodeSample {
        TimecodeSample { position: Position { since_midnight_s: 60.0, day_s: 86_400.0 }, arrived_ns }
    }

    #[test]
    fn samples_are_taken_once_and_in_their_order() {
        let (mut samples, mut inbox) = SampleQueue::with_sender();
        assert_eq!(inbox.take().count(), 0);
        samples.push(sample(1)).expect("the queue is not full");
        samples.push(sample(2)).expect("the queue is not full");
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(1), sample(2)]);
        assert_eq!(inbox.take().count(), 0);
    }

    #[test]
    fn a_full_queue_drops_samples_without_waiting() {
        let (mut samples, mut inbox) = SampleQueue::with_sender();
        (0..2 * MOST_SAMPLES as u64).filter(|&arrived_ns| samples.push(sample(arrived_ns)).is_ok()).count();
        assert_eq!(inbox.take().count(), MOST_SAMPLES);
        samples.push(sample(7)).expect("the queue is not full");
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(7)]);
    }

    /// The loop may have interrupted the receiving thread on the same processor, at a real-time priority. A wait for
    /// that thread would never end.
    #[test]
    fn the_loop_does_not_wait_for_a_sample_that_is_being_written() {
        let (mut samples, mut inbox) = SampleQueue::with_sender();
        samples.push(sample(1)).expect("the queue is not full");
        let half_written = samples.write_chunk_uninit(1).expect("the queue is not full");
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(1)]);
        half_written.fill_from_iter([sample(2)]);
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(2)]);
    }
}
