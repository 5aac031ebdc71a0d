//! What has come from the other side: put there by zenoh's threads, taken by the one of the bus.
//!
//! A thread of zenoh's never waits: each way has its bound, and what does not find room is counted.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::thread::{self, Thread};
use std::time::Duration;

use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use crossbeam::queue::ArrayQueue;
use zenoh::bytes::ZBytes;
use zenoh::sample::{Sample, SampleKind};

use super::backlog::Backlog;
use super::relay::Answer;
use super::wire::{ALERT_BYTES, Described, MAX_FRAME_BYTES, WireError, decode_description};
use crate::system::clock::monotonic_ns;

/// Frames that wait at most: as many as the bus keeps for a reader.
const MAX_FRAMES: usize = 256;
/// And their bytes, for large dragons.
const MAX_FRAMES_BYTES: usize = 64 << 20;
/// Alerts that wait at most.
const MAX_ALERTS: usize = 256;
/// Descriptions that wait at most.
const MAX_DESCRIPTIONS: usize = 4;

/// A frame as it came.
#[derive(Debug)]
pub(super) struct Arrival {
    pub(super) payload: ZBytes,
    pub(super) arrived_ns: u64,
}

/// The box.
#[derive(Debug)]
pub(super) struct Inbox {
    pub(super) frames: Backlog<Arrival>,
    pub(super) alerts: Backlog<ZBytes>,
    pub(super) descriptions: Backlog<(Described, String)>,
    /// As many as commands may be asked at a time, each answered once: there is room for all.
    pub(super) answers: ArrayQueue<Answer>,
    sources: AtomicUsize,
    has_new_source: AtomicBool,
    malformed: AtomicU64,
    /// So that the bus's thread is not told of what it knows.
    is_told: AtomicBool,
    bus_thread: Thread,
}

impl Inbox {
    /// The box of this thread.
    pub(super) fn of_this_thread(max_answers: usize) -> Self {
        Self {
            frames: Backlog::new(MAX_FRAMES, MAX_FRAMES_BYTES),
            alerts: Backlog::new(MAX_ALERTS, MAX_ALERTS * ALERT_BYTES),
            descriptions: Backlog::new(MAX_DESCRIPTIONS, MAX_DESCRIPTIONS * MAX_DESCRIPTION_LEN),
            answers: ArrayQueue::new(max_answers),
            sources: AtomicUsize::new(0),
            has_new_source: AtomicBool::new(false),
            malformed: AtomicU64::new(0),
            is_told: AtomicBool::new(false),
            bus_thread: thread::current(),
        }
    }

    pub(super) fn put_frame(&self, sample: &Sample) {
        let arrived_ns = monotonic_ns();
        let payload = sample.payload();
        if sample.kind() != SampleKind::Put || payload.len() > MAX_FRAME_BYTES {
            return self.count_malformed();
        }
        self.frames.push(payload.len(), Arrival { payload: payload.clone(), arrived_ns });
        self.tell();
    }

    pub(super) fn put_alert(&self, sample: &Sample) {
        let payload = sample.payload();
        if sample.kind() != SampleKind::Put || payload.len() != ALERT_BYTES {
            return self.count_malformed();
        }
        self.alerts.push(ALERT_BYTES, payload.clone());
        self.tell();
    }

    pub(super) fn put_description(&self, sample: &Sample) {
        match described(sample) {
            Ok(description) => {
                self.descriptions.push(description.1.len(), description);
                self.tell();
            }
            Err(_) => self.count_malformed(),
        }
    }

    /// A source has come or gone.
    pub(super) fn put_liveliness(&self, kind: SampleKind) {
        let step = |count: usize| match kind {
            SampleKind::Put => Some(count.saturating_add(1)),
            SampleKind::Delete => Some(count.saturating_sub(1)),
        };
        let _ = self.sources.fetch_update(Ordering::Relaxed, Ordering::Relaxed, step);
        self.has_new_source.fetch_or(kind == SampleKind::Put, Ordering::Relaxed);
        self.tell();
    }

    pub(super) fn put_answer(&self, answer: Answer) {
        // One that finds no room is to a command that is not waited for any more.
        let _ = self.answers.push(answer);
        self.tell();
    }

    /// Whether the other side says that a source is there.
    pub(super) fn has_source(&self) -> bool {
        self.sources.load(Ordering::Relaxed) > 0
    }

    /// Whether the other side has said so since the last call.
    pub(super) fn take_news_of_source(&self) -> bool {
        self.has_new_source.swap(false, Ordering::Relaxed)
    }

    /// Payloads whose length alone was wrong.
    pub(super) fn malformed(&self) -> u64 {
        self.malformed.load(Ordering::Relaxed)
    }

    /// Waits until something has come, but not for long.
    pub(super) fn wait(&self, patience: Duration) {
        if !self.is_told.swap(false, Ordering::Acquire) {
            thread::park_timeout(patience);
            self.is_told.swap(false, Ordering::Acquire);
        }
    }

    fn tell(&self) {
        if !self.is_told.swap(true, Ordering::AcqRel) {
            self.bus_thread.unpark();
        }
    }

    fn count_malformed(&self) {
        self.malformed.fetch_add(1, Ordering::Relaxed);
    }
}

fn described(sample: &Sample) -> Result<(Described, String), WireError> {
    if sample.kind() != SampleKind::Put || sample.payload().len() > MAX_DESCRIPTION_LEN {
        return Err(WireError::Description);
    }
    let attached = sample.attachment().filter(|attached| attached.len() <= size_of::<[u64; 4]>());
    decode_description(&sample.payload().to_bytes(), &attached.ok_or(WireError::Description)?.to_bytes())
}
