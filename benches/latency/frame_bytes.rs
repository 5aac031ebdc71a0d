//! A frame as bytes, for transports that carry nothing else: the header's fields and then the handles, in the order and
//! the size that they have in shared memory.

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::{FrameHeader, HandleState};

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
        for (handle, bytes) in self.handles.iter().zip(body.chunks_exact_mut(HANDLE_BYTES)) {
            let values = handle.position_m.iter().chain(&handle.velocity_mps);
            for (value, bytes) in values.zip(bytes.chunks_exact_mut(8)) {
                bytes.copy_from_slice(&value.to_le_bytes());
            }
        }
        encode_header(&FrameHeader { published_ns: monotonic_ns(), ..header }, head);
    }
}

/// Reads a frame where it lies.
pub(crate) fn read(bytes: &[u8]) -> Arrival {
    assert_eq!(bytes.len(), FRAME_BYTES, "a frame has one size");
    let (head, body) = bytes.split_at(HEADER_BYTES);
    Arrival::read(decode_header(head), body.chunks_exact(HANDLE_BYTES).map(decode_handle))
}

fn encode_header(header: &FrameHeader, bytes: &mut [u8]) {
    let words = [
        header.run_id,
        header.tick,
        header.sim_time_ns as u64,
        header.scheduled_ns,
        header.published_ns,
        header.head_travel_m.to_bits(),
        header.head_speed_mps.to_bits(),
        header.time_scale.to_bits(),
        u64::from(header.state) << 32 | u64::from(header.bench_count),
    ];
    for (word, bytes) in words.iter().zip(bytes.chunks_exact_mut(8)) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
}

fn decode_header(bytes: &[u8]) -> FrameHeader {
    let word = |index: usize| u64::from_le_bytes(eight(&bytes[8 * index..8 * (index + 1)]));
    FrameHeader {
        run_id: word(0),
        tick: word(1),
        sim_time_ns: word(2) as i64,
        scheduled_ns: word(3),
        published_ns: word(4),
        head_travel_m: f64::from_bits(word(5)),
        head_speed_mps: f64::from_bits(word(6)),
        time_scale: f64::from_bits(word(7)),
        bench_count: word(8) as u32,
        state: (word(8) >> 32) as u32,
    }
}

fn decode_handle(bytes: &[u8]) -> HandleState {
    let value = |index: usize| f64::from_le_bytes(eight(&bytes[8 * index..8 * (index + 1)]));
    HandleState { position_m: [value(0), value(1), value(2)], velocity_mps: [value(3), value(4), value(5)] }
}

fn eight(bytes: &[u8]) -> [u8; 8] {
    bytes.try_into().expect("eight bytes")
}
