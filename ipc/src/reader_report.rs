//! What a reader says of itself: how many frames it has read, and how many it has lost.

use core::str;

use iceoryx2::prelude::ZeroCopySend;

/// Bytes that a report has for the reader's name.
const NAME_LEN: usize = 32;

/// A reader's account of itself, on the `bench-dragon/readers` service: about once a second while frames come, and once more
/// when the reader ends.
///
/// 104 bytes, no padding. Every [`FrameSubscriber`](crate::FrameSubscriber) sends its own; a reader that uses iceoryx2 without
/// this library sends none.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[type_name("bench_dragon.ReaderReport.v2")]
pub struct ReaderReport {
    /// Run of the last frame that it has read.
    pub run_id: u64,
    /// Frames read since it opened, over all runs.
    pub frames: u64,
    /// Frames lost since it opened, over all runs: published between two that it has read, and never read.
    pub lost: u64,
    /// Bytes written since it opened; 0 for a reader that writes nothing.
    pub bytes_written: u64,
    /// Seconds of wall time until the disk is full, at the rate of writing so far; [`ReaderReport::NO_ROOM`] for a reader that
    /// writes nothing, or does not know it yet.
    pub room_s: f64,
    /// `CLOCK_MONOTONIC` instant of the report in nanoseconds: that at which the last frame read was sent.
    pub sent_ns: u64,
    /// A number that no other reader on this machine has, nor this one when it is started again.
    pub reader: [u64; 2],
    /// Process id of the reader.
    pub pid: u32,
    /// 1 in the last report, of a reader that ended in order; 0 before, and for ever of one that was killed.
    pub ended: u32,
    /// The reader's node name in UTF-8, cut to what there is room for, and filled up with zeros. Read it with
    /// [`ReaderReport::name`].
    pub name: [u8; NAME_LEN],
}

const _: () = assert!(size_of::<ReaderReport>() == 104 && align_of::<ReaderReport>() == 8);

impl Default for ReaderReport {
    fn default() -> Self {
        Self {
            run_id: 0,
            frames: 0,
            lost: 0,
            bytes_written: 0,
            room_s: Self::NO_ROOM,
            sent_ns: 0,
            reader: [0; 2],
            pid: 0,
            ended: 0,
            name: [0; NAME_LEN],
        }
    }
}

impl ReaderReport {
    /// Sentinel for *no room known*: infinity.
    pub const NO_ROOM: f64 = f64::INFINITY;

    /// Seconds of wall time until the disk is full, where the reader knows it.
    pub fn room(&self) -> Option<f64> {
        self.room_s.is_finite().then_some(self.room_s)
    }

    /// The reader's name; of one that is no UTF-8, what comes before that.
    ///
    /// ```
    /// use bench_dragon_ipc::ReaderReport;
    ///
    /// let mut report = ReaderReport::default();
    /// report.set_name("head-printer");
    /// assert_eq!(report.name(), "head-printer");
    /// ```
    pub fn name(&self) -> &str {
        let length = self.name.iter().position(|byte| *byte == 0).unwrap_or(NAME_LEN);
        let bytes = &self.name[..length];
        match str::from_utf8(bytes) {
            Ok(name) => name,
            Err(error) => str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or_default(),
        }
    }

    /// Sets the name; of a longer one than there is room for, as many characters as fit.
    pub fn set_name(&mut self, name: &str) {
        let bytes = &name.as_bytes()[..name.floor_char_boundary(NAME_LEN)];
        self.name = [0; NAME_LEN];
        self.name[..bytes.len()].copy_from_slice(bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> ReaderReport {
        let mut report = ReaderReport::default();
        report.set_name("a name that was there before and is longer");
        report.set_name(name);
        report
    }

    #[test]
    fn a_long_name_is_cut_between_two_characters() {
        assert_eq!(named("").name(), "");
        assert_eq!(named("Bänke").name(), "Bänke");
        let fits = "a".repeat(NAME_LEN);
        assert_eq!(named(&fits).name(), fits);
        let cut_within = format!("{}ä", "a".repeat(NAME_LEN - 1));
        assert_eq!(named(&cut_within).name(), "a".repeat(NAME_LEN - 1));
    }

    #[test]
    fn what_is_no_text_ends_a_name() {
        let mut report = named("desk");
        report.name[2] = 0xff;
        assert_eq!(report.name(), "de");
    }
}
