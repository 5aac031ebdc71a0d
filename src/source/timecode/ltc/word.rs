//! The 80 bits of a frame.

use crate::source::timecode::{Clock, FrameRate, Malformed, Position};

/// The bits of a frame; bit 0 is the first one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LtcWord(pub(super) u128);

impl LtcWord {
    /// Number of bits.
    pub const BITS: usize = 80;
    /// The sync word, in the order of the bits.
    const SYNC: u128 = 0b1011_1111_1111_1100;
    const SYNC_AT: usize = 64;
    const DROP_FRAME_AT: usize = 10;
    /// First bit and number of bits of the units and the tens of frames, seconds, minutes and hours.
    const FIELDS: [[(usize, usize); 2]; 4] =
        [[(0, 4), (8, 2)], [(16, 4), (24, 3)], [(32, 4), (40, 3)], [(48, 4), (56, 2)]];

    /// The frame of a clock.
    pub fn of_clock(clock: Clock, rate: FrameRate) -> Self {
        let Clock { hours, minutes, seconds, frames } = clock;
        let mut bits = Self::SYNC << Self::SYNC_AT | u128::from(rate == FrameRate::DropFrame) << Self::DROP_FRAME_AT;
        for ([(units_at, _), (tens_at, _)], number) in Self::FIELDS.into_iter().zip([frames, seconds, minutes, hours]) {
            bits |= u128::from(number % 10) << units_at | u128::from(number / 10) << tens_at;
        }
        let polarity_at = if rate == FrameRate::Ebu { 59 } else { 27 };
        Self(bits | u128::from(bits.count_ones() % 2) << polarity_at)
    }

    /// The bits in bytes, bit 0 as the lowest bit of the first byte.
    pub fn bytes(self) -> [u8; Self::BITS / 8] {
        *self.0.to_le_bytes().first_chunk().expect("16 bytes have 10")
    }

    /// The position of the frame. A frame does not contain its rate: `rate` applies, unless the frame has drop-frame counting.
    ///
    /// # Errors
    /// [`Malformed`] for numbers that no clock of this rate shows.
    pub fn position(self, rate: FrameRate) -> Result<Position, Malformed> {
        let bits = |(at, count): (usize, usize)| (self.0 >> at) as u32 & ((1 << count) - 1);
        let mut numbers = [0; 4];
        for (number, [units, tens]) in numbers.iter_mut().zip(Self::FIELDS) {
            let (units, tens) = (bits(units), bits(tens));
            *number = if units < 10 { 10 * tens + units } else { return Err(Malformed) };
        }
        let [frames, seconds, minutes, hours] = numbers;
        let is_drop_frame = bits((Self::DROP_FRAME_AT, 1)) == 1;
        let rate = if is_drop_frame { FrameRate::DropFrame } else { rate };
        Position::of_clock(Clock { hours, minutes, seconds, frames }, rate)
    }

    /// Whether the last bits are the sync word.
    pub(super) fn is_synchronised(self) -> bool {
        self.0 >> Self::SYNC_AT == Self::SYNC
    }

    /// The word after one more bit: the first one is lost.
    pub(super) fn shifted(self, bit: bool) -> Self {
        Self(self.0 >> 1 | u128::from(bit) << (Self::BITS - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_has_the_bits_of_the_standard() {
        let clock = Clock { hours: 12, minutes: 34, seconds: 56, frames: 23 };
        let LtcWord(bits) = LtcWord::of_clock(clock, FrameRate::Ebu);
        let text: String = (0..80).map(|at| if bits >> at & 1 == 1 { '1' } else { '0' }).collect();
        // Frames 3 and 2, seconds 6 and 5, minutes 4 and 3, hours 2 and 1, each followed by four user bits, and the sync word.
        // Bit 59 makes the number of ones even.
        assert_eq!(
            text,
            concat!("1100", "0000", "0100", "0000", "0110", "0000", "1010", "0000", "0010", "0000", "1100", "0000")
                .to_owned()
                + concat!("0100", "0000", "1001", "0000", "0011111111111101")
        );
    }

    #[test]
    fn each_word_of_a_day_has_an_even_number_of_ones_and_its_position() {
        for rate in [FrameRate::Film, FrameRate::Ebu, FrameRate::DropFrame, FrameRate::NonDrop, FrameRate::Smpte] {
            for frame in 0..rate.frames_per_day() {
                let clock = Clock::of_frame(frame.into(), rate);
                let word = LtcWord::of_clock(clock, rate);
                assert!(
                    word.0.count_ones().is_multiple_of(2) && word.is_synchronised() && word.0 >> 80 == 0,
                    "{clock:?}"
                );
                assert_eq!(word.position(rate), Position::of_clock(clock, rate), "{rate} {clock:?}");
            }
        }
    }

    #[test]
    fn numbers_that_no_clock_shows_are_malformed() {
        let word = LtcWord::of_clock(Clock::default(), FrameRate::Ebu).0;
        for wrong in
            [word | 0b1010, word | 0b0101 | 0b10 << 8, word | 0b111 << 24, word | 0b111 << 40, word | 0b11 << 56]
        {
            assert_eq!(LtcWord(wrong).position(FrameRate::Ebu), Err(Malformed), "{wrong:b}");
        }
        // Drop-frame counting leaves out 00:01:00:00.
        let skipped = LtcWord(word | 1 << 32 | 1 << 10);
        assert_eq!(skipped.position(FrameRate::Ebu), Err(Malformed));
    }
}
