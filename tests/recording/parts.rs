//! The parts of a recording, read as one: in the recorded order, each message once, with the gaps between them.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use bench_dragon::recording::{Coverage, PartOf, Parts, PartsReader, Recorded, Recorder, RecorderSettings, Timeline};
use bench_dragon_ipc::{Command, CommandEvent, CommandReply, EventKind, FrameHeader, Request, Sender};
use tempfile::tempdir;

use crate::dance::{OFFSET_NS, RUN_ID, TOML, alert, frame};

const BENCHES: u32 = 3;

/// Writes a part: the frames and alerts of these ticks of a run, and command events of these numbers.
fn write_part(path: &Path, run_id: u64, ticks: impl Iterator<Item = u64>, numbers: impl Iterator<Item = u64>) {
    let mut recorder = Recorder::start(RecorderSettings::new(path, OFFSET_NS)).expect("a recorder");
    recorder.describe(run_id, TOML).expect("the configuration");
    let command = Command { sender: Sender::Ctl.to_wire(), ..Request::Pause.to_wire() };
    for number in numbers {
        let event = CommandEvent::answered(&command, &CommandReply::accepted(run_id, number));
        recorder.record(&CommandEvent { run_id, number, ..event }, 0).expect("an event");
    }
    for tick in ticks {
        let frame = frame(tick, BENCHES);
        let moved_ns = (run_id - RUN_ID) * 60_000_000_000;
        let header = FrameHeader {
            run_id,
            scheduled_ns: frame.header.scheduled_ns + moved_ns,
            published_ns: frame.header.published_ns + moved_ns,
            ..frame.header
        };
        recorder.frame(&header, &frame.handles).expect("a frame");
        if tick.is_multiple_of(10) {
            let alert = bench_dragon_ipc::Alert { run_id, ..alert(tick) };
            recorder.record(&alert, header.published_ns).expect("an alert");
        }
    }
    recorder.finish().expect("a finished recording");
}

/// Reads all frames, alerts and command events, each as its run and its tick or number.
fn read(parts: &Parts) -> ([Vec<(u64, u64)>; 3], Coverage) {
    let mut reader = PartsReader::new(Arc::new(parts.clone()));
    let mut found: [Vec<(u64, u64)>; 3] = Default::default();
    while let Some(recorded) = reader.next_wanted(|_| true).expect("readable parts") {
        match recorded {
            Recorded::Frame(frame) => found[0].push((frame.header.run_id, frame.header.tick)),
            Recorded::Alert(recorded) => found[1].push((recorded.alert.run_id, recorded.alert.tick)),
            Recorded::Command(event) => found[2].push((event.run_id, event.number)),
            _ => {}
        }
    }
    let coverage = reader.coverage();
    (found, coverage)
}

#[test]
fn parts_are_joined_in_the_recorded_order_whatever_their_names_and_each_message_once() {
    let folder = tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let next_run = RUN_ID + 1;
    write_part(&path("a.mcap"), next_run, 0..50, 0..2);
    write_part(&path("b.mcap"), RUN_ID, 300..400, 1..6);
    write_part(&path("recording-10.mcap"), RUN_ID, 100..250, 0..4);
    write_part(&path("recording-2.mcap"), RUN_ID, 0..120, 0..3);
    fs::write(path("notes.txt"), "not a recording").expect("a file");
    let parts = Parts::find(folder.path()).expect("a folder with recordings");
    let names: Vec<_> = parts.files.iter().filter_map(|path| path.file_name()?.to_str()).collect();
    assert_eq!(names, ["recording-2.mcap", "recording-10.mcap", "b.mcap", "a.mcap"]);
    let ([frames, alerts, events], coverage) = read(&parts);
    let ticks = (0..250).chain(300..400).map(|tick| (RUN_ID, tick)).chain((0..50).map(|tick| (next_run, tick)));
    assert_eq!(frames, ticks.clone().collect::<Vec<_>>());
    assert_eq!(alerts, ticks.filter(|(_, tick)| tick % 10 == 0).collect::<Vec<_>>());
    let numbers = (0..6).map(|number| (RUN_ID, number)).chain((0..2).map(|number| (next_run, number)));
    assert_eq!(events, numbers.collect::<Vec<_>>());
    assert_eq!((coverage.parts, coverage.recorded, coverage.repeated, coverage.missing), (4, 400, 20, 50));
    let [gap] = &coverage.gaps[..] else { panic!("{coverage:?}") };
    assert_eq!((gap.run_id, gap.from_tick, gap.to_tick, gap.frames), (RUN_ID, 250, 299, 50));
    let told = gap.to_string();
    assert_eq!(
        told,
        format!(
            "gap: 50 frames are missing, ticks 250 to 299 of run {RUN_ID}, show time -99.751 to -99.700 s, 0.1 s of wall time; \
             between recording-10.mcap and b.mcap"
        )
    );
}

#[test]
fn missing_begins_and_recorded_ends_are_gaps_and_a_summary_tells_what_no_part_has() {
    let folder = tempdir().expect("a folder");
    let path = folder.path().join("recording.mcap");
    let mut recorder = Recorder::start(RecorderSettings::new(&path, OFFSET_NS)).expect("a recorder");
    recorder.describe(RUN_ID, TOML).expect("the configuration");
    for tick in 7..20 {
        let frame = frame(tick, BENCHES);
        recorder.frame(&frame.header, &frame.handles).expect("a frame");
    }
    let end = CommandEvent { run_id: RUN_ID, number: 9, ..CommandEvent::plain(EventKind::End, Sender::Server, 25) };
    recorder.record(&end, 0).expect("an event");
    recorder.finish().expect("a finished recording");
    fs::write(folder.path().join("summary.json"), r#"{"frames":{"published":100}}"#).expect("a file");
    let (_, coverage) = read(&Parts::find(folder.path()).expect("a recording"));
    let gaps: Vec<_> = coverage.gaps.iter().map(|gap| (gap.from_tick, gap.to_tick, gap.wall_s)).collect();
    assert_eq!(gaps, [(0, 6, None), (20, 25, None)]);
    assert_eq!((coverage.recorded, coverage.missing, coverage.unplaced(), coverage.lacking()), (13, 13, 74, 87));
}

#[test]
fn a_part_names_its_place_and_a_copy_is_no_other_part() {
    let folder = tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    write_part(&path("one.mcap"), RUN_ID, 0..50, 0..1);
    write_part(&path("stranger.mcap"), RUN_ID + 5, 0..50, 0..1);
    fs::copy(path("one.mcap"), path("copy.mcap")).expect("a copy");
    assert_eq!(PartOf::find(&path("one.mcap")).expect("a recording"), None);
    write_part(&path("two.mcap"), RUN_ID, 60..90, 0..1);
    let place = |name: &str| {
        let part = PartOf::find(&path(name)).expect("a recording");
        part.map(|part| (part.number, part.count))
    };
    assert_eq!(["one.mcap", "copy.mcap", "two.mcap"].map(place), [Some((1, 2)), Some((1, 2)), Some((2, 2))]);
    assert_eq!(place("stranger.mcap"), None);
    fs::write(path("config.toml"), TOML).expect("a file");
    assert_eq!(place("stranger.mcap"), Some((3, 3)), "all recordings of a show's folder are its parts");
}

#[test]
fn a_file_that_is_no_recording_is_named_and_a_folder_without_recordings_is_refused() {
    let folder = tempdir().expect("a folder");
    let refused = Parts::find(folder.path()).expect_err("the folder is empty").to_string();
    assert!(refused.ends_with(" has no recording: no file *.mcap that can be read"), "{refused}");
    write_part(&folder.path().join("one.mcap"), RUN_ID, 0..5, 0..1);
    fs::write(folder.path().join("two.mcap"), "not a recording").expect("a file");
    fs::write(folder.path().join("three.mcap"), "").expect("a file");
    let parts = Parts::find(folder.path()).expect("a recording");
    let mut unreadable: Vec<_> = parts.unreadable.iter().filter_map(|(path, _)| path.file_name()?.to_str()).collect();
    unreadable.sort_unstable();
    assert_eq!((parts.files.len(), unreadable), (1, vec!["three.mcap", "two.mcap"]));
}

#[test]
fn a_reader_begins_at_every_position_of_the_timeline_also_in_an_unfinished_part() {
    let folder = tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    write_part(&path("one.mcap"), RUN_ID, 0..3000, 0..1);
    write_part(&path("two.mcap"), RUN_ID, 3500..6000, 0..1);
    let bytes = fs::read(path("one.mcap")).expect("the recording");
    let summary_start = mcap::read::footer(&bytes).expect("a footer").summary_start as usize;
    fs::write(path("one.mcap"), &bytes[..summary_start - 5]).expect("a file without its end");
    let parts = Arc::new(Parts::find(folder.path()).expect("recordings"));
    let timeline = Timeline::of(&parts).expect("readable parts");
    let length_s = timeline.length_ns() as f64 / 1e9;
    assert!((length_s - 5.999).abs() < 0.01, "{length_s}");
    for (position_s, tick) in [(0.0, 0), (0.5, 500), (2.9, 2900), (3.2, 3500), (4.0, 4000), (5.9, 5900)] {
        let position_ns = (position_s * 1e9) as u64;
        let place = timeline.place(position_ns, 0).expect("a chunk");
        let mut reader = PartsReader::open_at(Arc::clone(&parts), &place).expect("a readable part");
        let log_time_ns = timeline.log_time_ns(position_ns);
        let found = std::iter::from_fn(|| reader.next_wanted(|_| true).expect("readable frames"))
            .find_map(|recorded| match recorded {
                Recorded::Frame(frame) => Some(frame).filter(|frame| frame.log_time_ns >= log_time_ns),
                _ => None,
            })
            .expect("a frame at this position");
        // A frame is sent up to 0.03 ms after it was due.
        assert!(found.header.tick.abs_diff(tick) <= 1, "{} at {position_s} s", found.header.tick);
        assert_eq!(reader.configuration().map(|known| known.run_id), Some(RUN_ID));
        assert_eq!(timeline.position_ns(found.log_time_ns) / 100_000_000, found.header.tick / 100);
    }
}
