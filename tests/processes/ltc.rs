//! Linear timecode. libltc, another implementation, hears what this program writes, and writes what a server hears.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use bench_dragon::source::timecode::ltc::LtcWord;
use bench_dragon::source::timecode::{Clock, FrameRate};
use bench_dragon_ipc::ShowState;
use test_support::process::Process;
use test_support::skip::skip;

use crate::bad_input::assert_one_error;
use crate::bridge_timecode::read_until_they_agree;
use crate::reader::Reader;
use crate::stage::Stage;
use crate::timecode::event;

/// Compiles the judge. Skips the test if libltc is not installed.
fn judge(stage: &Stage) -> Option<PathBuf> {
    if !Path::new("/usr/include/ltc.h").exists() {
        skip("libltc-dev is not installed (tests/run installs it on Debian as root)");
        return None;
    }
    let program = stage.path("judge");
    let mut compiler = Command::new("cc");
    compiler.args(["-O1", "-Wall", "-Wextra", "-Werror", "-o"]).arg(&program);
    compiler.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/processes/ltc_judge.c")).arg("-lltc");
    Process::start(compiler).end().expect_clean();
    Some(program)
}

/// Runs the judge with its stdin from a file and its stdout into another one.
fn run(judge: &Path, args: &[&str], from: Option<&Path>, to: &Path) {
    let mut command = Command::new(judge);
    command.args(args).stdout(File::create(to).expect("a file"));
    command.stdin(from.map_or(Stdio::null(), |from| File::open(from).expect("a file").into()));
    let status = command.status().expect("the judge runs");
    assert!(status.success(), "{args:?}: {status}");
}

/// Starts a shell command in a stage's folder, with the program as `bench_dragon` and the instances of two stages as `one` and
/// `other`.
fn shell(one: &Stage, other: &Stage, script: &str) -> Process {
    let mut command = Command::new("bash");
    command.args(["-c", &format!("set -o pipefail; {script}")]).current_dir(one.path(""));
    command.env("bench_dragon", env!("CARGO_BIN_EXE_bench-dragon"));
    command.env("one", one.domain().instance().as_str()).env("other", other.domain().instance().as_str());
    Process::start(command)
}

#[test]
fn each_frame_of_24_hours_has_the_bits_of_libltc() {
    let stage = Stage::new();
    let Some(judge) = judge(&stage) else { return };
    // libltc takes 29.97 for drop-frame. Without it, the numbers are those of 30.
    for (fps, rates) in [
        ("24", &[FrameRate::Film][..]),
        ("25", &[FrameRate::Ebu]),
        ("29.97", &[FrameRate::DropFrame]),
        ("30", &[FrameRate::Smpte, FrameRate::NonDrop]),
    ] {
        run(&judge, &["day", fps], None, &stage.path("day"));
        let day = fs::read(stage.path("day")).expect("the judge's frames");
        let (frames, rest) = day.as_chunks::<10>();
        for rate in rates {
            assert_eq!((frames.len(), rest.len()), (rate.frames_per_day() as usize, 0), "{rate}");
            for (bytes, frame) in frames.iter().zip(0..) {
                let word = LtcWord::of_clock(Clock::of_frame(frame, *rate), *rate);
                assert_eq!(word.bytes(), *bytes, "{rate} frame {frame}");
            }
        }
    }
}

#[test]
fn libltc_hears_each_frame_of_a_show_once_and_where_it_begins() {
    let stage = Stage::new();
    let Some(judge) = judge(&stage) else { return };
    // The first minute without its first two numbers, and the length of drop-frame.
    for (fps, drop_frame) in [("25", 0), ("29.97", 1), ("29.97ndf", 0)] {
        let server = stage.serve(&["--rate", "100", "--start-at", "58"]);
        let mut reader = Reader::join(&stage);
        let args = ["bridge", "timecode", "--format", "json", "--ltc", "show.wav", "--rate", fps];
        let mut bridge = stage.start(&args);
        assert_eq!(bridge.json()["type"], "started");
        reader.read_until("the show has passed a minute", |header| header.show_time_s() > 62.0);
        let summary = bridge.terminate().expect_clean().last_json();
        let overruns = server.stop()["overruns"].clone();
        let rate: FrameRate = fps.parse().expect("a rate");
        run(&judge, &["hear", fps.trim_end_matches("ndf")], Some(&stage.path("show.wav")), &stage.path("heard"));
        let heard = fs::read_to_string(stage.path("heard")).expect("the judge's frames");
        // libltc knows the length of a bit after the first frames.
        let lines = heard.lines().skip(3);
        let heard: Vec<Vec<i64>> =
            lines.map(|line| line.split(' ').map(|word| word.parse().expect("a number")).collect()).collect();
        // On a machine that is too busy, the show jumps, or the sound goes on from the present.
        if summary["late"] == 0 && overruns == 0 {
            assert!(heard.len() > 90, "{fps}: {} frames", heard.len());
            let first = (0..i128::from(rate.frames_per_day()))
                .find(|frame| clock(*frame, rate) == heard[0][..4])
                .expect("a frame of a day");
            for (line, frame) in heard.iter().zip(first..) {
                assert_eq!((&line[..4], line[4]), (&clock(frame, rate)[..], drop_frame), "{fps}: frame {frame}");
                let expected = (frame - first) as f64 * 48_000.0 / rate.frames_per_second();
                let drift = (line[5] - heard[0][5]) as f64 - expected;
                assert!(drift.abs() < 4.0, "{fps}: frame {frame} is shifted by {drift} samples");
            }
        }
        let wav = fs::read(stage.path("show.wav")).expect("the sound");
        let length = u32::from_le_bytes(wav[40..44].try_into().expect("four bytes"));
        assert_eq!(length as usize, wav.len() - 44, "the header is completed at the end");
        fs::remove_file(stage.path("show.wav")).expect("the file exists");
    }
}

fn clock(frame: i128, rate: FrameRate) -> [i64; 4] {
    let Clock { hours, minutes, seconds, frames } = Clock::of_frame(frame, rate);
    [hours, minutes, seconds, frames].map(i64::from)
}

#[test]
fn a_server_follows_the_sound_of_libltc_from_a_file() {
    let stage = Stage::new();
    let Some(judge) = judge(&stage) else { return };
    for (fps, flag, begin_s) in [("25", None, 60.0), ("30", Some("29.97ndf"), 60.06), ("29.97", None, 60.0)] {
        // Frames of 00:01:00:00, or with drop-frame :02.
        let first = if fps == "29.97" { "2" } else { "0" };
        run(&judge, &["sound", fps, "0", "1", "0", first, "300"], None, &stage.path("libltc.wav"));
        let flags = flag.map_or(vec![], |flag| vec!["--timecode-fps", flag]);
        let mut server = stage.serve(&[&["--rate", "50", "--timecode", "ltc:libltc.wav"], &flags[..]].concat());
        let mut reader = Reader::join(&stage);
        let line = event(&mut server.process, "follows");
        let position_s = line["position_s"].as_f64().expect("a position");
        assert!((begin_s..begin_s + 9.0).contains(&position_s), "{fps}: {line}");
        let runs = |header: &bench_dragon_ipc::FrameHeader| header.show_state() == Some(ShowState::Running);
        reader.read_until("the show runs with the sound", |header| runs(header) && header.show_time_s() > begin_s);
        event(&mut server.process, "lost");
        let summary = server.process.terminate().expect_clean();
        let counts = summary.stdout.lines().find(|line| line.contains("timecode_summary")).expect("the counts");
        let counts: serde_json::Value = serde_json::from_str(counts).expect("JSON");
        // The first frame has no beginning, the last one no end.
        assert!(counts["taken"].as_u64() >= Some(297) && counts["malformed"] == 0, "{fps}: {counts}");
    }
}

#[test]
fn a_second_show_follows_the_first_one_through_a_pipe_of_sound() {
    let [one, other] = [Stage::new(), Stage::new()];
    let first = one.serve(&["--rate", "50", "--start-at", "100"]);
    let script = "\"$bench_dragon\" bridge timecode --ltc - --rate 29.97 --instance \"$one\" | \"$bench_dragon\" serve --rate 50 \
                  --timecode ltc:- --timecode-timeout 5 --format json --instance \"$other\"";
    let mut second = shell(&one, &other, script);
    assert_eq!(second.json()["type"], "started");
    let (mut leading, mut following) = (Reader::join(&one), Reader::join(&other));
    event(&mut second, "follows");
    let header = read_until_they_agree(&mut leading, &mut following);
    assert!(header.show_time_s() > 100.0);
    one.run(&["ctl", "hold"]).expect_clean();
    event(&mut second, "stands");
    let held = leading.read_until("the first show is held", |header| header.show_state() == Some(ShowState::Held));
    let held_s = held.last().expect("the wanted frame").header.show_time_s();
    following.read_until("the second show stands where the first one does", |header| {
        header.show_state() == Some(ShowState::Paused) && (header.show_time_s() - held_s).abs() < 0.04
    });
    one.run(&["ctl", "seek", "200"]).expect_clean();
    one.run(&["ctl", "release"]).expect_clean();
    let header = read_until_they_agree(&mut leading, &mut following);
    assert!(header.show_time_s() > 150.0, "the second show follows the seek");
    // The bridge ends when nobody hears it any more.
    other.run(&["ctl", "stop"]).expect_clean();
    second.end();
    first.stop();
}

#[test]
fn impossible_sounds_are_refused_in_one_line() {
    let stage = Stage::new();
    fs::write(stage.path("text.wav"), "no sound").expect("a file");
    let cases: &[(&[&str], &[&str])] = &[
        (&["serve", "--timecode", "ltc:"], &["'ltc:'", "must be ltc:- for stdin, or ltc:FILE.wav"]),
        (&["serve", "--timecode", "ltc:text.wav"], &["--timecode ltc:text.wav must be sound in WAV"]),
        (&["serve", "--timecode", "ltc:missing.wav"], &["--timecode ltc:missing.wav", "No such file or directory"]),
        (
            &["show", "--timecode", "ltc:-"],
            &["--timecode is ltc:-, must be osc or artnet in a show", "start `bench-dragon serve --timecode ltc:-`"],
        ),
        (&["bridge", "timecode", "--ltc", "-", "--format", "json"], &["--format is json, must be text with --ltc -"]),
        (&["bridge", "timecode", "--ltc", "-", "--art-net", "10.0.0.255"], &["--ltc <-|FILE.wav>", "--art-net"]),
        (
            &["bridge", "timecode", "--ltc", "-", "--sample-rate", "100"],
            &["--sample-rate", "'100'", "from 8000 to 192000"],
        ),
    ];
    for (args, named) in cases {
        assert_one_error(&stage.run(args), 2, named);
    }
    let exists = stage.run(&["bridge", "timecode", "--ltc", "text.wav"]);
    assert_eq!((exists.code(), exists.stderr.lines().count()), (Some(1), 1), "{}", exists.stderr);
    assert!(exists.stderr.contains("cannot create text.wav"), "{}", exists.stderr);
}
