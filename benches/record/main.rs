//! Checks that the recorder keeps up: ten thousand frames per second for a minute, without a loss.
//!
//! Both processes are the product's own, `serve` and `record`, on a separate instance. Afterwards the bench reads the recording
//! back. It must contain every tick, in order, equal to the simulation bit for bit. `-- --seconds 5` makes the run shorter.

#[path = "../shared/mod.rs"]
mod shared;

mod cores;
mod proof;
mod show;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bench_dragon::recording::{DiskSpace, Size};
use bench_dragon::system::stop::StopFlag;
use serde_json::Value;

use shared::{Figures, seconds_or};

use proof::prove;
use show::{Show, record_show};

/// Frames per second.
pub(crate) const RATE_HZ: u32 = 10_000;
/// Bytes of a frame: a header and 224 handles.
const FRAME_BYTES: f64 = (72 + 224 * 48) as f64;
/// Exit status of a bench that a signal ends, by the convention of shells.
const INTERRUPTED: u8 = 130;
/// Default length of the recording in seconds; `--seconds` overrides it.
const SECONDS: u32 = 60;

#[allow(clippy::print_stdout, reason = "a bench prints")]
fn main() -> ExitCode {
    let seconds = seconds_or(SECONDS);
    // In cargo's folder, because the folder for temporary files may be in memory. It is removed in every case.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("cargo's target folder is writable");
    let file = folder.path().join("show.mcap");
    let mut figures = Figures::of("record");
    figures.set("seconds", seconds);
    figures.set("rate_hz", RATE_HZ);
    let (needed, free) = (needed_bytes(seconds), free_bytes(folder.path()));
    if free < needed {
        println!("nothing is recorded: this disk has {} free, must have at least {}", Size(free), Size(needed));
        figures.set("frames_published", Value::Null);
        figures.set("frames_recorded", Value::Null);
        figures.set("frames_lost", Value::Null);
    } else {
        println!("recording for {seconds} s");
        let stop = StopFlag::on_signals().expect("signal handlers can be installed");
        let show = record_show(&file, seconds, &stop);
        if stop.is_set() {
            return ExitCode::from(INTERRUPTED);
        }
        println!("reading {} back", Size(show.recorded_bytes));
        prove(&file, &show, seconds);
        println!("the recording has every tick, in order, bit for bit");
        report(&mut figures, &show);
    }
    figures.write();
    ExitCode::SUCCESS
}

fn report(figures: &mut Figures, show: &Show) {
    let raw_bytes = show.frames_recorded as f64 * FRAME_BYTES;
    let elapsed_s = show.elapsed_s;
    figures.set("frames_published", show.frames_published);
    figures.set("frames_recorded", show.frames_recorded);
    figures.set("frames_lost", show.frames_lost);
    figures.set("overruns", show.overruns);
    figures.set("in_mb_per_s", raw_bytes / elapsed_s * 1e-6);
    figures.set("out_mb_per_s", show.recorded_bytes as f64 / elapsed_s * 1e-6);
    figures.set("compression_ratio", raw_bytes / show.recorded_bytes as f64);
    figures.set("server_cores", show.server_cpu_s / elapsed_s);
    figures.set("recorder_cores", show.recorder_cpu_s / elapsed_s);
    figures.set("server_tick_p50_us", show.tick_p50_us);
    figures.set("server_tick_p999_us", show.tick_p999_us);
    for (core, busy_share) in show.busy_shares.iter().enumerate() {
        figures.set(&format!("busy_share_core_{core}"), *busy_share);
    }
}

/// Returns the size of an uncompressed recording, with a reserve.
fn needed_bytes(seconds: u32) -> u64 {
    (f64::from(seconds * RATE_HZ) * FRAME_BYTES * 1.05) as u64 + (64 << 20)
}

fn free_bytes(folder: &Path) -> u64 {
    let probe: PathBuf = folder.join("probe");
    let file = std::fs::File::create(&probe).expect("the folder belongs to this bench");
    DiskSpace::around(&file).expect("the file system reports its free space").free_bytes
}
