//! Messages from the other host. zenoh's threads add them, and the thread of the bus takes them.
//!
//! zenoh's threads never wait. Every queue has a bound. The queues of frames, alerts and descriptions count the entries that
//! they drop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::thread::{self, Thread};
use std::time::Duration;

use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use crossbeam::queue::ArrayQueue;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Reply;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait as _};

use super::command_relay::CommandAnswer;
use super::key_prefix::KeyPrefix;
use super::wire::{ALERT_BYTES, DESCRIBED_BYTES, Described, FrameForm, MAX_FRAME_BYTES, decode_description};
use crate::system::clock::monotonic_ns;

/// Most frames that wait: as many as the bus buffers for a reader.
const MAX_FRAMES: usize = 256;
/// Most bytes of these frames. This limit matters for large dragons.
const MAX_FRAMES_BYTES: usize = 64 << 20;
const MAX_ALERTS: usize = 256;
const MAX_DESCRIPTIONS: usize = 4;

/// A frame as it arrived.
#[derive(Debug)]
pub(super) struct Arrival {
    pub(super) form: FrameForm,
    pub(super) payload: ZBytes,
    pub(super) arrived_ns: u64,
}

#[derive(Debug)]
pub(super) struct Inbox {
    pub(super) frames: BoundedQueue<Arrival>,
    pub(super) alerts: BoundedQueue<ZBytes>,
    pub(super) descriptions: BoundedQueue<(Described, String)>,
    /// Has room for one answer to each command that can be in flight.
    pub(super) answers: ArrayQueue<CommandAnswer>,
    sources: AtomicUsize,
    has_new_source: AtomicBool,
    /// Payloads that were rejected before they entered a queue.
    pub(super) malformed: AtomicU64,
    /// Whether the thread of the bus has been woken since its last wait.
    is_woken: AtomicBool,
    bus_thread: Thread,
}

impl Inbox {
    pub(super) fn of_this_thread(max_answers: usize) -> Self {
        Self {
            frames: BoundedQueue::new(MAX_FRAMES, MAX_FRAMES_BYTES),
            alerts: BoundedQueue::new(MAX_ALERTS, MAX_ALERTS * ALERT_BYTES),
            descriptions: BoundedQueue::new(MAX_DESCRIPTIONS, MAX_DESCRIPTIONS * MAX_DESCRIPTION_LEN),
            answers: ArrayQueue::new(max_answers),
            sources: AtomicUsize::new(0),
            has_new_source: AtomicBool::new(false),
            malformed: AtomicU64::new(0),
            is_woken: AtomicBool::new(false),
            bus_thread: thread::current(),
        }
    }

    pub(super) fn put_frame(&self, sample: &Sample) {
        let arrived_ns = monotonic_ns();
        let payload = payload(sample).filter(|payload| payload.len() <= MAX_FRAME_BYTES).cloned();
        let form = FrameForm::of_encoding(&sample.encoding().to_string());
        self.put(&self.frames, payload.map(|payload| (payload.len(), Arrival { form, payload, arrived_ns })));
    }

    pub(super) fn put_alert(&self, sample: &Sample) {
        let payload = payload(sample).filter(|payload| payload.len() == ALERT_BYTES);
        self.put(&self.alerts, payload.map(|payload| (ALERT_BYTES, payload.clone())));
    }

    pub(super) fn put_description(&self, sample: &Sample) {
        self.put(&self.descriptions, described(sample).map(|description| (description.1.len(), description)));
    }

    /// Adds an entry and its length in bytes to a queue. Counts `None` as malformed.
    fn put<Entry>(&self, queue: &BoundedQueue<Entry>, entry: Option<(usize, Entry)>) {
        match entry {
            Some((bytes, entry)) => {
                queue.push(bytes, entry);
                self.wake();
            }
            None => drop(self.malformed.fetch_add(1, Ordering::Relaxed)),
        }
    }

    pub(super) fn put_liveliness(&self, kind: SampleKind) {
        let step = |count: usize| match kind {
            SampleKind::Put => Some(count.saturating_add(1)),
            SampleKind::Delete => Some(count.saturating_sub(1)),
        };
        let _ = self.sources.fetch_update(Ordering::Relaxed, Ordering::Relaxed, step);
        self.has_new_source.fetch_or(kind == SampleKind::Put, Ordering::Relaxed);
        self.wake();
    }

    pub(super) fn put_answer(&self, answer: CommandAnswer) {
        // An answer that finds no room belongs to a command whose deadline has passed.
        let _ = self.answers.push(answer);
        self.wake();
    }

    /// Whether another host reports a source.
    pub(super) fn has_source(&self) -> bool {
        self.sources.load(Ordering::Relaxed) > 0
    }

    /// Whether another host has reported a source since the last call.
    pub(super) fn take_news_of_source(&self) -> bool {
        self.has_new_source.swap(false, Ordering::Relaxed)
    }

    /// Waits until a message arrives, but no longer than the given time.
    pub(super) fn wait(&self, patience: Duration) {
        if !self.is_woken.swap(false, Ordering::Acquire) {
            thread::park_timeout(patience);
            self.is_woken.swap(false, Ordering::Acquire);
        }
    }

    fn wake(&self) {
        if !self.is_woken.swap(true, Ordering::AcqRel) {
            self.bus_thread.unpark();
        }
    }
}

fn payload(sample: &Sample) -> Option<&ZBytes> {
    (sample.kind() == SampleKind::Put).then(|| sample.payload())
}

fn described(sample: &Sample) -> Option<(Described, String)> {
    let payload = payload(sample).filter(|payload| payload.len() <= MAX_DESCRIPTION_LEN)?;
    let attached = sample.attachment().filter(|attached| attached.len() == DESCRIBED_BYTES)?;
    decode_description(&payload.to_bytes(), &attached.to_bytes())
}

/// Puts messages under the keys into the inbox, as long as the returned subscribers exist.
pub(super) fn subscribe(
    session: &Session,
    prefix: &KeyPrefix,
    inbox: &Arc<Inbox>,
) -> zenoh::Result<[Subscriber<()>; 4]> {
    let to = |put: fn(&Inbox, &Sample)| {
        let inbox = Arc::clone(inbox);
        move |sample: Sample| put(&inbox, &sample)
    };
    let liveliness = session.liveliness().declare_subscriber(prefix.source()).history(true);
    Ok([
        session.declare_subscriber(prefix.description()).callback(to(Inbox::put_description)).wait()?,
        session.declare_subscriber(prefix.alerts()).callback(to(Inbox::put_alert)).wait()?,
        session.declare_subscriber(prefix.frames()).callback(to(Inbox::put_frame)).wait()?,
        liveliness.callback(to(|inbox, sample| inbox.put_liveliness(sample.kind()))).wait()?,
    ])
}

/// Requests the description from the other host. The reply goes into the inbox.
pub(super) fn ask_for_description(session: &Session, prefix: &KeyPrefix, inbox: &Arc<Inbox>) -> zenoh::Result<()> {
    let inbox = Arc::clone(inbox);
    let take = move |reply: Reply| {
        if let Ok(sample) = reply.result() {
            inbox.put_description(sample);
        }
    };
    session
        .get(prefix.description())
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::InteractiveHigh)
        .callback(take)
        .wait()
}

/// A queue from zenoh's threads, which never wait, to the thread of the bus.
///
/// It limits both the number of entries and their bytes. A full queue drops its oldest entries and counts them.
#[derive(Debug)]
pub(super) struct BoundedQueue<Entry> {
    entries: ArrayQueue<(usize, Entry)>,
    bytes: AtomicUsize,
    max_bytes: usize,
    dropped: AtomicU64,
}

impl<Entry> BoundedQueue<Entry> {
    pub(super) fn new(max_entries: usize, max_bytes: usize) -> Self {
        Self {
            entries: ArrayQueue::new(max_entries),
            bytes: AtomicUsize::new(0),
            max_bytes,
            dropped: AtomicU64::new(0),
        }
    }

    /// Adds an entry of the given length in bytes.
    pub(super) fn push(&self, bytes: usize, entry: Entry) {
        let mut held = self.bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
        while held > self.max_bytes && self.pop().is_some() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
            held = self.bytes.load(Ordering::Relaxed);
        }
        if let Some((bytes, _)) = self.entries.force_push((bytes, entry)) {
            self.bytes.fetch_sub(bytes, Ordering::Relaxed);
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    pub(super) fn pop(&self) -> Option<Entry> {
        let (bytes, entry) = self.entries.pop()?;
        self.bytes.fetch_sub(bytes, Ordering::Relaxed);
        Some(entry)
    }

    pub(super) fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rest(queue: &BoundedQueue<u32>) -> Vec<u32> {
        std::iter::from_fn(|| queue.pop()).collect()
    }

    #[test]
    fn too_many_entries_drop_the_oldest() {
        let queue = BoundedQueue::new(3, usize::MAX);
        (0..5).for_each(|entry| queue.push(10, entry));
        assert_eq!((rest(&queue), queue.dropped()), (vec![2, 3, 4], 2));
    }

    #[test]
    fn too_many_bytes_drop_the_oldest() {
        let queue = BoundedQueue::new(100, 25);
        (0..5).for_each(|entry| queue.push(10, entry));
        assert_eq!((rest(&queue), queue.dropped()), (vec![3, 4], 3));
        assert_eq!(queue.bytes.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn every_entry_of_another_thread_is_taken_or_counted() {
        const ENTRIES: u64 = 20_000;
        let queue = BoundedQueue::new(8, 700);
        let taken = thread::scope(|scope| {
            let pushing = scope.spawn(|| (0..ENTRIES).for_each(|entry| queue.push(100, entry)));
            let mut taken = Vec::new();
            while !pushing.is_finished() {
                taken.extend(queue.pop());
            }
            taken.extend(std::iter::from_fn(|| queue.pop()));
            taken
        });
        assert!(taken.is_sorted(), "entries stay in their order");
        assert_eq!(taken.len() as u64 + queue.dropped(), ENTRIES);
        assert_eq!(queue.bytes.load(Ordering::Relaxed), 0);
    }
}
