//! Receiver of linear timecode: a thread reads sound, and passes samples to the loop through a queue.

use std::fs::File;
use std::io::{self, Read};
use std::os::fd::AsFd as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use rtrb::Producer;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::{LtcDecoder, LtcFrame, WavError, WavReader};
use crate::source::timecode::input::LtcInput;
use crate::source::timecode::{FrameRate, SampleQueue, TimecodeCounts, TimecodeSample};
use crate::system::clock::{monotonic_ns, sleep_until};

/// Period at which an idle thread checks whether to end.
const LOOK_PERIOD: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// Blocks of sound per second.
const BLOCKS_HZ: u32 = 200;
/// Largest correction of the clock of a sound card, as a part of the time: most are within 0.0001.
const DRIFT: f64 = 0.0005;

/// A running receiver. Dropping it ends its thread.
#[derive(Debug)]
pub struct LtcReceiver {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    taken: AtomicU64,
    malformed: AtomicU64,
    is_over: AtomicBool,
}

impl LtcReceiver {
    /// Starts to read; samples go to the queue. `rate` applies to frames without drop-frame counting, which do not contain it.
    ///
    /// # Errors
    /// A file cannot be read, or is no sound in WAV. For stdin, this is known, and reported, when its header has arrived.
    pub fn start(input: &LtcInput, rate: FrameRate) -> Result<(Self, SampleQueue), WavError> {
        let shared = Arc::new(Shared::default());
        let (samples, inbox) = SampleQueue::with_sender();
        let file = match input {
            LtcInput::Stdin => File::from(io::stdin().as_fd().try_clone_to_owned()?),
            LtcInput::File(path) => File::open(path)?,
        };
        let is_file = file.metadata()?.is_file();
        let mut stream = Stream { file, shared: Arc::clone(&shared) };
        // A pipe may be silent for a long time.
        let wav = if is_file { Some(WavReader::read_header(&mut stream)?) } else { None };
        let hearing = Hearing { stream, is_file, rate, samples, shared: Arc::clone(&shared) };
        let thread = thread::Builder::new().name("timecode".to_owned()).spawn(move || {
            if let Err(error) = hearing.run(wav) {
                tracing::error!("the timecode on stdin {error}");
            }
        })?;
        Ok((Self { shared, thread: Some(thread) }, inbox))
    }

    /// The present counters.
    pub fn counts(&self) -> TimecodeCounts {
        let [taken, malformed] =
            [&self.shared.taken, &self.shared.malformed].map(|count| count.load(Ordering::Relaxed));
        TimecodeCounts { taken, malformed, ..TimecodeCounts::default() }
    }
}

impl Drop for LtcReceiver {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        // The thread does not panic, and an error could not be reported here.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// A stream that ends with the receiver, also while nothing arrives.
struct Stream {
    file: File,
    shared: Arc<Shared>,
}

impl Read for Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while !self.shared.is_over.load(Ordering::Relaxed) {
            let mut polled = [PollFd::new(&self.file, PollFlags::IN)];
            match poll(&mut polled, Some(&LOOK_PERIOD)) {
                Ok(0) | Err(rustix::io::Errno::INTR) => {}
                Ok(_) => return self.file.read(buffer),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(0)
    }
}

struct Hearing {
    stream: Stream,
    is_file: bool,
    rate: FrameRate,
    samples: Producer<TimecodeSample>,
    shared: Arc<Shared>,
}

impl Hearing {
    /// Reads up to the end of the sound. `wav`: the header, if it has been read.
    fn run(mut self, wav: Option<WavReader>) -> Result<(), WavError> {
        let wav = match wav {
            Some(wav) => wav,
            None => match WavReader::read_header(&mut self.stream) {
                Err(WavError::Form) if self.shared.is_over.load(Ordering::Relaxed) => return Ok(()),
                wav => wav?,
            },
        };
        let mut decoder = LtcDecoder::new(wav.samples_per_second);
        let mut clock = SampleClock::new(wav.samples_per_second, monotonic_ns());
        let mut buffer = vec![0; wav.frame_bytes * (wav.samples_per_second / BLOCKS_HZ) as usize];
        let mut filled = 0;
        loop {
            let read = self.stream.read(&mut buffer[filled..])?;
            if read == 0 {
                return Ok(());
            }
            filled += read;
            let whole = filled - filled % wav.frame_bytes;
            clock.heard += (whole / wav.frame_bytes) as u64;
            if self.is_file {
                sleep_until(clock.instant_ns(clock.heard as f64));
            } else {
                clock.correct(monotonic_ns());
            }
            for frame in wav.samples(&buffer[..whole]).filter_map(|sample| decoder.push(sample)) {
                self.take(frame, &clock);
            }
            buffer.copy_within(whole..filled, 0);
            filled -= whole;
        }
    }

    fn take(&mut self, LtcFrame { word, begin }: LtcFrame, clock: &SampleClock) {
        match word.position(self.rate) {
            Err(_) => self.shared.malformed.fetch_add(1, Ordering::Relaxed),
            Ok(position) => {
                let _ = self.samples.push(TimecodeSample { position, arrived_ns: clock.instant_ns(begin) });
                self.shared.taken.fetch_add(1, Ordering::Relaxed)
            }
        };
    }
}

/// The instant of each sample. Blocks arrive late, by different times, but never early: the earliest one is the measure. The clock
/// of a sound card differs from that of the machine, so the measure becomes later, slowly.
#[derive(Clone, Copy, Debug)]
struct SampleClock {
    per_second: u32,
    /// Instant of sample 0.
    epoch_ns: i128,
    corrected_ns: u64,
    is_first: bool,
    heard: u64,
}

impl SampleClock {
    fn new(per_second: u32, now_ns: u64) -> Self {
        Self { per_second, epoch_ns: now_ns.into(), corrected_ns: now_ns, is_first: true, heard: 0 }
    }

    /// The samples that have been heard have arrived now.
    fn correct(&mut self, now_ns: u64) {
        let epoch_ns = i128::from(now_ns) - self.since_epoch_ns(self.heard as f64);
        let most_ns = (now_ns.saturating_sub(self.corrected_ns) as f64 * DRIFT) as i128;
        let is_first = std::mem::take(&mut self.is_first);
        self.epoch_ns = if is_first { epoch_ns } else { epoch_ns.min(self.epoch_ns + most_ns) };
        self.corrected_ns = now_ns;
    }

    fn instant_ns(&self, sample: f64) -> u64 {
        u64::try_from(self.epoch_ns + self.since_epoch_ns(sample)).unwrap_or(0)
    }

    fn since_epoch_ns(&self, sample: f64) -> i128 {
        (sample * 1e9 / f64::from(self.per_second)) as i128
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_instants_of_samples_do_not_jitter_with_their_blocks_and_follow_the_clock_of_the_card() {
        const BEGIN_NS: u64 = 1_000_000_000_000;
        let mut random = fastrand::Rng::with_seed(5);
        // A sound card that is slow by 100 parts of a million, and blocks of 125 ms that are read in parts, up to 20 ms late.
        for speed in [1.0 - 1e-4, 1.0, 1.0 + 1e-4] {
            let mut clock = SampleClock::new(48_000, BEGIN_NS);
            for block in 1..=4_000_u64 {
                let captured_ns = BEGIN_NS + (block as f64 * 125e6 / speed) as u64;
                for _part in 0..25 {
                    clock.heard += 240;
                    clock.correct(captured_ns + random.u64(1_000..20_000_000));
                }
                let error_ns = i128::from(clock.instant_ns(clock.heard as f64)) - i128::from(captured_ns);
                assert!(block < 100 || (-1_000_000..20_000_000).contains(&error_ns), "{block}: {error_ns} ns");
            }
        }
    }
}
