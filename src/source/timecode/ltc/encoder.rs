//! Frames into samples.

use super::LtcWord;

/// Writes frames as samples. The level of a frame begins where that of the last one ended. A sample has the mean level of its
/// time, so a change of level may lie within a sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct LtcEncoder {
    is_high: bool,
}

impl LtcEncoder {
    /// Level of the samples: 6 dB below the greatest one.
    const LEVEL: i16 = i16::MAX / 2;

    /// Adds a frame of so many samples to `samples`.
    pub fn write(&mut self, LtcWord(bits): LtcWord, count: usize, samples: &mut Vec<i16>) {
        const HALVES: usize = 2 * LtcWord::BITS;
        let first = samples.len();
        samples.resize(first + count, 0);
        for half in 0..HALVES {
            let is_change = half % 2 == 0 || bits >> (half / 2) & 1 == 1;
            self.is_high ^= is_change;
            let level = if self.is_high { Self::LEVEL } else { -Self::LEVEL };
            // A sample lasts for HALVES units of time, and half a bit for `count`.
            let (begin, end) = (half * count, (half + 1) * count);
            for index in begin / HALVES..end.div_ceil(HALVES) {
                let common = end.min((index + 1) * HALVES) - begin.max(index * HALVES);
                samples[first + index] += (i32::from(level) * common as i32 / HALVES as i32) as i16;
            }
        }
    }
}
