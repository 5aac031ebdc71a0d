//! Recorders killed at random instants. The stock reader streams each file, a replay plays it, and a repair adds an index. All
//! frames are there that were published at least a second before the kill.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use bench_dragon::recording::{FrameReader, RecordedFrame, repair};
use bench_dragon::system::clock::monotonic_ns;
use test_support::pytest;

use crate::record::await_frames;
use crate::seed::Seed;
use crate::stage::Stage;

const KILLS: usize = 200;
/// Number of recorders at a time.
const RECORDERS: usize = 8;
/// Longest time from a recorder's start to its kill, for every second recorder.
const LONGEST_START: Duration = Duration::from_millis(150);
/// Longest time from the first recorded frame to the kill, for the others: longer than the allowed loss.
const LONGEST_LIFE: Duration = Duration::from_millis(1_500);
/// Longest allowed loss of a killed recorder, in nanoseconds.
const LOSS_NS: u64 = 1_000_000_000;

/// Facts about a killed recorder.
struct Killed {
    /// Number of the recorder.
    number: usize,
    /// The frames that its file holds.
    frames: Vec<RecordedFrame>,
    /// Instant of the kill.
    at_ns: u64,
    /// Time for which its threads had waited for a processor, from the first recorded frame to the kill.
    waited_ns: u64,
}

#[test]
fn a_recorder_killed_at_any_time_loses_at_most_a_second_and_every_reader_opens_its_file() {
    let seed = Seed::announced();
    let stage = Stage::new();
    fs::write(stage.path("stage.toml"), "[dragon]\nbenches = 6\n").expect("a file");
    // At this rate the bus keeps five seconds for a recorder.
    let server = stage.serve(&["--config", "stage.toml", "--rate", "50"]);
    let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let all = Mutex::new(Vec::new());
    let stalls = Stalls::default();
    thread::scope(|scope| {
        scope.spawn(|| stalls.watch_until(&is_over));
        let workers: Vec<_> = (0..RECORDERS)
            .map(|_| {
                scope.spawn(|| {
                    let replays = Stage::new();
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= KILLS {
                            return;
                        }
                        let killed = kill_one(&stage, number, seed);
                        open_in_replay(&replays, &stage.path(&cut_name(number)), killed.frames.len());
                        repair_one(&stage, &killed);
                        all.lock().unwrap_or_else(PoisonError::into_inner).push(killed);
                    }
                })
            })
            .collect();
        let ended: Vec<_> = workers.into_iter().map(thread::ScopedJoinHandle::join).collect();
        is_over.store(true, Ordering::Relaxed);
        for worker in ended {
            worker.expect("no worker has failed");
        }
    });
    server.stop();
    let mut all = all.into_inner().unwrap_or_else(PoisonError::into_inner);
    all.sort_by_key(|killed| killed.number);
    // Instant of publication of each frame that a recorder has kept, by tick.
    let frames = all.iter().flat_map(|killed| &killed.frames);
    let published: BTreeMap<u64, u64> = frames.map(|frame| (frame.header.tick, frame.header.published_ns)).collect();
    let losses_ns = all.iter().map(|killed| killed.check_loss(&published, &stalls));
    let longest_loss_ns = losses_ns.max().expect("recorders were killed");
    let with_frames = all.iter().filter(|killed| !killed.frames.is_empty()).count();
    assert!(with_frames >= KILLS / 2, "{with_frames} files have frames");
    println!("{KILLS} kills, {with_frames} files with frames, longest loss {} ms", longest_loss_ns / 1_000_000);
    open_in_python(&stage, &all);
}

/// Starts a recorder and kills it: every second one during its start, the others after their first recorded frame.
fn kill_one(stage: &Stage, number: usize, seed: Seed) -> Killed {
    fs::create_dir(stage.path(&number.to_string())).expect("a folder");
    let path = stage.path(&cut_name(number));
    let recorder = stage.start(&["record", &cut_name(number)]);
    let share = seed.random(number as u64).f64();
    let mut waited_before_ns = 0;
    if number.is_multiple_of(2) {
        thread::sleep(LONGEST_START.mul_f64(share));
    } else {
        await_frames(&path);
        waited_before_ns = waited_ns(recorder.pid());
        thread::sleep(LONGEST_LIFE.mul_f64(share));
    }
    let (at_ns, waited_ns) = (monotonic_ns(), waited_ns(recorder.pid()));
    recorder.kill();
    Killed { number, frames: read(&path), at_ns, waited_ns: waited_ns.saturating_sub(waited_before_ns) }
}

/// Returns the time for which the threads of a process have waited for a processor.
fn waited_ns(pid: u32) -> u64 {
    let threads = fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let waited = |path: &Path| fs::read_to_string(path).ok()?.split_whitespace().nth(1)?.parse::<u64>().ok();
    threads.filter_map(|thread| waited(&thread.path().join("schedstat"))).sum()
}

fn cut_name(number: usize) -> String {
    format!("{number}/cut.mcap")
}

/// Returns the frames of a file, which is a recording from its first byte on; none if the recorder had not created the file
/// yet.
fn read(path: &Path) -> Vec<RecordedFrame> {
    if !path.exists() {
        return Vec::new();
    }
    let reader = FrameReader::open(path).expect("the file is a recording");
    reader.collect::<Result<_, _>>().expect("readable frames")
}

/// Begins to replay a file, which proves that it can be opened.
fn open_in_replay(stage: &Stage, path: &Path, frames: usize) {
    if !path.exists() {
        return;
    }
    let mut replay = stage.start(&["replay".as_ref(), path.as_os_str(), "--format".as_ref(), "json".as_ref()]);
    if frames == 0 {
        let ended = replay.end();
        assert_eq!(ended.stderr, format!("error: {} holds no frames: it stops in the middle\n", path.display()));
        return;
    }
    assert_eq!(replay.json()["type"], "started");
    assert_eq!(replay.terminate().code(), Some(0));
}

/// Repairs a copy of a file.
fn repair_one(stage: &Stage, killed: &Killed) {
    let cut = stage.path(&cut_name(killed.number));
    if cut.exists() {
        let repaired = cut.with_file_name("repaired.mcap");
        fs::copy(&cut, &repaired).expect("a copy");
        let repair = repair(&repaired).expect("a repair");
        assert_eq!((repair.frames, repair.was_unfinished), (killed.frames.len() as u64, true));
        assert_eq!((repair.skipped_bytes, repair.kept), (0, None), "a kill damages nothing");
        assert!(read(&repaired) == killed.frames, "repair keeps every frame");
    }
}

/// Opens all files with the stock readers.
fn open_in_python(stage: &Stage, all: &[Killed]) {
    let mut list = fs::File::create(stage.path("frames.txt")).expect("a file");
    for killed in all.iter().filter(|killed| stage.path(&cut_name(killed.number)).exists()) {
        let first = killed.frames.first().map_or(0, |frame| frame.header.tick);
        writeln!(list, "{} {first} {}", killed.number, killed.frames.len()).expect("a line");
    }
    pytest::run("test_killed_recorders.py", &[("RECORDING_FOLDER", stage.path("").as_os_str())]);
}

impl Killed {
    /// Fails if a frame is missing that was published at least a second before the kill. Time for which the recorder's threads,
    /// or every thread, waited for a processor is added to this second. Returns the time from the publication of the first lost
    /// frame to the kill.
    fn check_loss(&self, published: &BTreeMap<u64, u64>, stalls: &Stalls) -> u64 {
        for pair in self.frames.windows(2) {
            let [before, after] = [&pair[0].header, &pair[1].header];
            assert_eq!((after.run_id, after.tick), (before.run_id, before.tick + 1), "kill {}", self.number);
        }
        let Some(last) = self.frames.last() else { return 0 };
        // A stalled server has published no frame that could be lost.
        let Some(&missing_ns) = published.get(&(last.header.tick + 1)) else { return 0 };
        let lost_ns = self.at_ns.saturating_sub(missing_ns);
        let granted_ns = LOSS_NS + stalls.within_ns(missing_ns, self.at_ns) + self.waited_ns;
        assert!(
            lost_ns <= granted_ns,
            "kill {}: the last {lost_ns} ns are lost, at most {granted_ns} ns are allowed",
            self.number
        );
        lost_ns
    }
}

/// Delays of a thread of this test that only sleeps and wakes up: instant and length of each.
#[derive(Default)]
struct Stalls(Mutex<Vec<(u64, u64)>>);

impl Stalls {
    fn watch_until(&self, is_over: &AtomicBool) {
        const NAP: Duration = Duration::from_millis(5);
        while !is_over.load(Ordering::Relaxed) {
            let begun_ns = monotonic_ns();
            thread::sleep(NAP);
            let ended_ns = monotonic_ns();
            let stall_ns = (ended_ns - begun_ns).saturating_sub(NAP.as_nanos() as u64);
            self.0.lock().unwrap_or_else(PoisonError::into_inner).push((ended_ns, stall_ns));
        }
    }

    /// Returns the total length of the stalls between two instants.
    fn within_ns(&self, from_ns: u64, to_ns: u64) -> u64 {
        let stalls = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let within = stalls.iter().filter(|(ended_ns, _)| (from_ns..=to_ns + LOSS_NS).contains(ended_ns));
        within.map(|(_, stall_ns)| stall_ns).sum()
    }
}
