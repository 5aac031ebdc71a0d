//! A reader of frames inside the test, which copies what it reads.

use std::time::Instant;

use bench_dragon_ipc::{Continuity, Frame, FrameHeader, FrameSubscriber, HandleState, ShowState, frame_bytes};
use test_support::eventually::{DEADLINE, eventually_from};

use crate::stage::Stage;

/// A frame, copied out of shared memory.
#[derive(Clone, Debug)]
pub(crate) struct Shot {
    pub(crate) header: FrameHeader,
    pub(crate) handles: Vec<HandleState>,
    pub(crate) continuity: Continuity,
}

/// A subscriber whose waits have a deadline. After it, the test fails with the awaited event and the last frame.
#[derive(Debug)]
pub(crate) struct Reader {
    frames: FrameSubscriber,
    last: Option<FrameHeader>,
}

impl Reader {
    /// Joins a stage with a server.
    pub(crate) fn join(stage: &Stage) -> Self {
        Self::new(FrameSubscriber::open(stage.domain(), "test").expect("a server has created the services"))
    }

    /// Waits for a server, and joins its stage.
    #[track_caller]
    pub(crate) fn await_server(stage: &Stage) -> Self {
        let open = || FrameSubscriber::open(stage.domain(), "test").map_err(|error| error.to_string());
        Self::new(eventually_from("a server has created the services", open))
    }

    fn new(frames: FrameSubscriber) -> Self {
        Self { frames, last: None }
    }

    /// Waits for the next frame.
    #[track_caller]
    pub(crate) fn next(&mut self) -> Shot {
        let begun = Instant::now();
        loop {
            // The wait may end early without a frame.
            if let Some(frame) = self.frames.wait(DEADLINE).expect("the bus is readable") {
                self.last = Some(*frame.header());
                return Shot::of(&frame);
            }
            assert!(
                begun.elapsed() < DEADLINE,
                "waited {DEADLINE:?} for the next frame; the last one: {:?}",
                self.last
            );
        }
    }

    /// Returns the unread frames; if the server has ended, all that remain.
    pub(crate) fn read_unread(&mut self) -> Vec<Shot> {
        let mut receive = || self.frames.receive().expect("the bus is readable").map(|frame| Shot::of(&frame));
        std::iter::from_fn(&mut receive).collect()
    }

    /// Returns frames up to the first wanted one, which is the last element. `what` completes the message "waited … until".
    #[track_caller]
    pub(crate) fn read_until(&mut self, what: &str, is_wanted: impl Fn(&FrameHeader) -> bool) -> Vec<Shot> {
        let begun = Instant::now();
        let mut shots = vec![self.next()];
        while !shots.last().is_some_and(|shot| is_wanted(&shot.header)) {
            assert!(begun.elapsed() < DEADLINE, "waited {DEADLINE:?} until {what}; the last frame: {:?}", self.last);
            shots.push(self.next());
        }
        shots
    }

    /// Returns frames up to a tick, which is the last element unless it was lost.
    #[track_caller]
    pub(crate) fn read_to_tick(&mut self, tick: u64) -> Vec<Shot> {
        self.read_until(&format!("tick {tick}"), |header| header.tick >= tick)
    }

    /// Returns frames up to the last frame of the show.
    #[track_caller]
    pub(crate) fn read_to_end(&mut self) -> Vec<Shot> {
        self.read_until("the show ends", |header| {
            matches!(header.show_state(), Some(ShowState::Finished | ShowState::Ended))
        })
    }

    pub(crate) fn lost(&self) -> u64 {
        self.frames.lost()
    }
}

impl Shot {
    fn of(frame: &Frame) -> Self {
        Self { header: *frame.header(), handles: frame.handles().to_vec(), continuity: frame.continuity() }
    }

    pub(crate) fn state(&self) -> ShowState {
        self.header.show_state().expect("a state that this version knows")
    }

    /// Returns the frame's bytes in shared memory.
    pub(crate) fn wire_bytes(&self) -> Vec<u8> {
        frame_bytes(&self.header, &self.handles)
    }

    /// Returns the header's values in their order, as bits.
    pub(crate) fn header_words(&self) -> [u64; 10] {
        let header = &self.header;
        [
            header.run_id,
            header.tick,
            header.show_time_ns as u64,
            header.scheduled_ns,
            header.published_ns,
            header.head_travel_m.to_bits(),
            header.head_speed_mps.to_bits(),
            header.time_scale.to_bits(),
            header.bench_count.into(),
            header.state.into(),
        ]
    }
}

/// Fails unless all frames are of one run, each continuity matches the ticks, and the first frame is the reader's first.
pub(crate) fn assert_accounted_for(shots: &[Shot], lost: u64) {
    let [first, .., last] = shots else { panic!("two frames at least") };
    assert_eq!(first.continuity, Continuity::First);
    for pair in shots.windows(2) {
        let [before, after] = pair else { unreachable!("windows of two") };
        assert_eq!(after.header.run_id, before.header.run_id);
        let gap = after.header.tick - before.header.tick - 1;
        let expected = if gap == 0 { Continuity::Next } else { Continuity::Lost(gap) };
        assert_eq!(after.continuity, expected, "tick {} after {}", after.header.tick, before.header.tick);
    }
    assert_eq!(shots.len() as u64 + lost, last.header.tick - first.header.tick + 1, "received and lost");
}

/// Fails unless these are all frames of a run, from tick 0 on.
pub(crate) fn assert_whole(shots: &[Shot], run_id: u64) {
    for (tick, shot) in shots.iter().enumerate() {
        assert_eq!((shot.header.run_id, shot.header.tick), (run_id, tick as u64));
    }
}
