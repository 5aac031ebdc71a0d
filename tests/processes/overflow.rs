//! A reader that does not keep up loses its own oldest frames, and counts them exactly.

use bench_dragon_ipc::service::frame_buffer;
use serde_json::json;

use crate::periods::assert_no_frame_missing;
use crate::reader::{Reader, assert_accounted_for, assert_whole};
use crate::stage::Stage;

const PAPER_BENCHES: usize = 223;

#[test]
fn a_reader_that_sleeps_loses_its_oldest_frames_and_counts_them() {
    const BEYOND: u64 = 100;
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "2000"]);
    let (mut slow, mut diligent) = (Reader::join(&stage), Reader::join(&stage));
    let first = slow.next();
    let buffer = frame_buffer(PAPER_BENCHES + 1) as u64;

    let mut watched = vec![diligent.next()];
    watched.extend(diligent.read_to_tick(first.header.tick + buffer + BEYOND));
    let mut shots = vec![first];
    shots.extend(slow.read_to_tick(watched.last().expect("the frames of many ticks").header.tick));

    assert_accounted_for(&shots, slow.lost());
    assert!(slow.lost() >= BEYOND, "{} lost", slow.lost());
    let oldest_kept = shots[1].header.tick;
    assert!(oldest_kept > shots[0].header.tick + BEYOND, "the oldest are lost, not the newest: {oldest_kept}");
    assert_accounted_for(&watched, diligent.lost());
    drop((slow, diligent));
    server.stop();
}

#[test]
fn a_show_that_fits_into_the_buffer_is_read_completely_after_its_end() {
    let stage = Stage::new();
    let periods = frame_buffer(PAPER_BENCHES + 1);
    let until_s = (periods - 1) as f64 / 1000.0;
    let server = stage.serve(&["--rate", "1000", "--until", &until_s.to_string(), "--readers", "2"]);
    let (mut first, mut second) = (Reader::join(&stage), Reader::join(&stage));
    let run_id = server.run_id;
    let summary = server.summary();
    assert_no_frame_missing(&summary, periods as u64);
    for reader in [&mut first, &mut second] {
        let shots = reader.read_unread();
        assert_whole(&shots, run_id);
        assert_eq!((json!(shots.len()), reader.lost()), (summary["frames"].clone(), 0));
    }
}
