//! Frames: a header, then each handle.

use bench_dragon_geometry::dragon::MAX_BENCHES;
use bench_dragon_ipc::{FrameHeader, HandleState, ShowState};

use super::WireError;
use super::fields::{Fields, concatenated, finite, pair_of, run_id};

/// Encoding of frames: a [`FrameHeader`] and its handles, see [`encode_frame`].
pub const FRAME_ENCODING: &str = "application/octet-stream;bench_dragon.Frame.v1";
/// Bytes of a header.
pub const HEADER_BYTES: usize = size_of::<FrameHeader>();
/// Bytes of a handle.
pub const HANDLE_BYTES: usize = size_of::<HandleState>();
/// Bytes of the longest frame that is taken.
pub const MAX_FRAME_BYTES: usize = HEADER_BYTES + (MAX_BENCHES + 1) * HANDLE_BYTES;

/// A frame as bytes: the 72 of its header, then 48 for each handle.
pub fn encode_frame(header: &FrameHeader, handles: &[HandleState]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + handles.len() * HANDLE_BYTES);
    bytes.extend_from_slice(&encode_header(header));
    for HandleState { position_m, velocity_mps } in handles {
        for value in position_m.iter().chain(velocity_mps) {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

/// Reads a frame. The handles are written over what `handles` holds, so that its memory is used again.
///
/// # Errors
/// Whatever is not as a source publishes it.
pub fn decode_frame(bytes: &[u8], handles: &mut Vec<HandleState>) -> Result<FrameHeader, WireError> {
    let too_short = WireError::Length { got: bytes.len(), expected: HEADER_BYTES + 2 * HANDLE_BYTES };
    let (head, body) = bytes.split_at_checked(HEADER_BYTES).ok_or(too_short)?;
    let header = decode_header(head)?;
    let handle_count = header.bench_count as usize + 1;
    let expected = handle_count * HANDLE_BYTES;
    if body.len() != expected {
        return Err(WireError::Length { got: bytes.len(), expected: HEADER_BYTES + expected });
    }
    handles.clear();
    handles.reserve_exact(handle_count);
    let mut fields = Fields(body);
    for _ in 0..handle_count {
        let handle = HandleState { position_m: fields.doubles(), velocity_mps: fields.doubles() };
        finite(&handle.position_m)?;
        finite(&handle.velocity_mps)?;
        handles.push(handle);
    }
    Ok(header)
}

fn encode_header(header: &FrameHeader) -> [u8; HEADER_BYTES] {
    concatenated([
        header.run_id,
        header.tick,
        header.sim_time_ns as u64,
        header.scheduled_ns,
        header.published_ns,
        header.head_travel_m.to_bits(),
        header.head_speed_mps.to_bits(),
        header.time_scale.to_bits(),
        pair_of(header.bench_count, header.state),
    ])
}

fn decode_header(bytes: &[u8]) -> Result<FrameHeader, WireError> {
    let mut fields = Fields::of(bytes, HEADER_BYTES)?;
    let header = FrameHeader {
        run_id: fields.word(),
        tick: fields.word(),
        sim_time_ns: fields.word() as i64,
        scheduled_ns: fields.word(),
        published_ns: fields.word(),
        head_travel_m: fields.double(),
        head_speed_mps: fields.double(),
        time_scale: fields.double(),
        bench_count: fields.half(),
        state: fields.half(),
    };
    run_id(header.run_id)?;
    finite(&[header.head_travel_m, header.head_speed_mps, header.time_scale])?;
    ShowState::from_wire(header.state).ok_or(WireError::Unknown(header.state))?;
    let is_dragon = (1..=MAX_BENCHES).contains(&(header.bench_count as usize));
    if is_dragon { Ok(header) } else { Err(WireError::BenchCount(header.bench_count)) }
}

#[cfg(test)]
mod tests {
    use super::super::fields::RUN_ID_END;
    use super::*;
    use proptest::prelude::*;

    fn finite_double() -> impl Strategy<Value = f64> {
        any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |value| value.is_finite())
    }

    prop_compose! {
        fn any_header()(
            run_id in 0..RUN_ID_END, tick: u64, sim_time_ns: i64, scheduled_ns: u64, published_ns: u64,
            head_travel_m in finite_double(), head_speed_mps in finite_double(), time_scale in finite_double(),
            bench_count in 1_u32..=40, state in 0_u32..6,
        ) -> FrameHeader {
            FrameHeader { run_id, tick, sim_time_ns, scheduled_ns, published_ns, head_travel_m, head_speed_mps, time_scale,
                bench_count, state }
        }
    }

    fn any_handle() -> impl Strategy<Value = HandleState> {
        let vector = || [finite_double(), finite_double(), finite_double()];
        (vector(), vector()).prop_map(|(position_m, velocity_mps)| HandleState { position_m, velocity_mps })
    }

    fn any_frame() -> impl Strategy<Value = (FrameHeader, Vec<HandleState>)> {
        any_header().prop_flat_map(|header| {
            let count = header.bench_count as usize + 1;
            (Just(header), proptest::collection::vec(any_handle(), count))
        })
    }

    proptest! {
        #[test]
        fn a_frame_reads_back_to_the_last_bit((header, handles) in any_frame()) {
            let bytes = encode_frame(&header, &handles);
            prop_assert_eq!(bytes.len(), HEADER_BYTES + handles.len() * HANDLE_BYTES);
            let mut read = vec![HandleState::default(); 3];
            let read_header = decode_frame(&bytes, &mut read).expect("it was encoded here");
            prop_assert_eq!(encode_frame(&read_header, &read), bytes);
        }

        #[test]
        fn a_frame_that_is_cut_or_longer_is_refused((header, handles) in any_frame(), cut in 1_usize..200, extra in 1_usize..99) {
            let bytes = encode_frame(&header, &handles);
            let mut read = Vec::new();
            prop_assert!(decode_frame(&bytes[..bytes.len().saturating_sub(cut)], &mut read).is_err());
            prop_assert!(decode_frame(&[bytes, vec![0; extra]].concat(), &mut read).is_err());
        }

        #[test]
        fn a_frame_with_any_byte_changed_is_refused_or_is_what_it_says(
            (header, handles) in any_frame(), at: prop::sample::Index, byte: u8,
        ) {
            let mut bytes = encode_frame(&header, &handles);
            let at = at.index(bytes.len());
            bytes[at] = byte;
            let mut read = Vec::new();
            if let Ok(header) = decode_frame(&bytes, &mut read) {
                prop_assert_eq!(encode_frame(&header, &read), bytes);
            }
        }

        #[test]
        fn a_frame_with_one_value_that_is_no_number_is_refused((header, handles) in any_frame(), at: prop::sample::Index) {
            let mut bytes = encode_frame(&header, &handles);
            let at = HEADER_BYTES + at.index(handles.len() * 6) * 8;
            bytes[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
            prop_assert_eq!(decode_frame(&bytes, &mut Vec::new()), Err(WireError::NotFinite));
        }
    }

    #[test]
    fn a_header_stands_where_the_bus_has_it() {
        let header =
            FrameHeader { run_id: 1, tick: 2, sim_time_ns: -3, bench_count: 4, state: 1, ..FrameHeader::default() };
        let bytes = encode_frame(&header, &[]);
        assert_eq!(bytes[0..8], 1_u64.to_le_bytes());
        assert_eq!(bytes[8..16], 2_u64.to_le_bytes());
        assert_eq!(bytes[16..24], (-3_i64).to_le_bytes());
        assert_eq!(bytes[64..68], 4_u32.to_le_bytes());
        assert_eq!(bytes[68..72], 1_u32.to_le_bytes());
    }

    #[test]
    fn numbers_that_no_source_has_are_refused() {
        let handles = [HandleState::default(); 2];
        let sound = FrameHeader { bench_count: 1, ..FrameHeader::default() };
        let read = |header: FrameHeader| decode_frame(&encode_frame(&header, &handles), &mut Vec::new());
        assert_eq!(read(sound), Ok(sound));
        assert_eq!(read(FrameHeader { bench_count: 0, ..sound }), Err(WireError::BenchCount(0)));
        assert_eq!(read(FrameHeader { bench_count: u32::MAX, ..sound }), Err(WireError::BenchCount(u32::MAX)));
        assert_eq!(read(FrameHeader { run_id: RUN_ID_END, ..sound }), Err(WireError::RunId(RUN_ID_END)));
        assert_eq!(read(FrameHeader { state: 6, ..sound }), Err(WireError::Unknown(6)));
        assert_eq!(read(FrameHeader { head_travel_m: f64::INFINITY, ..sound }), Err(WireError::NotFinite));
    }
}
