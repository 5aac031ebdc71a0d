//! How long the current folder's disk would last for a recording.

use std::fs::File;
use std::io;

use super::{Check, Finding, Patient};
use crate::recording::{DiskSpace, Size};

/// A disk that would be full sooner than this is warned of.
const LEAST_S: f64 = 3600.0;
/// What compression leaves of a recording.
const COMPRESSED: f64 = 0.6;

/// The disk of the current folder.
pub(super) struct Disk;

impl Check for Disk {
    fn name(&self) -> &'static str {
        "disk"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        let config = patient.config();
        let frame_bytes = size_of::<bench_dragon_ipc::FrameHeader>()
            + (config.dragon().dimensions().benches() + 1) * size_of::<bench_dragon_ipc::HandleState>();
        let space = File::open(patient.folder()).and_then(|folder| DiskSpace::around(&folder));
        judge(space, frame_bytes as f64 * f64::from(config.rate_hz()) * COMPRESSED)
    }
}

fn judge(space: io::Result<DiskSpace>, bytes_per_s: f64) -> Finding {
    let DiskSpace { free_bytes, .. } = match space {
        Ok(space) => space,
        Err(error) => return Finding::not_known(format!("the current folder cannot be read: {error}")),
    };
    let seconds = free_bytes as f64 / bytes_per_s;
    let value = format!("{} free", Size(free_bytes));
    let message = format!(
        "the current folder has {} free, for some {:.1} hours of recording",
        Size(free_bytes),
        seconds / 3600.0
    );
    if seconds < LEAST_S {
        return Finding::warning(
            value,
            message,
            "free some, record elsewhere, or bound it: `record FILE --max-total-mb MB`",
        );
    }
    Finding::ok(value, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn less_than_an_hour_is_warned_of() {
        let judged = |free_bytes| judge(Ok(DiskSpace { free_bytes, total_bytes: 1 << 40 }), 1e6).status;
        assert_eq!(judged(3_600_000_000), Verdict::Ok);
        assert_eq!(judged(3_599_000_000), Verdict::Warning);
    }
}
