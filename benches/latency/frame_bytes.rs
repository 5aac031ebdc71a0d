//! A frame as bytes, for transports that carry nothing else: the header's fields and then the handles, in the order and
//! the size that they have in shared memory.

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::{FrameHeader, FromBytes as _, HandleState, IntoBytes as _};

use crate::arrival::Arrival;
use crate::frame_source::HANDLES;

const HEADER_BYTES: usize = size_of::<FrameHeader>();
const HANDLE_BYTES: usize = size_of::<HandleState>();
/// Size of a frame.
pub(crate) const FRAME_BYTES: usize = HEADER_BYTES + HANDLES * HANDLE_BYTES;

/// Writes frames as bytes.
pub(crate) struct Encoder {
    handles: Vec<HandleState>,
}

impl Encoder {
    pub(crate) fn new() -> Self {
        Self { handles: vec![HandleState::default(); HANDLES] }
    }

    /// Writes a frame. The instant of sending is that at which all else stands.
    pub(crate) fn encode(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader, bytes: &mut [u8]) {
        let header = fill(&mut self.handles);
        let (head, body) = bytes.split_at_mut(HEADER_BYTES);
        body.copy_from_slice(self.handles.as_bytes());
        head.copy_from_slice(FrameHeader { published_ns: monotonic_ns(), ..header }.as_bytes());
    }
}

/// Reads a frame where it lies.
pub(crate) fn read(bytes: &[u8]) -> Arrival {
    assert_eq!(bytes.len(), FRAME_BYTES, "a frame has one size");
    let (head, body) = bytes.split_at(HEADER_BYTES);
    let handle = |bytes| HandleState::read_from_bytes(bytes).expect("a handle has one size");
    let header = FrameHeader::read_from_bytes(head).expect("a header has one size");
    Arrival::read(header, body.chunks_exact(HANDLE_BYTES).map(handle))
}
