//! A reader that sleeps by the clock until a frame is due.

use std::time::Duration;

use bench_dragon_ipc::{BusError, Continuity, FrameSubscriber, Show};
use test_support::eventually::{DEADLINE, eventually};

use crate::stage::Stage;

const SPIN: Duration = Duration::from_micros(100);

/// Reads this many successive frames, and returns the relation of each to the one before.
fn read(frames: &mut FrameSubscriber, count: usize) -> Vec<Continuity> {
    let mut next =
        || frames.wait_until_due(DEADLINE, SPIN).expect("the bus is readable").map(|frame| frame.continuity());
    (0..count).map(|_| eventually("the next frame", &mut next)).collect()
}

#[test]
fn it_reads_every_frame_and_those_of_the_next_server_at_another_rate() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "1", "--rate", "500", "--catch-up", "10"]);
    let mut frames = FrameSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let first = read(&mut frames, 500);
    assert_eq!(first[0], Continuity::First);
    assert_eq!(first[1..], [Continuity::Next; 499]);
    server.stop();
    let server = stage.serve(&["--readers", "1", "--rate", "50", "--catch-up", "10"]);
    let restarted = || {
        let frame = frames.wait_until_due(DEADLINE, SPIN).expect("the bus is readable")?;
        (frame.continuity() == Continuity::Restarted).then_some(())
    };
    eventually("the first frame of the next server", restarted);
    assert_eq!(read(&mut frames, 20), [Continuity::Next; 20]);
    server.stop();
}

#[test]
fn closing_ends_its_wait() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1"]);
    let show = Show::open(stage.domain(), "test", DEADLINE).expect("a server runs");
    let mut read = 0;
    eventually("two frames, from which the next one's instant is known", || {
        read += usize::from(show.wait_until_due(DEADLINE, SPIN).expect("the bus is readable").is_some());
        (read == 2).then_some(())
    });
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| {
            loop {
                match show.wait_until_due(Duration::MAX, SPIN) {
                    Ok(_) => {}
                    Err(error) => return error,
                }
            }
        });
        show.close();
        let error = waiting.join().expect("the thread ends");
        assert!(matches!(error, BusError::Closed { .. }), "{error}");
    });
    server.stop();
}
