//! The reports of readers.

use bench_dragon_ipc::service::{Member, Role};
use bench_dragon_ipc::{FrameHeader, FrameSubscriber, ReaderReport, ReaderReports, StatusReader};
use test_support::eventually::eventually;

use crate::reader::Reader;
use crate::stage::Stage;

/// Opens the reports of a stage with a server.
fn open(stage: &Stage) -> ReaderReports {
    ReaderReports::open(stage.domain(), "test-reports").expect("a server has created the services")
}

/// Waits for the next report of a reader of this name.
fn next_of(reports: &ReaderReports, name: &str) -> ReaderReport {
    eventually(&format!("{name} reports"), || {
        reports.receive().expect("reports are readable").filter(|report| report.name() == name)
    })
}

/// Connects with the present readers. A report is lost if its reader ends before the connection.
fn connect(reports: &ReaderReports) {
    while reports.receive().expect("reports are readable").is_some() {}
}

/// Returns the last report of an ended reader of this name.
fn last_of(reports: &ReaderReports, name: &str) -> ReaderReport {
    let received = std::iter::from_fn(|| reports.receive().expect("reports are readable"));
    received.filter(|report| report.name() == name).last().expect("a reader reports when it ends")
}

#[test]
fn a_reader_reports_while_it_reads_and_once_more_at_its_end() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let reports = open(&stage);
    let mut reader = Reader::join(&stage);
    let first = reader.next();
    // The reader reports when it has no more frames to read.
    let mut frames = 1 + reader.read_unread().len() as u64;
    let report = next_of(&reports, "test");
    assert!((1..=frames).contains(&report.frames), "{report:?}");
    assert_eq!((report.run_id, report.pid, report.lost), (server.run_id, std::process::id(), 0));
    assert_eq!((report.bytes_written, report.ended), (0, 0));
    let again = eventually("the reader reports again", || {
        frames += reader.read_to_tick(first.header.tick + frames).len() as u64 + reader.read_unread().len() as u64;
        reports.receive().expect("reports are readable").filter(|report| report.name() == "test")
    });
    assert_eq!(again.reader, report.reader, "the reader keeps its number");
    assert!(again.frames > report.frames && again.sent_ns >= report.sent_ns + 1_000_000_000, "{report:?} {again:?}");
    frames += reader.read_to_tick(first.header.tick + frames + 3).len() as u64;
    drop(reader);
    let last = last_of(&reports, "test");
    assert_eq!((last.frames, last.reader, last.ended), (frames, report.reader, 1));
    drop(reports);
    server.stop();
}

#[test]
fn a_reader_that_fell_behind_reports_its_lost_frames() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000", "--readers", "1"]);
    let reports = open(&stage);
    let status = StatusReader::open(stage.domain(), "test-status").expect("a server has created the services");
    let mut reader = Reader::join(&stage);
    reader.next();
    connect(&reports);
    eventually("the server has published more frames than a reader's buffer holds", || {
        status.poll().expect("the bus is readable").filter(|status| status.tick >= 600)
    });
    let summary = server.stop();
    reader.read_unread();
    let lost = reader.lost();
    assert!(lost > 0, "the reader's buffer is full");
    drop(reader);
    let report = last_of(&reports, "test");
    assert_eq!((report.lost, report.frames + report.lost), (lost, summary["frames"].as_u64().expect("a number")));
}

#[test]
fn two_readers_of_one_name_have_different_numbers() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let reports = open(&stage);
    let (mut one, mut other) = (Reader::join(&stage), Reader::join(&stage));
    one.next();
    other.next();
    connect(&reports);
    drop(one);
    let of_one = last_of(&reports, "test").reader;
    drop(other);
    assert_ne!(last_of(&reports, "test").reader, of_one);
    drop(reports);
    server.stop();
}

#[test]
fn a_recorder_reports_its_written_bytes() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--readers", "1"]);
    let reports = open(&stage);
    let recorder = stage.start(&["record", "a.mcap", "--format", "json"]);
    // From here on, the recorder is connected with the reader of its reports.
    let report = next_of(&reports, "record");
    assert_eq!(report.pid, recorder.pid());
    let summary = recorder.terminate().expect_clean().last_json();
    let last = last_of(&reports, "record");
    assert_eq!(Some(last.bytes_written), summary["bytes"].as_u64());
    assert_eq!((Some(last.frames), Some(last.lost)), (summary["frames"].as_u64(), summary["lost"].as_u64()));
    drop(reports);
    server.stop();
}

#[test]
fn frames_of_a_source_without_reports_are_read() {
    let stage = Stage::new();
    let member = Member::join(stage.domain(), "other", Role::Source { handle_count: 2 }).expect("a member");
    let frames = member.frames().expect("the service can be created");
    let mut reader = FrameSubscriber::open(stage.domain(), "test").expect("the frames are there");
    let publisher = frames.publisher_builder().initial_max_slice_len(2).create().expect("a publisher");
    let mut sample = publisher.loan_slice(2).expect("a sample");
    let header = FrameHeader { bench_count: 1, published_ns: 5_000_000_000, ..FrameHeader::default() };
    *sample.user_header_mut() = header.of_one_dragon();
    sample.send().expect("a frame");
    assert!(reader.receive().expect("the bus is readable").is_some());
    assert!(reader.receive().expect("the bus is readable").is_none());
    let absent = ReaderReports::open(stage.domain(), "test-reports").expect_err("there is no such service");
    assert!(absent.is_absent(), "{absent}");
    drop((reader, publisher, frames, member));
}
