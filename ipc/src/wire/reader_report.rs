//! Reports of readers: how many frames each has read and lost.

use core::str;

use iceoryx2::prelude::ZeroCopySend;

/// Bytes of a report for the reader's name.
const NAME_LEN: usize = 32;

/// Report of a reader, on the `bench-dragon/readers` service. A reader sends it about once a second while frames arrive,
/// and once more when it ends.
///
/// 104 bytes, no padding. Every [`FrameSubscriber`](crate::FrameSubscriber) sends its own report; a reader that uses
/// iceoryx2 without this library sends none.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[type_name("bench_dragon.ReaderReport.v2")]
pub struct ReaderReport {
    /// Run of the last frame that the reader has read.
    pub run_id: u64,
    /// Number of frames read since the reader opened, over all runs.
    pub frames: u64,
    /// Number of frames lost since the reader opened, over all runs: published between two frames that the reader has
    /// read, but never read.
    pub lost: u64,
    /// Bytes written since the reader opened; 0 for a reader that writes nothing.
    pub bytes_written: u64,
    /// Seconds of wall time until the disk is full, at the rate of writing so far. [`ReaderReport::NO_ROOM`] for a reader
    /// that writes nothing, or whose rate is not measured yet.
    pub room_s: f64,
    /// `CLOCK_MONOTONIC` instant of the report in nanoseconds: the sending of the last frame that the reader has read.
    pub sent_ns: u64,
    /// Number of the reader, unique on this machine. A restarted reader has a new number.
    pub reader: [u64; 2],
    /// Process id of the reader.
    pub pid: u32,
    /// In the last report of a reader: 1 if it ended in order, [`ReaderReport::DISK_FULL`] if its disk is full. 0 in all
    /// other reports, so a killed reader stays at 0.
    pub ended: u32,
    /// The reader's node name in UTF-8, cut to this length and padded with zeros. Read it with [`ReaderReport::name`].
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
    /// Sentinel for *no time known*: infinity.
    pub const NO_ROOM: f64 = f64::INFINITY;
    /// Value of `ended` for a reader that ended because its disk is full.
    pub const DISK_FULL: u32 = 2;

    /// Seconds of wall time until the disk is full; `None` if unknown.
    pub fn room(&self) -> Option<f64> {
        self.room_s.is_finite().then_some(self.room_s)
    }

    /// Whether the reader writes nothing, because its disk is full: it has ended, or waits for room.
    pub fn has_full_disk(&self) -> bool {
        self.ended == Self::DISK_FULL || self.room_s == 0.0
    }

    /// The reader's name, up to the first byte that is not valid UTF-8.
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

    /// Sets the name. A longer name is cut to as many characters as fit.
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
    fn a_byte_that_is_not_utf8_ends_a_name() {
        let mut report = named("desk");
        report.name[2] = 0xff;
        assert_eq!(report.name(), "de");
    }
}
