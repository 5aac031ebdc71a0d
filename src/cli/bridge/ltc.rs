//! Linear timecode of `bridge timecode`: show time as sound, to stdout or into a WAV file.

use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal as _, Seek as _, Write as _};
use std::os::fd::AsFd as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use anyhow::Context as _;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::Serialize;

use super::BridgeArgs;
use super::feed::Feed;
use super::timecode::{TimecodeArgs, feed_of};
use crate::bridge::timecode::{LtcPacer, SampleInstants};
use crate::cli::flags::{BadInput, Format};
use crate::cli::print::{print_notice, print_report, print_to_stderr};
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::source::timecode::ltc::{LtcEncoder, LtcWord, wav_header};
use crate::source::timecode::{Clock, FrameRate};
use crate::system::clock::{monotonic_ns, sleep_precisely};
use crate::system::stop::StopFlag;

/// Blocks of sound per second. A block is written when its time is over, as a sound card would deliver it.
const BLOCKS_HZ: u32 = 200;
/// Delay from which on the sound counts as late: it goes on from the present.
const LATE_NS: u64 = 100_000_000;
/// Period at which a write that nobody reads checks whether to end.
const WRITE_PERIOD: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// Bytes that a pipe takes without blocking if it takes any.
const PIPE_BYTES: usize = 4096;

/// Where the sound goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum LtcOutput {
    Stdout,
    File(PathBuf),
}

impl FromStr for LtcOutput {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "" => Err("must be - for stdout, or a file".to_owned()),
            "-" => Ok(Self::Stdout),
            path => Ok(Self::File(path.into())),
        }
    }
}

/// A line about sound.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum SoundLine<'a> {
    Started { file: &'a str, settings: &'a str },
    Summary { frames: u64, samples: u64, late: u64 },
}

pub(super) fn run(args: &BridgeArgs, timecode: &TimecodeArgs, to: &LtcOutput) -> anyhow::Result<ExitCode> {
    let &TimecodeArgs { rate, offset, silence, sample_rate, raw, .. } = timecode;
    let format = args.format.format;
    if *to == LtcOutput::Stdout && format == Format::Json {
        return Err(BadInput("--format is json, must be text with --ltc -: the sound is on stdout".to_owned()).into());
    }
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let mut sound = Sound::create(to, sample_rate, raw)?;
    let settings =
        format!("LTC: {sample_rate} samples of 16 bits a second, {rate} frames a second, show time {offset:+} s");
    if let LtcOutput::File(path) = to {
        print_notice(format, &SoundLine::Started { file: &path.to_string_lossy(), settings: &settings }, &settings)?;
    } else {
        print_to_stderr(&settings);
    }
    if let Some(mut feed) = Feed::open(&domain, "bridge-timecode", feed_of(silence), &stop)? {
        sleep_precisely();
        let pacer = LtcPacer::new(rate, (offset * 1e9).round() as i64, sample_rate);
        sing(&mut feed, pacer, rate, &mut sound, &stop)?;
    }
    let (frames, samples, late) = (sound.frames, sound.instants.written, sound.late);
    sound.finish()?;
    let text = format!("{} in {}, {late} times late", Counted(frames, "frame"), Counted(samples, "sample"));
    match to {
        LtcOutput::Stdout => print_to_stderr(&text),
        LtcOutput::File(_) => print_report(format, &SoundLine::Summary { frames, samples, late }, text)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes sound until a signal, or until nobody reads it. Before the first frame of the bus it is silence.
fn sing(
    feed: &mut Feed<'_>,
    pacer: LtcPacer,
    rate: FrameRate,
    sound: &mut Sound,
    stop: &StopFlag,
) -> anyhow::Result<()> {
    let (mut encoder, mut samples) = (LtcEncoder::default(), Vec::new());
    let block = (sound.instants.samples_per_second / BLOCKS_HZ) as usize;
    let mut next = 0;
    loop {
        let begin_ns = sound.instants.at(sound.instants.written);
        let end = samples.len().min(next + block);
        let deadline_ns = sound.instants.at(sound.instants.written + (end - next) as u64);
        let Some((_, latest)) = feed.newest_at(deadline_ns)? else { return Ok(()) };
        if next == samples.len() {
            samples.clear();
            next = 0;
            match latest {
                None => samples.resize(block, 0),
                Some(latest) => {
                    let (frame, count) = pacer.next(latest, begin_ns);
                    encoder.write(LtcWord::of_clock(Clock::of_frame(frame, rate), rate), count, &mut samples);
                    sound.frames += 1;
                }
            }
            continue;
        }
        if !sound.write(&samples[next..end], stop)? {
            return Ok(());
        }
        next = end;
    }
}

/// The written sound.
struct Sound {
    file: File,
    /// Whether the header is completed at the end.
    is_wav_file: bool,
    instants: SampleInstants,
    frames: u64,
    /// Number of times that the sound was late, because it was not read fast enough or this program was suspended.
    late: u64,
}

impl Sound {
    fn create(to: &LtcOutput, samples_per_second: u32, is_raw: bool) -> anyhow::Result<Self> {
        let mut file = match to {
            LtcOutput::Stdout if io::stdout().is_terminal() => {
                return Err(BadInput("stdout is a terminal, must be a pipe or a file with --ltc -".to_owned()).into());
            }
            LtcOutput::Stdout => File::from(io::stdout().as_fd().try_clone_to_owned()?),
            LtcOutput::File(path) => {
                File::create_new(path).with_context(|| format!("cannot create {}", Printable(path)))?
            }
        };
        if !is_raw {
            file.write_all(&wav_header(samples_per_second, None)).context("cannot write the sound")?;
        }
        let is_wav_file = matches!(to, LtcOutput::File(_)) && !is_raw;
        Ok(Self {
            file,
            is_wav_file,
            instants: SampleInstants::new(samples_per_second, monotonic_ns()),
            frames: 0,
            late: 0,
        })
    }

    /// Writes samples. Returns false if nobody reads them any more, or after a signal.
    fn write(&mut self, samples: &[i16], stop: &StopFlag) -> anyhow::Result<bool> {
        let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
        for part in bytes.chunks(PIPE_BYTES) {
            loop {
                if stop.is_set() {
                    return Ok(false);
                }
                let mut polled = [PollFd::new(&self.file, PollFlags::OUT)];
                match poll(&mut polled, Some(&WRITE_PERIOD)) {
                    Ok(0) | Err(rustix::io::Errno::INTR) => {}
                    Ok(_) => break,
                    Err(error) => return Err(error).context("cannot write the sound"),
                }
            }
            match self.file.write_all(part) {
                Ok(()) => {}
                Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(false),
                Err(error) => return Err(error).context("cannot write the sound"),
            }
        }
        self.late += u64::from(self.instants.advance(samples.len() as u64, monotonic_ns(), LATE_NS));
        Ok(true)
    }

    /// Completes the header of a file.
    fn finish(mut self) -> anyhow::Result<()> {
        if self.is_wav_file {
            let data_bytes = u32::try_from(2 * self.instants.written).ok();
            let header = wav_header(self.instants.samples_per_second, data_bytes);
            self.file
                .rewind()
                .and_then(|()| self.file.write_all(&header))
                .context("cannot complete the file of the sound")?;
        }
        Ok(())
    }
}
