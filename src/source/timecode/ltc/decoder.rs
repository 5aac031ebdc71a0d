//! Samples into frames.

use super::LtcWord;

/// A frame, and when it was heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LtcFrame {
    /// The bits.
    pub word: LtcWord,
    /// The number of samples before the frame's first bit; not whole, because a change of level lies between two samples.
    pub begin: f64,
}

/// Reads frames of 24 to 30 a second, also a tenth slower or faster.
///
/// A change of level is one across the middle of the last levels, by a tenth of their distance at least. The time between two
/// changes is half a bit or a whole one. At 21.6 to 33 frames a second, half a bit is at most 1.25 times that of 27 a second, and
/// a whole one at least 1.63 times. So the limit between the two, 1.43 times, needs no knowledge of the rate.
#[derive(Clone, Debug)]
pub struct LtcDecoder {
    /// Samples of half a bit at 27 frames a second.
    half: f64,
    /// The last levels. They approach the present one, so that a quieter sound is heard after a while.
    lowest: f32,
    highest: f32,
    /// How much they approach it with each sample.
    approach: f32,
    is_high: bool,
    last: f32,
    /// Number of samples so far.
    heard: u64,
    /// The last change of level.
    changed: f64,
    /// The beginning of a one whose second half is missing.
    first_half: Option<f64>,
    word: LtcWord,
    /// The beginnings of the last bits, the oldest one at `next`.
    begins: [f64; LtcWord::BITS],
    next: usize,
    /// Number of bits since the last break.
    bits: usize,
}

impl LtcDecoder {
    /// Level below which a sound is silence.
    const SILENCE: f32 = 0.005;

    /// Reads so many samples a second.
    pub fn new(samples_per_second: u32) -> Self {
        let per_second = f64::from(samples_per_second);
        Self {
            half: per_second / (27.0 * 2.0 * LtcWord::BITS as f64),
            lowest: 0.0,
            highest: 0.0,
            // In 10 ms, the time of 20 bits, two thirds of the way.
            approach: (100.0 / per_second) as f32,
            is_high: false,
            last: 0.0,
            heard: 0,
            // No change yet: the time since then is no bit.
            changed: f64::NEG_INFINITY,
            first_half: None,
            word: LtcWord(0),
            begins: [0.0; LtcWord::BITS],
            next: 0,
            bits: 0,
        }
    }

    /// Takes the next sample, from −1 to 1. Returns a frame at the change of level after its last bit.
    pub fn push(&mut self, sample: f32) -> Option<LtcFrame> {
        let sample = if sample.is_finite() { sample.clamp(-1.0, 1.0) } else { 0.0 };
        self.lowest = sample.min(self.lowest + (sample - self.lowest) * self.approach);
        self.highest = sample.max(self.highest + (sample - self.highest) * self.approach);
        let (middle, distance) = (0.5 * (self.lowest + self.highest), self.highest - self.lowest);
        let limit = if self.is_high { middle - 0.1 * distance } else { middle + 0.1 * distance };
        let is_change = distance > 2.0 * Self::SILENCE && (sample > limit) != self.is_high;
        let frame = if is_change {
            self.is_high = !self.is_high;
            let step = sample - self.last;
            let fraction = if step == 0.0 { 1.0 } else { ((limit - self.last) / step).clamp(0.0, 1.0) };
            self.take_change(self.heard as f64 - 1.0 + f64::from(fraction))
        } else {
            None
        };
        self.last = sample;
        self.heard += 1;
        frame
    }

    fn take_change(&mut self, at: f64) -> Option<LtcFrame> {
        let begin = std::mem::replace(&mut self.changed, at);
        let halves = (at - begin) / self.half;
        let is_half = (0.6..1.43).contains(&halves);
        match (is_half, self.first_half.take()) {
            (true, None) => {
                self.first_half = Some(begin);
                None
            }
            (true, Some(first)) => self.take_bit(true, first),
            // A lone half was none of a one: the halves of ones were paired wrongly.
            (false, _) if (1.43..3.0).contains(&halves) => self.take_bit(false, begin),
            (false, _) => {
                self.bits = 0;
                None
            }
        }
    }

    fn take_bit(&mut self, bit: bool, begin: f64) -> Option<LtcFrame> {
        self.word = self.word.shifted(bit);
        self.begins[self.next] = begin;
        self.next = (self.next + 1) % LtcWord::BITS;
        self.bits += 1;
        let is_frame = self.bits >= LtcWord::BITS && self.word.is_synchronised();
        is_frame.then(|| LtcFrame { word: self.word, begin: self.begins[self.next] })
    }
}

#[cfg(test)]
mod tests {
    use super::super::LtcEncoder;
    use super::*;
    use crate::source::timecode::{Clock, FrameRate};

    const RATES: [FrameRate; 5] =
        [FrameRate::Film, FrameRate::Ebu, FrameRate::DropFrame, FrameRate::NonDrop, FrameRate::Smpte];

    /// Frames as sound: each is as long as its time, times `stretch`.
    fn sound(frames: impl Iterator<Item = i128>, rate: FrameRate, per_second: u32, stretch: f64) -> Vec<i16> {
        let (mut encoder, mut samples) = (LtcEncoder::default(), Vec::new());
        let end = |count: u32| f64::from(count) * f64::from(per_second) / rate.frames_per_second() * stretch;
        for (frame, number) in frames.zip(1..) {
            let count = end(number).round() as usize - samples.len();
            encoder.write(LtcWord::of_clock(Clock::of_frame(frame, rate), rate), count, &mut samples);
        }
        samples
    }

    fn heard(samples: impl IntoIterator<Item = f32>, per_second: u32) -> Vec<LtcFrame> {
        let mut decoder = LtcDecoder::new(per_second);
        samples.into_iter().filter_map(|sample| decoder.push(sample)).collect()
    }

    fn levels(samples: &[i16], gain: f32) -> impl Iterator<Item = f32> {
        samples.iter().map(move |&sample| f32::from(sample) / 32_768.0 * gain)
    }

    #[test]
    fn frames_are_heard_at_every_rate_pace_and_loudness_and_at_the_time_at_which_they_begin() {
        for rate in RATES {
            for per_second in [8_000, 44_100, 48_000, 96_000] {
                for (stretch, gain) in [(1.0, 1.0), (0.91, 0.02), (1.1, -2.0)] {
                    let samples = sound(1_790..1_890, rate, per_second, stretch);
                    let found = heard(levels(&samples, gain), per_second);
                    // The first frame may have no beginning, and the last one no end.
                    assert!(found.len() >= 97, "{rate} {per_second} {stretch} {gain}: {} frames", found.len());
                    let word = |frame| LtcWord::of_clock(Clock::of_frame(frame, rate), rate);
                    let first = (1_790..1_793).find(|frame| word(*frame) == found[0].word).expect("one of the first");
                    for (LtcFrame { word: heard, begin }, frame) in found.into_iter().zip(first..) {
                        assert_eq!(heard, word(frame), "{rate} {per_second}");
                        let expected =
                            (frame - 1_790) as f64 * f64::from(per_second) / rate.frames_per_second() * stretch;
                        assert!((begin - expected).abs() < 2.0, "{rate} {per_second}: {begin}, not {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_time_before_the_first_change_of_level_is_no_bit() {
        // At this loudness, the first change is not heard.
        let samples = sound(1_790..1_800, FrameRate::Ebu, 48_000, 0.91);
        let found = heard(levels(&samples, 0.02), 48_000);
        assert!(
            found.iter().all(|frame| frame.word.position(FrameRate::Ebu).is_ok() && frame.word.0.count_ones().is_multiple_of(2))
        );
        assert!(found.len() >= 8, "{}", found.len());
    }

    #[test]
    fn frames_are_heard_in_noise_and_after_a_break() {
        let mut random = fastrand::Rng::with_seed(12);
        let samples = sound(0..50, FrameRate::Ebu, 48_000, 1.0);
        let mut noisy = |sample: f32| sample + 0.04 * (random.f32() - 0.5);
        let broken = levels(&samples, 1.0).chain(std::iter::repeat_n(0.0, 4_000)).chain(levels(&samples, 0.3));
        let broken: Vec<f32> = broken.map(&mut noisy).collect();
        let found = heard(broken, 48_000);
        let words: Vec<LtcWord> =
            (0..50).map(|frame| LtcWord::of_clock(Clock::of_frame(frame, FrameRate::Ebu), FrameRate::Ebu)).collect();
        assert!(found.len() >= 95 && found.iter().all(|frame| words.contains(&frame.word)), "{}", found.len());
    }

    #[test]
    fn noise_silence_and_numbers_out_of_range_have_no_frame() {
        let mut random = fastrand::Rng::with_seed(13);
        let noise: Vec<f32> = (0..2_000_000).map(|_| random.f32() * 2.0 - 1.0).collect();
        assert_eq!(heard(noise, 48_000), []);
        let odd = [f32::NAN, f32::INFINITY, f32::MIN, f32::MAX, 0.0];
        assert_eq!(heard((0..100_000).map(|index| odd[index % odd.len()]), 48_000), []);
        assert_eq!(heard(std::iter::repeat_n(0.25, 100_000), 48_000), []);
    }
}
