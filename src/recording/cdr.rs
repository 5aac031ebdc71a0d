//! Messages of a recording as little-endian CDR, the encoding of ROS 2, and the choice of frames that are recorded for viewers.
//!
//! A message has four bytes that name the encoding, then the fields in the order of its topic's definition. Each field is
//! aligned to its size, counted from after those four bytes. Every value keeps its bits. The types of the bus have the same
//! fields in the same order, without padding. So their messages are their bytes in shared memory.

use std::{fmt, io::Write as _};

use bench_dragon_ipc::{BenchState, DragonMotion, FrameHeader, FromBytes, HandleState, IntoBytes as _};

/// Little-endian plain CDR, no options.
pub(super) const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];
/// Frame of reference of the poses, and parent of the benches' frames.
pub(super) const STAGE: &str = "stage";

const _: () =
    assert!(cfg!(target_endian = "little"), "messages are the bytes of shared memory, and CDR is little-endian");

/// Replaces the contents of `message` with a frame. A frame of a plan has its place on the course and its dragons at the end.
pub fn encode_frame(message: &mut Vec<u8>, header: &FrameHeader, handles: &[HandleState]) {
    encode(message, &header.as_bytes()[..FrameHeader::SHOW_BYTES]);
    message.extend((handles.len() as u32).to_le_bytes());
    if !handles.is_empty() {
        // Padding aligns the handles to eight bytes.
        message.extend([0; 4]);
    }
    message.extend(handles.as_bytes());
    if header.is_plan == 1 {
        message.extend([header.course_m, header.course_mps].as_bytes());
        message.extend((header.dragons().len() as u64).to_le_bytes());
        message.extend(header.dragons().as_bytes());
    }
}

/// Replaces the contents of `message` with the poses of all benches of one dragon at a Unix time, in the frame of reference `stage`.
pub fn encode_poses(message: &mut Vec<u8>, unix_ns: u64, handles: &[HandleState]) {
    let benches = BenchState::all(handles);
    encode(message, stamp(unix_ns).as_bytes());
    append_string(message, format_args!("{STAGE}"));
    append_number(message, benches.len() as u32);
    for bench in benches {
        message.extend(pose(&bench).as_bytes());
    }
}

/// Replaces the contents of `message` with the poses of all dragons as transforms from `stage` to `bench_0`, `bench_1` and so on,
/// the head first. With `names`, those of the dragons, to `gold/bench_0` and so on.
pub fn encode_transforms(
    message: &mut Vec<u8>,
    unix_ns: u64,
    header: &FrameHeader,
    handles: &[HandleState],
    names: &[String],
) {
    let stamp = stamp(unix_ns);
    encode(message, &[]);
    append_number(message, header.bench_count);
    for (dragon, motion) in header.dragons().iter().enumerate() {
        let prefix = names.get(dragon).map(|name| format!("{name}/")).unwrap_or_default();
        for (index, bench) in motion.benches(handles).enumerate() {
            align(message, size_of::<u32>());
            message.extend(stamp.as_bytes());
            append_string(message, format_args!("{STAGE}"));
            append_string(message, format_args!("{prefix}bench_{index}"));
            align(message, size_of::<f64>());
            message.extend(pose(&bench).as_bytes());
        }
    }
}

/// Returns the seconds and nanoseconds of a Unix time.
pub(super) fn stamp(unix_ns: u64) -> [u32; 2] {
    [unix_ns / 1_000_000_000, unix_ns % 1_000_000_000].map(|part| part as u32)
}

pub(super) fn append_number(message: &mut Vec<u8>, number: u32) {
    align(message, size_of::<u32>());
    message.extend(number.to_le_bytes());
}

/// Appends a string: its length with the final zero, then its bytes and the zero.
pub(super) fn append_string(message: &mut Vec<u8>, text: fmt::Arguments<'_>) {
    append_number(message, 0);
    let begin = message.len();
    message.write_fmt(text).expect("a Vec takes every byte");
    message.push(0);
    let length = (message.len() - begin) as u32;
    message[begin - size_of::<u32>()..begin].copy_from_slice(&length.to_le_bytes());
}

/// Pads a message with zeros, so that a field of this alignment can follow.
pub(super) fn align(message: &mut Vec<u8>, alignment: usize) {
    let length = (message.len() - ENCAPSULATION.len()).next_multiple_of(alignment);
    message.resize(ENCAPSULATION.len() + length, 0);
}

/// Reads the header of a frame back, as of one dragon. `None` if the message is not a frame.
pub(super) fn decode_header(message: &[u8]) -> Option<FrameHeader> {
    decode(message).map(|fields| FrameHeader::of_show_bytes(&fields))
}

/// Reads a frame back, bit for bit. `None` if the message is not a frame.
pub fn decode_frame(message: &[u8]) -> Option<(FrameHeader, Vec<HandleState>)> {
    let (fields, rest) = split::<[u8; FrameHeader::SHOW_BYTES]>(message)?;
    let header = FrameHeader::of_show_bytes(&fields);
    let (count, rest) = rest.split_first_chunk()?;
    let bytes = (u32::from_le_bytes(*count) as usize).checked_mul(size_of::<HandleState>())?;
    let (handles, rest) = if bytes == 0 { (&[][..], rest) } else { rest.get(4..)?.split_at_checked(bytes)? };
    let handles = handles.chunks_exact(size_of::<HandleState>()).map(|bytes| HandleState::read_from_bytes(bytes).ok());
    let header = if rest.is_empty() { header } else { of_plan(header, rest)? };
    Some((header, handles.collect::<Option<_>>()?))
}

/// The header of a frame of a plan, whose last fields are these.
fn of_plan(header: FrameHeader, rest: &[u8]) -> Option<FrameHeader> {
    let (course, rest) = <[f64; 2]>::read_from_prefix(rest).ok()?;
    let (count, rest) = u64::read_from_prefix(rest).ok()?;
    let dragons = rest.chunks(size_of::<DragonMotion>()).map(|bytes| DragonMotion::read_from_bytes(bytes).ok());
    let dragons: Vec<DragonMotion> = dragons.collect::<Option<_>>()?;
    header.of_plan(course, &dragons).filter(|_| dragons.len() as u64 == count)
}

/// Replaces the contents of `message` with its encoding and first fields. For a type of the bus, these are all fields.
pub fn encode(message: &mut Vec<u8>, fields: &[u8]) {
    message.clear();
    message.extend(ENCAPSULATION);
    message.extend(fields);
}

/// Reads the first fields of a message back, bit for bit. `None` if the message is too short or has another encoding.
pub(super) fn decode<T: FromBytes>(message: &[u8]) -> Option<T> {
    split(message).map(|(fields, _)| fields)
}

/// Splits the first fields of a message from the rest.
fn split<T: FromBytes>(message: &[u8]) -> Option<(T, &[u8])> {
    T::read_from_prefix(message.strip_prefix(&ENCAPSULATION)?).ok()
}

/// Pose of a bench as `geometry_msgs/msg/Pose`, which has the fields of `geometry_msgs/msg/Transform`: its centre in metres,
/// then heading and pitch as a quaternion x, y, z, w: a turn about z after one about −y.
///
/// The heading points from the rear handle to the front handle. A heading of +π/2, with the front handle in direction +y of the
/// rear handle, is a quarter turn about z.
pub(super) fn pose(bench: &BenchState) -> [f64; 7] {
    let [x, y, z] = bench.centre_m;
    let ((sine, cosine), (up, level)) = ((bench.heading_rad / 2.0).sin_cos(), (bench.pitch_rad / 2.0).sin_cos());
    // Adding 0 removes the sign of a zero.
    [x, y, z, sine * up + 0.0, 0.0 - cosine * up, sine * level, cosine * level]
}

/// Chooses the frames whose poses or boards are recorded: so many a second.
///
/// It chooses the first frame that is at most half a period early. So its mean rate is kept at any higher frame rate. At that rate and
/// below, every frame is chosen, even with jitter. After a pause, no extra frames are chosen.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewedRate {
    period_ns: u64,
    due_ns: u64,
}

impl ViewedRate {
    pub(super) fn hz(hz: u64) -> Self {
        Self { period_ns: 1_000_000_000 / hz, due_ns: 0 }
    }

    /// Whether the frame for the instant `scheduled_ns` is chosen. Call it for frames in their order.
    pub(super) fn is_due(&mut self, scheduled_ns: u64) -> bool {
        let is_due = scheduled_ns + self.period_ns / 2 >= self.due_ns;
        if is_due {
            self.due_ns = (self.due_ns + self.period_ns).max(scheduled_ns + self.period_ns / 2);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use bench_dragon_ipc::Alert;
    use glam::{DQuat, DVec3};

    use super::*;

    #[test]
    fn frame_keeps_every_bit() {
        let odd = [f64::NAN, -0.0, f64::INFINITY, f64::MIN_POSITIVE / 3.0, 1.0 / 3.0, f64::MAX];
        let header = FrameHeader { run_id: 1 << 52, show_time_ns: i64::MIN, head_travel_m: -0.1, ..Default::default() };
        let header = header.of_one_dragon();
        let handle = HandleState { position_m: [odd[0], odd[1], odd[2]], velocity_mps: [odd[3], odd[4], odd[5]] };
        let mut message = Vec::new();
        encode_frame(&mut message, &header, &[handle; 3]);
        assert_eq!(message.len(), 4 + 80 + 3 * 48, "72 bytes of header, 4 of length, 4 of padding, 48 per handle");
        let (read_header, read_handles) = decode_frame(&message).expect("a frame");
        assert_eq!((read_header, decode_header(&message)), (header, Some(header)));
        let bits = |states: &[HandleState]| -> Vec<u64> {
            states.iter().flat_map(|s| [s.position_m, s.velocity_mps]).flatten().map(f64::to_bits).collect()
        };
        assert_eq!(bits(&read_handles), bits(&[handle; 3]));
    }

    #[test]
    fn truncated_frame_is_rejected() {
        let mut message = Vec::new();
        encode_frame(&mut message, &FrameHeader::default(), &[HandleState::default(); 2]);
        assert!((0..message.len()).all(|length| decode_frame(&message[..length]).is_none()));
    }

    #[test]
    fn alert_keeps_every_bit_and_a_truncated_alert_is_rejected() {
        let alert = Alert {
            run_id: 7,
            tick: 1 << 40,
            show_time_ns: -5,
            forecast_ns: Alert::NO_FORECAST,
            clearance_m: -0.1,
            point_m: [1.0 / 3.0, -0.0],
            kind: 2,
            bench_a: 0,
            bench_b: Alert::NO_BENCH,
            reserved: 0,
        };
        let mut message = Vec::new();
        encode(&mut message, alert.as_bytes());
        assert_eq!(decode(&message), Some(alert));
        assert!((0..message.len()).all(|length| decode::<Alert>(&message[..length]).is_none()));
    }

    fn handle(x: f64, y: f64) -> HandleState {
        HandleState { position_m: [x, y, 0.0], velocity_mps: [0.0; 3] }
    }

    #[test]
    fn heading_points_from_the_rear_handle_to_the_front_handle() {
        let [position @ .., x, y, z, w] = pose(&BenchState::between(&handle(1.0, 3.0), &handle(1.0, 1.0)));
        assert_eq!((position, [x, y]), ([1.0, 2.0, 0.0], [0.0, 0.0]));
        assert!((z - FRAC_1_SQRT_2).abs() < f64::EPSILON && (w - FRAC_1_SQRT_2).abs() < f64::EPSILON);
    }

    #[test]
    fn the_orientation_turns_x_into_the_direction_of_a_pitched_board() {
        let rear = HandleState { position_m: [1.0, 1.0, 1.0], ..HandleState::default() };
        let front = HandleState { position_m: [2.0, 3.0, 1.5], ..HandleState::default() };
        let [.., x, y, z, w] = pose(&BenchState::between(&front, &rear));
        let direction = DQuat::from_xyzw(x, y, z, w) * DVec3::X;
        assert!(direction.distance(DVec3::new(1.0, 2.0, 0.5).normalize()) < 1e-15, "{direction}");
        let across = DQuat::from_xyzw(x, y, z, w) * DVec3::Y;
        assert!(across.z.abs() < 1e-15, "the board is level across");
    }

    #[test]
    fn every_bench_has_one_pose() {
        let mut message = Vec::new();
        encode_poses(&mut message, 1_700_000_000_000_000_007, &[handle(0.0, 0.0); 224]);
        let (head, poses) = message.split_at(28);
        assert_eq!(head[..16], [0, 1, 0, 0, 0, 0xf1, 0x53, 0x65, 7, 0, 0, 0, 6, 0, 0, 0], "1 700 000 000 s, 7 ns");
        assert_eq!(head[16..], *b"stage\0\0\0\xdf\0\0\0", "the frame of reference, and 223 poses");
        assert_eq!(poses.len(), 223 * 56);
        encode_poses(&mut message, 0, &[]);
        assert_eq!(message[24..], [0; 4]);
    }

    #[test]
    fn every_bench_has_one_transform() {
        let handles: Vec<HandleState> = (0..=100).map(|index| handle(f64::from(index), 0.0)).collect();
        let mut message = Vec::new();
        let header = FrameHeader { bench_count: 100, ..FrameHeader::default() }.of_one_dragon();
        encode_transforms(&mut message, 1_700_000_000_000_000_007, &header, &handles, &[]);
        assert_eq!(message[..8], [0, 1, 0, 0, 100, 0, 0, 0], "100 transforms");
        assert_eq!(message[8..16], [0, 0xf1, 0x53, 0x65, 7, 0, 0, 0], "1 700 000 000 s, 7 ns");
        assert_eq!(message[16..28], *b"\x06\0\0\0stage\0\0\0");
        assert_eq!(
            message[28..44],
            *b"\x08\0\0\0bench_0\0\0\0\0\0",
            "its number aligned to 8 bytes, after the first 4"
        );
        assert_eq!(message[44..100], *pose(&BenchState::between(&handles[0], &handles[1])).as_bytes());
        let last = message.len() - 56;
        assert_eq!(message[last - 20..last], *b"\x09\0\0\0bench_99\0\0\0\0\0\0\0\0");
        assert_eq!(message.len(), 4 + 4 + (4 + 8 + 12 + 12 + 56) + 9 * 88 + 90 * 96);
        encode_transforms(&mut message, 0, &FrameHeader::default(), &[], &[]);
        assert_eq!(message[4..], [0; 4]);
    }

    fn two_dragons() -> (FrameHeader, Vec<HandleState>) {
        let motion = |first_handle, bench_count| DragonMotion {
            travel_m: 0.1,
            speed_mps: -0.0,
            first_handle,
            bench_count,
            state: 1,
            reserved: 0,
        };
        let header = FrameHeader { run_id: 7, bench_count: 3, ..FrameHeader::default() };
        let header = header.of_plan([1.0 / 3.0, -0.0], &[motion(0, 2), motion(3, 1)]).expect("two dragons");
        (header, (0..5).map(|index| handle(f64::from(index), 0.0)).collect())
    }

    #[test]
    fn a_frame_of_a_plan_keeps_every_bit_and_a_truncated_one_is_rejected() {
        let (header, handles) = two_dragons();
        let mut message = Vec::new();
        encode_frame(&mut message, &header, &handles);
        assert_eq!(message.len(), 4 + 80 + 5 * 48 + 16 + 8 + 2 * 32);
        assert_eq!(decode_frame(&message), Some((header, handles)));
        let of_one_dragon = 4 + 80 + 5 * 48;
        let is_read = |length: usize| decode_frame(&message[..length]).is_some();
        assert_eq!((0..message.len()).filter(|&length| is_read(length)).collect::<Vec<_>>(), [of_one_dragon]);
        // There the number of handles does not fit that of benches.
        assert!(
            !decode_frame(&message[..of_one_dragon]).is_some_and(|(header, handles)| header.has_handles(handles.len()))
        );
    }

    #[test]
    fn transforms_of_dragons_have_their_names_and_no_bench_between_two_of_them() {
        let (header, handles) = two_dragons();
        let mut message = Vec::new();
        encode_transforms(&mut message, 0, &header, &handles, &["gold".to_owned(), "silver-2".to_owned()]);
        assert_eq!(message[..8], [0, 1, 0, 0, 3, 0, 0, 0], "3 transforms");
        let texts = message.split(|byte| *byte == 0).filter(|text| text.windows(6).any(|part| part == b"bench_"));
        let texts: Vec<_> = texts.map(|text| String::from_utf8_lossy(text).into_owned()).collect();
        assert_eq!(texts, ["gold/bench_0", "gold/bench_1", "silver-2/bench_0"]);
        let last = message.len() - 56;
        assert_eq!(message[last..], *pose(&BenchState::between(&handles[3], &handles[4])).as_bytes());
    }

    fn chosen_in(seconds: u64, rate_hz: u64, rate: &mut ViewedRate) -> u64 {
        let published = |tick: u64| 1_000_000_000_000 + tick * 1_000_000_000 / rate_hz;
        (0..seconds * rate_hz).map(|tick| u64::from(rate.is_due(published(tick)))).sum()
    }

    #[test]
    fn thirty_frames_a_second_are_chosen_at_any_higher_rate() {
        for rate_hz in [31, 50, 59, 60, 100, 1_000, 10_000] {
            let chosen = chosen_in(10, rate_hz, &mut ViewedRate::hz(30));
            assert!((299..=301).contains(&chosen), "{chosen} poses in 10 s at {rate_hz} Hz");
        }
    }

    #[test]
    fn every_frame_is_chosen_at_thirty_hertz_and_below() {
        for rate_hz in [1, 20, 29, 30] {
            assert_eq!(chosen_in(10, rate_hz, &mut ViewedRate::hz(30)), 10 * rate_hz, "at {rate_hz} Hz");
        }
    }

    #[test]
    fn pause_adds_no_extra_poses() {
        let mut rate = ViewedRate::hz(30);
        rate.is_due(0);
        let chosen = chosen_in(1, 1_000, &mut rate);
        assert!((30..=31).contains(&chosen), "{chosen} poses in the second after a pause");
    }
}
