//! Taking timecode off a socket, on a thread of its own, and leaving it where the loop takes it.

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

/// More than any timecode has, and too little for bundles in bundles to do harm. What is longer is cut, and malformed.
const LONGEST_PACKET_BYTES: usize = 2048;
/// How often a thread that hears nothing looks whether it is over.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

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
pub enum ReceiverError {
    /// Another program has the port.
    #[error(
        "cannot listen for timecode on {listen}: another program has this port; end it, or have the timecode sent to another \
         one, and name that"
    )]
    Busy {
        /// Where it was to listen.
        listen: SocketAddr,
    },
    /// The address is not this machine's, or the port is not to be had.
    #[error("cannot listen for timecode on {listen}")]
    Failed {
        /// Where it was to listen.
        listen: SocketAddr,
        /// What the kernel says.
        source: io::Error,
    },
}

/// The running thread.
#[derive(Debug)]
pub struct TimecodeReceiver {
    /// Where it listens.
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
    /// Binds the socket and begins to listen; samples come into the queue. Frames whose number a second is not given are of
    /// `rate`; a sender that is silent for `timeout_ns` gives way to another.
    ///
    /// # Errors
    /// Where another program has the port, the address is not this machine's, or the port is not to be had.
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
        let (samples, inbox) = sample_queue();
        let shared = Arc::new(Shared::default());
        let sender_lock = SenderLock::new(timeout_ns);
        let listening = Listening { socket, source, rate, sender_lock, samples, shared: Arc::clone(&shared) };
        let thread =
            thread::Builder::new().name("timecode".to_owned()).spawn(move || listening.run()).map_err(failed)?;
        Ok((Self { listen, shared, thread: Some(thread) }, inbox))
    }

    /// What has come so far.
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
        // It does not panic, and nothing could be reported here.
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
            // A failure is the silence that ends a wait, or the answer of a host that is none of ours.
            let Ok((length, sender)) = self.socket.recv_from(&mut packet) else { continue };
            let arrived_ns = monotonic_ns();
            let kind = self.take(&packet[..length], sender, arrived_ns);
            if let Some(rest_ns) = flood_guard.count(kind, arrived_ns) {
                // What comes meanwhile is the kernel's to keep or to drop.
                count(&self.shared.floods);
                thread::sleep(Duration::from_nanos(rest_ns));
            }
        }
    }

    /// Takes what a packet has, and says what it is.
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

/// A second of the fastest timecode that is taken, for the slowest server.
const MOST_SAMPLES: usize = 2048;

/// The loop's end.
#[derive(Debug)]
pub struct SampleQueue(Consumer<TimecodeSample>);

/// The two ends of an empty queue. Where the loop has taken nothing for long, there is no room, and a sample is lost.
fn sample_queue() -> (Producer<TimecodeSample>, SampleQueue) {
    let (samples, inbox) = RingBuffer::new(MOST_SAMPLES);
    (samples, SampleQueue(inbox))
}

impl SampleQueue {
    /// Takes the samples that are there, oldest first.
    pub fn take(&mut self) -> impl Iterator<Item = TimecodeSample> {
        (0..self.0.slots()).map_while(|_| self.0.pop().ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::timecode::Position;

    #[test]
    fn what_is_malformed_or_of_another_sender_counts_as_timecode_and_light_does_not() {
        let (samples, mut inbox) = sample_queue();
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
        let (mut samples, mut inbox) = sample_queue();
        assert_eq!(inbox.take().count(), 0);
        samples.push(sample(1)).expect("there is room");
        samples.push(sample(2)).expect("there is room");
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(1), sample(2)]);
        assert_eq!(inbox.take().count(), 0);
    }

    #[test]
    fn a_loop_that_takes_nothing_keeps_nobody_waiting() {
        let (mut samples, mut inbox) = sample_queue();
        (0..2 * MOST_SAMPLES as u64).filter(|&arrived_ns| samples.push(sample(arrived_ns)).is_ok()).count();
        assert_eq!(inbox.take().count(), MOST_SAMPLES);
        samples.push(sample(7)).expect("there is room");
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(7)]);
    }

    /// The loop may be on the processor of a thread that it has interrupted, and at a real-time priority: whatever it waited for
    /// would never come.
    #[test]
    fn a_sample_that_is_half_left_keeps_nobody_waiting() {
        let (mut samples, mut inbox) = sample_queue();
        samples.push(sample(1)).expect("there is room");
        let half_left = samples.write_chunk_uninit(1).expect("there is room");
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(1)]);
        half_left.fill_from_iter([sample(2)]);
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(2)]);
    }
}
