//! Which frames of a run are sent. Pure, and the same for whoever asks: it depends on nothing but the run.

use bench_dragon_ipc::FrameHeader;

/// How many of the frames are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// One of so many, at least 1.
    OneOf(u64),
    /// As many a second as come nearest to this from below, at least 1.
    RateHz(u32),
}

/// The choice for one run.
#[derive(Clone, Copy, Debug)]
pub struct Thinning {
    every: u64,
    state: Option<u32>,
}

impl Thinning {
    /// The choice for a run whose frames come at a rate, or at one that is not known where it is 0: then all are sent,
    /// unless it was said how many.
    pub fn of(share: Share, rate_hz: u32) -> Self {
        let every = match share {
            Share::OneOf(every) => every.max(1),
            Share::RateHz(wanted_hz) => u64::from(rate_hz.div_ceil(wanted_hz.max(1)).max(1)),
        };
        Self { every, state: None }
    }

    /// Of the frames, those are sent whose tick is a multiple of this, and those that change the state.
    pub fn every(&self) -> u64 {
        self.every
    }

    /// Whether to send this frame. A change of the state is never left out: it may be the last thing that is said.
    pub fn takes(&mut self, header: &FrameHeader) -> bool {
        let is_change = self.state.is_some_and(|state| state != header.state);
        self.state = Some(header.state);
        is_change || header.tick.is_multiple_of(self.every)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::replay::FASTEST_HZ;
    use proptest::prelude::*;

    fn sent(share: Share, frames: &[(u64, u32)]) -> Vec<u64> {
        let mut thinning = Thinning::of(share, 1000);
        let header = |(tick, state)| FrameHeader { tick, state, ..FrameHeader::default() };
        frames.iter().filter(|&&frame| thinning.takes(&header(frame))).map(|frame| frame.0).collect()
    }

    #[test]
    fn one_of_so_many_is_sent_and_every_change_of_the_state() {
        let frames: Vec<_> = (0..12).map(|tick| (tick, u32::from(tick == 7))).collect();
        assert_eq!(sent(Share::OneOf(5), &frames), [0, 5, 7, 8, 10]);
        assert_eq!(sent(Share::OneOf(1), &frames).len(), frames.len());
    }

    #[test]
    fn a_rate_is_never_exceeded() {
        assert_eq!(Thinning::of(Share::RateHz(60), 1000).every(), 17);
        assert_eq!(Thinning::of(Share::RateHz(1000), 1000).every(), 1);
        assert_eq!(Thinning::of(Share::RateHz(2000), 1000).every(), 1);
        assert_eq!(Thinning::of(Share::RateHz(60), 0).every(), 1, "a run of another version");
    }

    proptest! {
        #[test]
        fn what_is_sent_is_as_near_to_the_rate_as_a_whole_step_comes(wanted_hz in 1..=FASTEST_HZ, rate_hz in 1..=FASTEST_HZ) {
            let every = Thinning::of(Share::RateHz(wanted_hz), rate_hz).every();
            prop_assert!(u64::from(rate_hz) <= every * u64::from(wanted_hz));
            prop_assert!(every == 1 || u64::from(rate_hz) > (every - 1) * u64::from(wanted_hz));
        }
    }
}
