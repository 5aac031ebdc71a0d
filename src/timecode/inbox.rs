//! Where the newest sample is left for the loop: a triple buffer, one sample for each end and one between them.
//!
//! Neither end ever waits for the other, wherever that was interrupted: leaving and taking are one atomic exchange each. What is
//! not taken before the next one comes is lost, as it should be.

use triple_buffer::{Input, Output, triple_buffer};

use super::Sample;

/// The loop's end.
#[derive(Debug)]
pub struct Inbox(Output<Option<Sample>>);

/// The receiving thread's end.
#[derive(Debug)]
pub(super) struct Slot(Input<Option<Sample>>);

/// An inbox with nothing in it, and its slot.
pub(super) fn inbox() -> (Slot, Inbox) {
    let (slot, inbox) = triple_buffer(&None);
    (Slot(slot), Inbox(inbox))
}

impl Inbox {
    /// Takes the newest sample, where there is one that has not been taken.
    pub fn take(&mut self) -> Option<Sample> {
        if self.0.update() { *self.0.output_buffer() } else { None }
    }
}

impl Slot {
    /// Leaves a sample in the place of the one before.
    pub(super) fn leave(&mut self, sample: Sample) {
        self.0.write(Some(sample));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timecode::Position;

    fn sample(arrived_ns: u64) -> Sample {
        Sample { position: Position { since_midnight_s: 60.0, day_s: 86_400.0 }, arrived_ns }
    }

    #[test]
    fn the_newest_sample_is_taken_once() {
        let (mut slot, mut inbox) = inbox();
        assert_eq!(inbox.take(), None);
        slot.leave(sample(1));
        slot.leave(sample(2));
        assert_eq!((inbox.take(), inbox.take()), (Some(sample(2)), None));
    }

    /// The loop may be on the processor of a thread that it has interrupted, and at a real-time priority: whatever it waited for
    /// would never come.
    #[test]
    fn a_sample_that_is_half_left_keeps_nobody_waiting() {
        let (mut slot, mut inbox) = inbox();
        slot.leave(sample(1));
        *slot.0.input_buffer_mut() = Some(sample(2));
        assert_eq!((inbox.take(), inbox.take()), (Some(sample(1)), None));
        slot.0.publish();
        assert_eq!(inbox.take(), Some(sample(2)));
    }
}
