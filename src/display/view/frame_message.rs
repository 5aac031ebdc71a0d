//! The frame message: the binary form in which a page receives a frame, and the same values as JSON.

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_ipc::{DragonMotion, DragonState, ShowState};
use serde_json::{Value, json};

use super::messages::{UNKNOWN, with_names};
use crate::config::{Config, FormationDocument};
use crate::display::observe::FrameCopy;

/// Bytes before the handles.
const HEADER_LEN: usize = 104;
/// Bytes of one handle.
const HANDLE_LEN: usize = 12;
/// Kinds of the message: a frame of one dragon, and of a formation. One more for those with heights.
const ONE_DRAGON: u32 = 1;
const FORMATION: u32 = 3;
/// Sentinel for *no bench*.
const NO_BENCH: u32 = u32::MAX;

/// Encodes a frame and its sequence number, little-endian.
///
/// | offset | type | value |
/// |---|---|---|
/// | 0 | u32 | kind of the message: 1, or 2 with heights; 3, or 4 with heights, for a formation |
/// | 4 | u32 | sequence number, which the page acknowledges |
/// | 8 | u32 | number of benches, N |
/// | 12 | u32 | state, as on the bus |
/// | 16 | f64 | run id |
/// | 24 | f64 | tick |
/// | 32 | f64 | show time in seconds |
/// | 40 | f64 | the head's travel in metres |
/// | 48 | f64 | the head's speed in metres per show second |
/// | 56 | f64 | show seconds per wall-clock second |
/// | 64 | f64 | least clearance in metres; NaN without a pair |
/// | 72 | u32, u32 | the two benches of the nearest pair; 2³² − 1 without a pair |
/// | 80 | f64, f64 | x and y of the point midway between the two, in metres |
/// | 96 | f64 | instant for which the frame is, in milliseconds of `CLOCK_MONOTONIC` |
/// | 104 | 3 × f32 for each of the N + 1 handles | x and y in metres, speed in metres per show second |
/// | 104 + 12·(N + 1) | f32 for each handle, in a message of kind 2 | z in metres |
///
/// In a message of kind 3 or 4, travel and speed are those of the leading head. Before the handles it has u32, u32: the number of
/// dragons D, and 0. Then come D × 32 bytes: f64, f64: travel and speed of the head; u32 × 4: first handle, number of benches,
/// state as on the bus, and 0. It has N + D handles.
pub(super) fn encode_frame(sequence: u32, frame: &FrameCopy, nearest: Option<PairClearance>) -> Vec<u8> {
    let header = &frame.header;
    let mut bytes = Vec::with_capacity(HEADER_LEN + frame.handles.len() * HANDLE_LEN);
    let benches = nearest.map_or([NO_BENCH; 2], |pair| pair.benches.map(|bench| bench as u32));
    let (clearance_m, point_m) = nearest.map_or((f64::NAN, [0.0; 2]), |pair| (pair.clearance_m, pair.point.to_array()));
    let has_heights = frame.handles.iter().any(|handle| handle.position_m[2] != 0.0);
    let kind = if header.is_plan == 0 { ONE_DRAGON } else { FORMATION } + u32::from(has_heights);
    bytes.extend_from_slice([kind, sequence, header.bench_count, header.state].map(u32::to_le_bytes).as_flattened());
    let doubles = [
        header.run_id as f64,
        header.tick as f64,
        header.show_time_s(),
        header.head_travel_m,
        header.head_speed_mps,
        header.time_scale,
        clearance_m,
    ];
    bytes.extend_from_slice(doubles.map(f64::to_le_bytes).as_flattened());
    bytes.extend_from_slice(benches.map(u32::to_le_bytes).as_flattened());
    let [x_m, y_m] = point_m;
    let due_ms = header.scheduled_ns as f64 * 1e-6;
    bytes.extend_from_slice([x_m, y_m, due_ms].map(f64::to_le_bytes).as_flattened());
    if header.is_plan != 0 {
        bytes.extend_from_slice([header.dragons().len() as u32, 0].map(u32::to_le_bytes).as_flattened());
        header.dragons().iter().for_each(|dragon| bytes.extend(dragon_bytes(dragon)));
    }
    for handle in &frame.handles {
        let [x_m, y_m, _] = handle.position_m;
        let floats = [x_m, y_m, handle.speed_mps()].map(|value| (value as f32).to_le_bytes());
        bytes.extend_from_slice(floats.as_flattened());
    }
    if has_heights {
        frame.handles.iter().for_each(|handle| bytes.extend((handle.position_m[2] as f32).to_le_bytes()));
    }
    bytes
}

fn dragon_bytes(dragon: &DragonMotion) -> impl Iterator<Item = u8> {
    let doubles = [dragon.travel_m, dragon.speed_mps].map(f64::to_le_bytes);
    let words = [dragon.first_handle, dragon.bench_count, dragon.state, 0].map(u32::to_le_bytes);
    doubles.into_iter().flatten().chain(words.into_iter().flatten())
}

/// Encodes a frame and its sequence number as JSON. Positions and speeds are rounded to a micrometre.
pub(super) fn frame_json(
    sequence: u32,
    frame: &FrameCopy,
    nearest: Option<PairClearance>,
    config: Option<&Config>,
) -> Value {
    let header = &frame.header;
    let nearest = nearest.map(|pair| {
        let point_m = pair.point.to_array().map(to_micrometre);
        let message = json!({ "clearance_m": pair.clearance_m, "benches": pair.benches, "point_m": point_m });
        with_names(message, config.and_then(|config| config.named_benches(pair.benches)))
    });
    let positions_m = frame.handles.iter().map(|handle| handle.position_m.map(to_micrometre));
    let mut message = json!({
        "type": "frame",
        "sequence": sequence,
        "run_id": header.run_id,
        "tick": header.tick,
        "state": header.show_state().map_or(UNKNOWN, ShowState::name),
        "time_s": header.show_time_s(),
        "travel_m": header.head_travel_m,
        "speed_mps": header.head_speed_mps,
        "time_scale": header.time_scale,
        "due_ms": header.scheduled_ns as f64 * 1e-6,
        "nearest": nearest,
        "positions_m": positions_m.collect::<Vec<_>>(),
        "speeds_mps": frame.handles.iter().map(|handle| to_micrometre(handle.speed_mps())).collect::<Vec<_>>(),
    });
    if header.is_plan != 0 {
        let names = config.and_then(Config::named).map(FormationDocument::dragons).unwrap_or_default();
        let names = names.iter().map(|named| Some(&*named.name)).chain(std::iter::repeat(None));
        message["dragons"] = header.dragons().iter().zip(names).map(dragon_json).collect();
    }
    message
}

/// A dragon of a frame, with its name if it is known.
fn dragon_json((dragon, name): (&DragonMotion, Option<&str>)) -> Value {
    json!({
        "name": name,
        "state": dragon.dragon_state().map_or(UNKNOWN, DragonState::name),
        "travel_m": dragon.travel_m,
        "speed_mps": dragon.speed_mps,
        "first_handle": dragon.first_handle,
        "benches": dragon.bench_count,
    })
}

/// Rounds a length in metres. A length that rounds to nothing is a positive 0.
fn to_micrometre(value_m: f64) -> f64 {
    (value_m * 1e6).round() / 1e6 + 0.0
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{FrameHeader, HandleState};
    use glam::DVec2;

    use super::*;

    #[test]
    fn a_frame_has_its_values_at_the_offsets_of_the_table() {
        let header = FrameHeader {
            run_id: (1 << 53) - 1,
            tick: 77,
            show_time_ns: -1_500_000_000,
            head_travel_m: -1.5,
            head_speed_mps: 1.0,
            time_scale: 20.0,
            scheduled_ns: 5_250_000_000,
            bench_count: 1,
            state: ShowState::Held.to_wire(),
            ..FrameHeader::default()
        };
        let handle = HandleState { position_m: [1.25, -2.5, 0.0], velocity_mps: [3.0, 4.0, 0.0] };
        let frame = FrameCopy { header, handles: vec![handle; 2] };
        let pair = PairClearance { benches: [3, 9], clearance_m: 0.125, point: DVec2::new(6.0, 7.0) };
        let bytes = encode_frame(u32::MAX, &frame, Some(pair));
        assert_eq!(bytes.len(), HEADER_LEN + 2 * HANDLE_LEN);
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
        let double = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight"));
        assert_eq!([0, 4, 8, 12, 72, 76].map(word), [1, u32::MAX, 1, 2, 3, 9]);
        let doubles = [16, 24, 32, 40, 48, 56, 64, 80, 88, 96].map(double);
        assert_eq!(doubles, [9_007_199_254_740_991.0, 77.0, -1.5, -1.5, 1.0, 20.0, 0.125, 6.0, 7.0, 5250.0]);
        assert_eq!([104, 108, 112, 116].map(|at| f32::from_bits(word(at))), [1.25, -2.5, 5.0, 1.25]);
    }

    #[test]
    fn a_frame_of_a_formation_has_its_dragons_before_the_handles() {
        let dragon = |first_handle, travel_m| DragonMotion {
            travel_m,
            speed_mps: 0.5,
            first_handle,
            bench_count: 1,
            state: DragonState::Ended.to_wire(),
            reserved: 0,
        };
        let header = FrameHeader { bench_count: 2, ..FrameHeader::default() };
        let header = header.of_plan([0.0; 2], &[dragon(0, 1.5), dragon(2, 2.5)]).expect("two dragons");
        let frame = FrameCopy { header, handles: vec![HandleState::default(); 4] };
        let bytes = encode_frame(0, &frame, None);
        assert_eq!((bytes[0], bytes.len()), (3, HEADER_LEN + 8 + 2 * 32 + 4 * HANDLE_LEN));
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
        let double = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight"));
        assert_eq!([104, 108, 144 + 16, 144 + 20, 144 + 24].map(word), [2, 0, 2, 1, 2]);
        assert_eq!([112, 120, 144, 152].map(double), [1.5, 0.5, 2.5, 0.5]);
        let json = frame_json(0, &frame, None, None);
        assert_eq!((&json["dragons"][1]["state"], &json["dragons"][1]["name"]), (&json!("ended"), &Value::Null));
        assert!(
            frame_json(0, &FrameCopy { header: FrameHeader::default(), handles: Vec::new() }, None, None)
                .get("dragons")
                .is_none()
        );
    }

    #[test]
    fn heights_follow_the_handles_where_there_are_some() {
        let handle = |z_m| HandleState { position_m: [1.0, 2.0, z_m], ..HandleState::default() };
        let frame = FrameCopy { header: FrameHeader::default(), handles: vec![handle(0.0), handle(1.5)] };
        let bytes = encode_frame(0, &frame, None);
        assert_eq!((bytes[0], bytes.len()), (2, HEADER_LEN + 2 * (HANDLE_LEN + 4)));
        assert_eq!(bytes[HEADER_LEN + 2 * HANDLE_LEN..], [0.0_f32, 1.5].map(f32::to_le_bytes).concat());
    }

    #[test]
    fn a_frame_without_a_pair_has_nan_and_no_benches() {
        let frame = FrameCopy { header: FrameHeader::default(), handles: Vec::new() };
        let bytes = encode_frame(0, &frame, None);
        assert!(f64::from_le_bytes(bytes[64..72].try_into().expect("eight")).is_nan());
        assert_eq!(bytes[72..80], [0xff; 8]);
    }

    #[test]
    fn the_json_of_a_frame_has_its_values_rounded_to_a_micrometre() {
        let header = FrameHeader {
            run_id: 7,
            tick: 2,
            show_time_ns: -1_500_000_000,
            scheduled_ns: 5_250_000_000,
            state: ShowState::Ready.to_wire(),
            ..FrameHeader::default()
        };
        let handle = HandleState { position_m: [1.234_567_89, -2e-9, 0.0], velocity_mps: [3.0, 4.0, 0.0] };
        let frame = FrameCopy { header, handles: vec![handle] };
        let pair = PairClearance { benches: [3, 9], clearance_m: 0.125, point: DVec2::new(6.0, 7.0) };
        let value = frame_json(9, &frame, Some(pair), None);
        assert_eq!((&value["sequence"], &value["state"], &value["time_s"]), (&9.into(), &"ready".into(), &json!(-1.5)));
        assert_eq!((&value["due_ms"], &value["nearest"]["benches"]), (&json!(5250.0), &json!([3, 9])));
        assert_eq!(value["positions_m"].to_string(), "[[1.234568,0.0,0.0]]");
        assert_eq!(value["speeds_mps"], json!([5.0]));
        assert!(frame_json(9, &frame, None, None)["nearest"].is_null());
    }
}
