//! Where samples wait for the loop, in a ring.
//!
//! Neither end ever waits for the other, wherever that was interrupted: a sample is there when it is whole, and not before.

use rtrb::{Consumer, Producer, RingBuffer};

use super::Sample;

/// A second of the fastest timecode that is taken, for the slowest server.
const MOST_SAMPLES: usize = 2048;

/// The loop's end.
#[derive(Debug)]
pub struct Inbox(Consumer<Sample>);

/// The receiving thread's end.
#[derive(Debug)]
pub(super) struct Slot(Producer<Sample>);

/// An inbox with nothing in it, and its slot.
pub(super) fn inbox() -> (Slot, Inbox) {
    let (slot, inbox) = RingBuffer::new(MOST_SAMPLES);
    (Slot(slot), Inbox(inbox))
}

impl Inbox {
    /// Takes the samples that are there, oldest first.
    pub fn take(&mut self) -> impl Iterator<Item = Sample> {
        (0..self.0.slots()).map_while(|_| self.0.pop().ok())
    }
}

impl Slot {
    /// Leaves a sample behind those before; where the loop has taken none for long, there is no room, and it is lost.
    pub(super) fn leave(&mut self, sample: Sample) {
        let _ = self.0.push(sample);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::timecode::Position;

    fn sample(arrived_ns: u64) -> Sample {
        Sample { position: Position { since_midnight_s: 60.0, day_s: 86_400.0 }, arrived_ns }
    }

    #[test]
    fn samples_are_taken_once_and_in_their_order() {
        let (mut slot, mut inbox) = inbox();
        assert_eq!(inbox.take().count(), 0);
        slot.leave(sample(1));
        slot.leave(sample(2));
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(1), sample(2)]);
        assert_eq!(inbox.take().count(), 0);
    }

    #[test]
    fn a_loop_that_takes_nothing_keeps_nobody_waiting() {
        let (mut slot, mut inbox) = inbox();
        (0..2 * MOST_SAMPLES as u64).for_each(|arrived_ns| slot.leave(sample(arrived_ns)));
        assert_eq!(inbox.take().count(), MOST_SAMPLES);
        slot.leave(sample(7));
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(7)]);
    }

    /// The loop may be on the processor of a thread that it has interrupted, and at a real-time priority: whatever it waited for
    /// would never come.
    #[test]
    fn a_sample_that_is_half_left_keeps_nobody_waiting() {
        let (mut slot, mut inbox) = inbox();
        slot.leave(sample(1));
        let half_left = slot.0.write_chunk_uninit(1).expect("there is room");
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(1)]);
        half_left.fill_from_iter([sample(2)]);
        assert_eq!(inbox.take().collect::<Vec<_>>(), [sample(2)]);
    }
}
