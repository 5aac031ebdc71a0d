//! The wall clock is set during a show. The machine's own clock would affect other processes, so a preloaded library replaces
//! libc's wall clock for the processes of the test. The program reads the wall clock from libc, and `CLOCK_MONOTONIC` from the
//! kernel. Setting the wall clock does not change the latter.

use std::fs::File;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::ShowState;
use test_support::process::Process;
use test_support::skip::has_programs;

use crate::reader::{Reader, assert_whole};
use crate::record;
use crate::stage::Stage;

const HOUR_S: i64 = 3600;

/// A wall clock that the test can set.
struct WallClock {
    library: PathBuf,
    offset: PathBuf,
}

impl WallClock {
    /// Builds the library.
    fn new(stage: &Stage) -> Self {
        let (library, offset) = (stage.path("wall_clock.so"), stage.path("offset"));
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/processes/wall_clock.c");
        let mut compiler = Command::new("cc");
        compiler.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(source);
        Process::start(compiler).end().expect_clean();
        let clock = Self { library, offset };
        clock.set(0);
        clock
    }

    /// Sets the clock to this offset in seconds from the machine's clock. The file is changed in place, since it is mapped.
    fn set(&self, offset_s: i64) {
        let file = File::options().write(true).create(true).truncate(false).open(&self.offset);
        let written = file.and_then(|mut file| file.write_all(&offset_s.to_ne_bytes()));
        written.expect("the stage's folder is its own");
    }

    /// Adds the clock to a command.
    fn give(&self, mut command: Command) -> Command {
        command.env("LD_PRELOAD", &self.library).env("WALL_CLOCK_OFFSET", &self.offset);
        command
    }

    /// Returns the offset from the machine's clock that another program sees, in whole hours.
    fn seen_offset_s(&self) -> i64 {
        let mut date = Command::new("date");
        date.arg("+%s");
        let seen = Process::start(self.give(date)).end().expect_clean().stdout;
        let seen: i64 = seen.trim().parse().expect("seconds");
        let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("the clock is after 1970").as_secs() as i64;
        (seen - now + HOUR_S / 2).div_euclid(HOUR_S) * HOUR_S
    }
}

#[test]
fn a_wall_clock_set_forward_and_back_by_an_hour_changes_nothing() {
    // The bus keeps ten seconds of such ticks for a reader.
    const TICK_NS: u64 = 50_000_000;
    if !has_programs(&["cc"]) {
        return;
    }
    let stage = Stage::new();
    let clock = WallClock::new(&stage);
    let start = |args: &[&str]| Process::start(clock.give(stage.command(args)));
    let mut server = start(&["serve", "--rate", "20", "--catch-up", "10", "--readers", "4", "--format", "json"]);
    let run_id = server.json()["run_id"].as_u64().expect("a run has a number");
    let monitor = start(&["monitor", "--format", "json"]);
    let recorder = start(&["record", "a.mcap", "--format", "json"]);
    let latency = start(&["latency", "--seconds", "1000", "--format", "json"]);
    let mut reader = Reader::join(&stage);
    let mut shots = reader.read_to_tick(10);
    for (offset_s, until) in [(HOUR_S, 30), (-HOUR_S, 50), (0, 60)] {
        clock.set(offset_s);
        assert_eq!(clock.seen_offset_s(), offset_s, "the clock can be set");
        // New readers and commands work as before.
        assert_eq!(start(&["echo", "--count", "1"]).end().expect_clean().stdout.lines().count(), 1);
        assert_eq!(start(&["ctl", "speed", "1"]).end().expect_clean().code(), Some(0));
        shots.extend(reader.read_to_tick(until));
    }
    let summary = server.terminate().expect_clean().last_json();
    let ended_ns = monotonic_ns();
    shots.extend(reader.read_unread());
    let accounts = [monitor, recorder, latency].map(|process| process.terminate().expect_clean().last_json());

    assert_whole(&shots, run_id);
    let periods: Vec<u64> = shots
        .windows(2)
        .map(|pair| {
            let [before, after] = [&pair[0].header, &pair[1].header];
            // The last frame shows the head at rest, at the pose of the tick before.
            let walked_ns =
                if after.show_state() == Some(ShowState::Ended) { 0 } else { after.scheduled_ns - before.scheduled_ns };
            assert_eq!(after.show_time_ns - before.show_time_ns, walked_ns as i64);
            assert_eq!((after.scheduled_ns - before.scheduled_ns) % TICK_NS, 0);
            (after.scheduled_ns - before.scheduled_ns) / TICK_NS
        })
        .collect();
    // The server also counts the periods that it missed after its last frame.
    let skipped = periods.iter().sum::<u64>() - periods.len() as u64;
    let most = skipped + (ended_ns - shots[shots.len() - 1].header.scheduled_ns) / TICK_NS;
    let overruns = summary["overruns"].as_u64().expect("a number");
    assert!((skipped..=most).contains(&overruns), "{overruns} overruns, not from {skipped} to {most}");
    for account in &accounts {
        assert_eq!(
            account["lost"].as_u64().zip(account["frames"].as_u64()),
            Some((0, shots.len() as u64)),
            "{account}"
        );
    }
    let (recorded, was_cut) = record::read(&stage.path("a.mcap"));
    assert!(!was_cut);
    assert_eq!(recorded, shots.iter().map(|shot| shot.header).collect::<Vec<_>>());
}
