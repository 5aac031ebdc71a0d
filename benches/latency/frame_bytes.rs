//! Encoding of frames for transports that carry bytes: the header's fields, then the handles, with the layout that they have in
//! shared memory.

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::{FrameHeader, FromBytes as _, HandleState, IntoBytes as _};

use crate::arrival::Arrival;
use crate::frame_source::HANDLES;

/// Size of a header in bytes.
pub(crate) const HEADER_BYTES: usize = FrameHeader::SHOW_BYTES;
const HANDLE_BYTES: usize = size_of::<HandleState>();
/// Size of a frame in bytes.
pub(crate) const FRAME_BYTES: usize = HEADER_BYTES + HANDLES * HANDLE_BYTES;

/// Encodes frames as bytes.
pub(crate) struct Encoder {
    handles: Vec<HandleState>,
}

impl Encoder {
    pub(crate) fn new() -> Self {
        Self { handles: vec![HandleState::default(); HANDLES] }
    }

    /// Encodes a frame. Reads the instant of sending after everything else is written.
    pub(crate) fn encode(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader, bytes: &mut [u8]) {
        let header = fill(&mut self.handles);
        let (head, body) = bytes.split_at_mut(HEADER_BYTES);
        body.copy_from_slice(self.handles.as_bytes());
        let header = FrameHeader { published_ns: monotonic_ns(), ..header };
        head.copy_from_slice(&header.as_bytes()[..HEADER_BYTES]);
    }
}

/// Reads a frame in place.
pub(crate) fn read(bytes: &[u8]) -> Arrival {
    assert_eq!(bytes.len(), FRAME_BYTES, "all frames have the same size");
    let (head, body) = bytes.split_first_chunk().expect("the frame has a header");
    let handle = |bytes| HandleState::read_from_bytes(bytes).expect("the slice has a handle's size");
    Arrival::read(FrameHeader::of_show_bytes(head), body.chunks_exact(HANDLE_BYTES).map(handle))
}
