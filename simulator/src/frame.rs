//! A frame on the simulated bus. All readers share one copy, as in shared memory.

use std::hash::{Hash as _, Hasher};

use bench_dragon_ipc::{FrameHeader, HandleState};
use zerocopy::IntoBytes as _;

/// A published frame.
#[derive(Clone, Debug)]
pub(crate) struct BusFrame {
    pub(crate) header: FrameHeader,
    /// Whether a seek put the head there.
    pub(crate) is_sought: bool,
    pub(crate) handles: Vec<HandleState>,
}

/// Hashes all bits of a header but those of the dragons that a frame does not have.
pub(crate) fn hash_header(header: &FrameHeader, hasher: &mut impl Hasher) {
    let unused = header.dragons.len() - (header.dragon_count as usize).min(header.dragons.len());
    let bytes = header.as_bytes();
    bytes[..bytes.len() - unused * size_of_val(&header.dragons[0])].hash(hasher);
}
