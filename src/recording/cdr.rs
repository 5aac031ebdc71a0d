//! The messages of a recording as little-endian CDR, the encoding of ROS 2, and which frames become poses for viewers.
//!
//! A message is four bytes that name the encoding, then the fields in the order of [`schema`](super::schema), each
//! aligned to its size counted from behind those four. Every value keeps its bits.

use bench_dragon_ipc::{Alert, BenchState, CommandEvent, FrameHeader, HandleState};
use byteorder::LittleEndian;
use serde::{Deserialize, Serialize, Serializer};

/// Thirty poses a second of wall time.
const POSE_PERIOD_NS: u64 = 1_000_000_000 / 30;
/// Little-endian plain CDR, no options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Replaces the contents of `message` by a frame.
pub fn encode_frame(message: &mut Vec<u8>, header: &FrameHeader, handles: &[HandleState]) {
    encode(message, &FrameMessage { header: *header, handles: Handles(handles) });
}

/// Replaces the contents of `message` by an alert.
pub fn encode_alert(message: &mut Vec<u8>, alert: &Alert) {
    encode(message, &AlertMessage(*alert));
}

/// Replaces the contents of `message` by an event of the record of commands.
pub fn encode_command(message: &mut Vec<u8>, event: &CommandEvent) {
    encode(message, &CommandMessage(*event));
}

/// Replaces the contents of `message` by the poses of all benches at a Unix time, in the frame `stage`.
pub fn encode_poses(message: &mut Vec<u8>, unix_ns: u64, handles: &[HandleState]) {
    let stamp = Time { sec: (unix_ns / 1_000_000_000) as i32, nanosec: (unix_ns % 1_000_000_000) as u32 };
    encode(message, &PoseArray { stamp, frame_id: "stage", poses: Poses(handles) });
}

/// Reads a frame back, bit for bit; `None` where the message is not one.
pub fn decode_frame(message: &[u8]) -> Option<(FrameHeader, Vec<HandleState>)> {
    let frame: FrameMessage<Vec<Handle>> = decode(message)?;
    Some((frame.header, frame.handles.into_iter().map(|Handle(state)| state).collect()))
}

/// Reads only what a frame says about the whole dragon; `None` where the message does not begin like a frame.
pub fn decode_frame_header(message: &[u8]) -> Option<FrameHeader> {
    decode(message).map(|HeaderOnly(header)| header)
}

/// Reads an alert back, bit for bit; `None` where the message is not one.
pub fn decode_alert(message: &[u8]) -> Option<Alert> {
    decode(message).map(|AlertMessage(alert)| alert)
}

/// Reads an event of the record of commands back, bit for bit; `None` where the message is not one.
pub fn decode_command(message: &[u8]) -> Option<CommandEvent> {
    decode(message).map(|CommandMessage(event)| event)
}

fn encode(message: &mut Vec<u8>, value: &impl Serialize) {
    message.clear();
    message.extend_from_slice(&ENCAPSULATION);
    cdr_encoding::to_writer::<_, LittleEndian, _>(message, value)
        .expect("a Vec takes every byte, and every sequence here knows its length");
}

fn decode<'a, T: Deserialize<'a>>(message: &'a [u8]) -> Option<T> {
    let body = message.strip_prefix(&ENCAPSULATION)?;
    cdr_encoding::from_bytes::<T, LittleEndian>(body).ok().map(|(value, _)| value)
}

#[derive(Serialize, Deserialize)]
struct FrameMessage<H> {
    #[serde(with = "HeaderFields")]
    header: FrameHeader,
    handles: H,
}

#[derive(Deserialize)]
struct HeaderOnly(#[serde(with = "HeaderFields")] FrameHeader);

#[derive(Serialize, Deserialize)]
#[serde(remote = "FrameHeader")]
struct HeaderFields {
    run_id: u64,
    tick: u64,
    sim_time_ns: i64,
    scheduled_ns: u64,
    published_ns: u64,
    head_travel_m: f64,
    head_speed_mps: f64,
    time_scale: f64,
    bench_count: u32,
    state: u32,
}

struct Handles<'a>(&'a [HandleState]);

impl Serialize for Handles<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().copied().map(Handle))
    }
}

#[derive(Serialize, Deserialize)]
struct Handle(#[serde(with = "HandleFields")] HandleState);

#[derive(Serialize, Deserialize)]
#[serde(remote = "HandleState")]
struct HandleFields {
    position_m: [f64; 3],
    velocity_mps: [f64; 3],
}

#[derive(Serialize, Deserialize)]
struct AlertMessage(#[serde(with = "AlertFields")] Alert);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Alert")]
struct AlertFields {
    run_id: u64,
    tick: u64,
    sim_time_ns: i64,
    forecast_ns: i64,
    clearance_m: f64,
    point_m: [f64; 2],
    kind: u32,
    bench_a: u32,
    bench_b: u32,
    reserved: u32,
}

#[derive(Serialize, Deserialize)]
struct CommandMessage(#[serde(with = "CommandFields")] CommandEvent);

#[derive(Serialize, Deserialize)]
#[serde(remote = "CommandEvent")]
struct CommandFields {
    run_id: u64,
    number: u64,
    tick: u64,
    sim_time_ns: i64,
    wall_ns: i64,
    overruns: u64,
    values: [f64; 4],
    lowest: f64,
    highest: f64,
    kind: u32,
    sender: u32,
    pid: u32,
    refusal: u32,
    flags: u32,
    reserved: u32,
}

#[derive(Serialize)]
struct PoseArray<'a> {
    stamp: Time,
    frame_id: &'static str,
    poses: Poses<'a>,
}

#[derive(Serialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

struct Poses<'a>(&'a [HandleState]);

impl Serialize for Poses<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(BenchState::all(self.0).map(|bench| BenchPose::of(&bench)))
    }
}

/// Where one bench lies: `geometry_msgs/msg/Pose`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct BenchPose {
    /// Centre of the board, in metres.
    position: [f64; 3],
    /// Heading from the rear handle to the front one, as the quaternion x, y, z, w of a turn about z.
    orientation: [f64; 4],
}

impl BenchPose {
    /// The pose of a bench: a heading of +π/2, in which its front handle lies in direction +y of its rear one, is a
    /// quarter turn about z.
    fn of(bench: &BenchState) -> Self {
        let (sine, cosine) = (bench.heading_rad / 2.0).sin_cos();
        Self { position: bench.centre_m, orientation: [0.0, 0.0, sine, cosine] }
    }
}

/// Chooses the frames whose poses are recorded.
///
/// A pose is due every thirtieth of a second, and the first frame no more than half of that before it is chosen. So the
/// mean rate is 30 Hz at any higher frame rate, every frame is chosen at 30 Hz and below however it jitters, and a pause
/// is not made up for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PoseRate {
    due_ns: u64,
}

impl PoseRate {
    /// Whether the frame sent at `published_ns`, later than the one asked for before, is chosen.
    pub(super) fn is_due(&mut self, published_ns: u64) -> bool {
        let is_due = published_ns + POSE_PERIOD_NS / 2 >= self.due_ns;
        if is_due {
            self.due_ns = (self.due_ns + POSE_PERIOD_NS).max(published_ns + POSE_PERIOD_NS / 2);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use super::*;

    #[test]
    fn a_frame_keeps_every_bit() {
        let odd = [f64::NAN, -0.0, f64::INFINITY, f64::MIN_POSITIVE / 3.0, 1.0 / 3.0, f64::MAX];
        let header = FrameHeader { run_id: 1 << 52, sim_time_ns: i64::MIN, head_travel_m: -0.1, ..Default::default() };
        let handle = HandleState { position_m: [odd[0], odd[1], odd[2]], velocity_mps: [odd[3], odd[4], odd[5]] };
        let mut message = Vec::new();
        encode_frame(&mut message, &header, &[handle; 3]);
        assert_eq!(message.len(), 4 + 80 + 3 * 48, "72 bytes of header, 4 of length, 4 of padding, 48 a handle");
        let (read_header, read_handles) = decode_frame(&message).expect("a frame");
        assert_eq!((read_header, decode_frame_header(&message)), (header, Some(header)));
        let bits = |states: &[HandleState]| -> Vec<u64> {
            states.iter().flat_map(|s| [s.position_m, s.velocity_mps]).flatten().map(f64::to_bits).collect()
        };
        assert_eq!(bits(&read_handles), bits(&[handle; 3]));
    }

    #[test]
    fn a_frame_cut_short_is_no_frame() {
        let mut message = Vec::new();
        encode_frame(&mut message, &FrameHeader::default(), &[HandleState::default(); 2]);
        assert!((0..message.len()).all(|length| decode_frame(&message[..length]).is_none()));
    }

    #[test]
    fn an_alert_keeps_every_bit_and_cut_short_is_none() {
        let alert = Alert {
            run_id: 7,
            tick: 1 << 40,
            sim_time_ns: -5,
            forecast_ns: Alert::NO_FORECAST,
            clearance_m: -0.1,
            point_m: [1.0 / 3.0, -0.0],
            kind: 2,
            bench_a: 0,
            bench_b: Alert::NO_BENCH,
            reserved: 0,
        };
        let mut message = Vec::new();
        encode_alert(&mut message, &alert);
        assert_eq!(decode_alert(&message), Some(alert));
        assert!((0..message.len()).all(|length| decode_alert(&message[..length]).is_none()));
    }

    fn handle(x: f64, y: f64) -> HandleState {
        HandleState { position_m: [x, y, 0.0], velocity_mps: [0.0; 3] }
    }

    #[test]
    fn heading_points_from_the_rear_handle_to_the_front_handle() {
        let pose = BenchPose::of(&BenchState::between(&handle(1.0, 3.0), &handle(1.0, 1.0)));
        assert_eq!(pose.position, [1.0, 2.0, 0.0]);
        let [x, y, z, w] = pose.orientation;
        assert_eq!([x, y], [0.0, 0.0]);
        assert!((z - FRAC_1_SQRT_2).abs() < f64::EPSILON && (w - FRAC_1_SQRT_2).abs() < f64::EPSILON);
    }

    #[test]
    fn every_bench_has_one_pose() {
        let count = |handles: &[HandleState]| {
            let mut message = Vec::new();
            encode_poses(&mut message, 0, handles);
            u32::from_le_bytes(message[24..28].try_into().expect("the length of the sequence"))
        };
        assert_eq!(count(&[handle(0.0, 0.0); 224]), 223);
        assert_eq!(count(&[]), 0);
    }

    fn chosen_in(seconds: u64, rate_hz: u64, rate: &mut PoseRate) -> u64 {
        let published = |tick: u64| 1_000_000_000_000 + tick * 1_000_000_000 / rate_hz;
        (0..seconds * rate_hz).map(|tick| u64::from(rate.is_due(published(tick)))).sum()
    }

    #[test]
    fn thirty_frames_a_second_are_chosen_at_any_higher_rate() {
        for rate_hz in [31, 50, 59, 60, 100, 1_000, 10_000] {
            let chosen = chosen_in(10, rate_hz, &mut PoseRate::default());
            assert!((299..=301).contains(&chosen), "{chosen} poses in 10 s at {rate_hz} Hz");
        }
    }

    #[test]
    fn every_frame_is_chosen_at_thirty_hertz_and_below() {
        for rate_hz in [1, 20, 29, 30] {
            assert_eq!(chosen_in(10, rate_hz, &mut PoseRate::default()), 10 * rate_hz, "at {rate_hz} Hz");
        }
    }

    #[test]
    fn a_pause_is_not_made_up_for() {
        let mut rate = PoseRate::default();
        rate.is_due(0);
        let chosen = chosen_in(1, 1_000, &mut rate);
        assert!((30..=31).contains(&chosen), "{chosen} poses in the second after a pause");
    }
}
