//! A bare seqlock ring in shared memory: the physical limit. The publisher waits for nobody, knows no reader, and makes no system
//! call; a reader finds a frame by one number. It has none of what makes a bus: no memory for each reader, no late joiners with a
//! description, no end of a process that is noticed. Its readers poll; nothing could wake them.
//!
//! A slot has an even number, 2 · (frame + 1), once its frame is whole, and an odd one while it is written. All words are atomic.

use std::fs::File;
use std::sync::atomic::{AtomicU64, Ordering, fence};

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::{FrameHeader, HandleState, IntoBytes as _};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use tempfile::NamedTempFile;

use crate::arrival::Arrival;
use crate::frame_bytes::{FRAME_BYTES, HEADER_BYTES};
use crate::frame_source::HANDLES;
use crate::publishing::{Sender, announce};
use crate::reading::Receiver;
use crate::setting::Setting;

/// Frames in the ring. The ring stays in the publisher's cache, as two alternating samples do; a reader that is later loses frames.
const SLOTS: usize = 16;
/// Words of a cache line.
const LINE: usize = 8;
const WORD_BYTES: usize = size_of::<u64>();
const HEADER_WORDS: usize = HEADER_BYTES / WORD_BYTES;
const FRAME_WORDS: usize = FRAME_BYTES / WORD_BYTES;
const HANDLE_WORDS: usize = size_of::<HandleState>() / WORD_BYTES;
/// The number of a slot has a cache line of its own.
const SLOT_WORDS: usize = LINE + FRAME_WORDS.next_multiple_of(LINE);
/// Before the slots: the number of sent frames, and that of attached readers, in a line each.
const SLOTS_BEGIN: usize = 2 * LINE;
const WORDS: usize = SLOTS_BEGIN + SLOTS * SLOT_WORDS;
const _: () = assert!(HEADER_BYTES.is_multiple_of(WORD_BYTES) && FRAME_BYTES.is_multiple_of(WORD_BYTES));

/// The ring, mapped into this process.
struct Ring(&'static [AtomicU64]);

impl Ring {
    #[expect(unsafe_code, reason = "shared memory is mapped by a raw call")]
    fn map(file: &File) -> Self {
        let (protection, length) = (ProtFlags::READ | ProtFlags::WRITE, WORDS * WORD_BYTES);
        // SAFETY: a new mapping at an address that the kernel chooses. The file has this length, and nobody shortens it.
        let words = unsafe { mmap(std::ptr::null_mut(), length, protection, MapFlags::SHARED, file, 0) };
        let words = words.expect("the file can be mapped").cast::<AtomicU64>();
        // SAFETY: the mapping is aligned to a page, has WORDS words, and lasts until this ring is dropped, which keeps the reference
        // to itself. All processes access it by atomics alone, for which any bits are valid.
        Self(unsafe { std::slice::from_raw_parts(words, WORDS) })
    }

    fn sent(&self) -> &AtomicU64 {
        &self.0[0]
    }

    fn readers(&self) -> &AtomicU64 {
        &self.0[LINE]
    }

    /// The number of the slot of a frame, and the words of the frame.
    fn slot(&self, frame: u64) -> (&AtomicU64, &[AtomicU64]) {
        let begin = SLOTS_BEGIN + frame as usize % SLOTS * SLOT_WORDS;
        (&self.0[begin], &self.0[begin + LINE..][..FRAME_WORDS])
    }
}

impl Drop for Ring {
    #[expect(unsafe_code, reason = "shared memory is mapped by a raw call")]
    fn drop(&mut self) {
        // SAFETY: the whole mapping of `map`, to which no reference is left.
        unsafe { munmap(self.0.as_ptr().cast_mut().cast(), WORDS * WORD_BYTES) }.expect("the mapping exists");
    }
}

pub(crate) struct RingSender {
    ring: Ring,
    handles: Vec<HandleState>,
    frame: u64,
    /// Removed at the end.
    _file: NamedTempFile,
}

impl RingSender {
    /// Makes a ring and waits for all readers.
    pub(crate) fn open(setting: Setting) -> Self {
        let file = NamedTempFile::with_prefix_in("latency-ring-", "/dev/shm").expect("shared memory");
        file.as_file().set_len((WORDS * WORD_BYTES) as u64).expect("there is room for the ring");
        let ring = Ring::map(file.as_file());
        announce(file.path().to_str().expect("temporary files have plain names"));
        while ring.readers().load(Ordering::Acquire) < setting.readers as u64 {
            std::thread::yield_now();
        }
        Self { ring, handles: vec![HandleState::default(); HANDLES], frame: 0, _file: file }
    }
}

impl Sender for RingSender {
    fn send(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) {
        let (number, words) = self.ring.slot(self.frame);
        number.store(2 * self.frame + 1, Ordering::Relaxed);
        fence(Ordering::Release);
        let header = fill(&mut self.handles);
        // The handles are in their slot before the instant of sending, as those of a loaned sample are.
        store(&words[HEADER_WORDS..], self.handles.as_bytes());
        let header = FrameHeader { published_ns: monotonic_ns(), ..header };
        store(&words[..HEADER_WORDS], &header.as_bytes()[..HEADER_BYTES]);
        self.frame += 1;
        number.store(2 * self.frame, Ordering::Release);
        self.ring.sent().store(self.frame, Ordering::Release);
    }
}

fn store(words: &[AtomicU64], bytes: &[u8]) {
    for (word, bytes) in words.iter().zip(bytes.as_chunks().0) {
        word.store(u64::from_ne_bytes(*bytes), Ordering::Relaxed);
    }
}

pub(crate) struct RingReceiver {
    ring: Ring,
    next: u64,
}

impl RingReceiver {
    pub(crate) fn open(place: &str) -> Self {
        let file = File::options().read(true).write(true).open(place).expect("the publisher has made the ring");
        let ring = Ring::map(&file);
        ring.readers().fetch_add(1, Ordering::Release);
        let next = ring.sent().load(Ordering::Acquire);
        Self { ring, next }
    }
}

impl Receiver for RingReceiver {
    fn receive(&mut self) -> Option<Arrival> {
        let (number, words) = self.ring.slot(self.next);
        let whole = 2 * (self.next + 1);
        if number.load(Ordering::Acquire) == whole {
            let arrival = read(words);
            fence(Ordering::Acquire);
            if number.load(Ordering::Relaxed) == whole {
                self.next += 1;
                return Some(arrival);
            }
        }
        // A reader that the publisher has overtaken goes on with the next frame; those between are lost.
        if self.ring.sent().load(Ordering::Relaxed) >= self.next + SLOTS as u64 {
            self.next = self.ring.sent().load(Ordering::Acquire);
        }
        None
    }
}

/// Reads a frame in place.
fn read(words: &[AtomicU64]) -> Arrival {
    let bits = |word: &AtomicU64| word.load(Ordering::Relaxed);
    let mut header = [0; HEADER_BYTES];
    for (bytes, word) in header.as_chunks_mut().0.iter_mut().zip(words) {
        *bytes = bits(word).to_ne_bytes();
    }
    let handle = |words: &[AtomicU64; HANDLE_WORDS]| {
        let [x, y, z, u, v, w] = words.each_ref().map(|word| f64::from_bits(bits(word)));
        HandleState { position_m: [x, y, z], velocity_mps: [u, v, w] }
    };
    Arrival::read(FrameHeader::of_show_bytes(&header), words[HEADER_WORDS..].as_chunks().0.iter().map(handle))
}
