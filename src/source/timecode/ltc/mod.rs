//! Linear timecode (LTC): a frame is 80 bits of sound, as SMPTE ST 12-1 specifies. Pure.
//!
//! | bits | content |
//! |---|---|
//! | 0–3, 8–9 | frames: units, tens |
//! | 10 | drop-frame counting |
//! | 16–19, 24–26 | seconds |
//! | 32–35, 40–42 | minutes |
//! | 48–51, 56–57 | hours |
//! | 59 at 25 frames a second, else 27 | makes the number of ones even, so each frame begins with the same polarity |
//! | 64–79 | sync word 0011 1111 1111 1101 |
//!
//! The other bits are for users, and 0 here. Of the numbers, the lowest bit comes first. The level changes at the beginning of each
//! bit, and of a one also in its middle (biphase mark). A frame is as long as its time: at 25 a second, a bit has 24 samples of
//! 48,000 a second.

mod decoder;
mod encoder;
mod receiver;
mod wav;
mod word;

pub use decoder::{LtcDecoder, LtcFrame};
pub use encoder::LtcEncoder;
pub use receiver::LtcReceiver;
pub use wav::{WavError, WavReader, wav_header};
pub use word::LtcWord;
