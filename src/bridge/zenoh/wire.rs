//! The wire format: the bus's own layouts, little-endian. Their bytes are those of `IntoBytes::as_bytes`; the bytes of a whole
//! frame are those of [`frame_bytes`](bench_dragon_ipc::frame_bytes).
//!
//! The functions are pure. The sender may be another program, another version or an attacker, so every payload is checked.
//! Lengths are compared before anything is read. No field of a payload makes the bridge allocate more than the payload's own
//! length. Values that no source sends are rejected.

use bench_dragon_geometry::dragon::MAX_BENCHES;
use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use bench_dragon_ipc::{
    Alert, Command, CommandReply, DragonMotion, FrameHeader, FromBytes, HandleState, IntoBytes as _, MAX_DRAGONS,
    ShowState,
};

use crate::source::replay::FASTEST_HZ;

const _: () = assert!(cfg!(target_endian = "little"), "the bus and the wire share one layout, which is little-endian");

/// Encodings of the payloads. The attachment of a description names its run, see [`Described`].
pub(super) const FRAME_ENCODING: &str = "application/octet-stream;bench_dragon.Frame.v1";
pub(super) const FORMATION_FRAME_ENCODING: &str = "application/octet-stream;bench_dragon.FormationFrame.v1";
pub(super) const ALERT_ENCODING: &str = "application/octet-stream;bench_dragon.Alert.v1";
pub(super) const COMMAND_ENCODING: &str = "application/octet-stream;bench_dragon.Command.v3";
pub(super) const REPLY_ENCODING: &str = "application/octet-stream;bench_dragon.CommandReply.v1";
pub(super) const DESCRIPTION_ENCODING: &str = "text/toml";

const HEADER_BYTES: usize = FrameHeader::SHOW_BYTES;
const DRAGON_BYTES: usize = size_of::<DragonMotion>();
/// Bytes of the place and the speed on the course, which follow the handles of a plan.
const COURSE_BYTES: usize = size_of::<[f64; 2]>();
const HANDLE_BYTES: usize = size_of::<HandleState>();
/// Bytes of the longest frame that is accepted.
pub(super) const MAX_FRAME_BYTES: usize =
    HEADER_BYTES + (MAX_BENCHES + MAX_DRAGONS) * HANDLE_BYTES + COURSE_BYTES + MAX_DRAGONS * DRAGON_BYTES;
pub(super) const ALERT_BYTES: usize = size_of::<Alert>();
pub(super) const COMMAND_BYTES: usize = size_of::<Command>();
pub(super) const REPLY_BYTES: usize = size_of::<CommandReply>();
/// Bytes of the attachment of a command, and of a description.
pub(super) const SEEN_BYTES: usize = size_of::<[u64; 2]>();
pub(super) const DESCRIBED_BYTES: usize = size_of::<[u64; 3]>();

/// Largest allowed value of [`Described::every`]: one frame per second of the fastest run.
pub const MAX_EVERY: u64 = FASTEST_HZ as u64;

/// The two forms of a frame. Its encoding names the form, because the beginning of one may be the whole of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameForm {
    /// The frame of one dragon.
    OneDragon,
    /// The frame of a plan, with its course and its dragons.
    Formation,
}

impl FrameForm {
    /// The form of the frames with this header.
    pub(super) fn of(header: &FrameHeader) -> Self {
        if header.is_plan == 1 { Self::Formation } else { Self::OneDragon }
    }

    /// The form of this encoding. An encoding that another version may send counts as that of one dragon.
    pub(super) fn of_encoding(encoding: &str) -> Self {
        if encoding == FORMATION_FRAME_ENCODING { Self::Formation } else { Self::OneDragon }
    }

    pub(super) fn encoding(self) -> &'static str {
        match self {
            Self::OneDragon => FRAME_ENCODING,
            Self::Formation => FORMATION_FRAME_ENCODING,
        }
    }
}

/// Decodes a frame as a source publishes it. The handles replace the contents of `handles`, so its memory is reused.
pub(super) fn decode_frame(form: FrameForm, bytes: &[u8], handles: &mut Vec<HandleState>) -> Option<FrameHeader> {
    let (head, body) = bytes.split_first_chunk()?;
    let header = decode_header(head)?;
    let (header, body) = match form {
        FrameForm::OneDragon => (header, body),
        FrameForm::Formation => decode_plan(header, body)?,
    };
    let handle_count = header.handle_count();
    if body.len() != handle_count * HANDLE_BYTES {
        return None;
    }
    handles.clear();
    handles.reserve_exact(handle_count);
    handles.resize(handle_count, HandleState::default());
    handles.as_mut_bytes().copy_from_slice(body);
    let is_finite = |handle: &HandleState| are_finite(&handle.position_m) && are_finite(&handle.velocity_mps);
    handles.iter().all(is_finite).then_some(header)
}

/// Decodes the course and the dragons behind the handles of a plan. Returns the whole header, and the bytes of the handles.
fn decode_plan(header: FrameHeader, body: &[u8]) -> Option<(FrameHeader, &[u8])> {
    let benches = header.bench_count as usize * HANDLE_BYTES;
    let of_dragons = body.len().checked_sub(benches + COURSE_BYTES)?;
    let count = of_dragons / (HANDLE_BYTES + DRAGON_BYTES);
    if !of_dragons.is_multiple_of(HANDLE_BYTES + DRAGON_BYTES) || !(1..=MAX_DRAGONS).contains(&count) {
        return None;
    }
    let (handles, rest) = body.split_at(benches + count * HANDLE_BYTES);
    let (course, rest) = rest.split_at(COURSE_BYTES);
    let dragons: Option<Vec<DragonMotion>> = rest.chunks_exact(DRAGON_BYTES).map(read).collect();
    let course: [f64; 2] = read(course)?;
    let header = header.of_plan(course, &dragons?).filter(|_| are_finite(&course))?;
    let is_sound = header.has_handles(header.handle_count()) && header.dragons().iter().all(is_sound);
    is_sound.then_some((header, handles))
}

/// Whether a dragon has benches, a known state and finite values.
fn is_sound(dragon: &DragonMotion) -> bool {
    let is_known = dragon.dragon_state().is_some() && dragon.reserved == 0;
    dragon.bench_count > 0 && is_known && are_finite(&[dragon.travel_m, dragon.speed_mps])
}

fn decode_header(bytes: &[u8; HEADER_BYTES]) -> Option<FrameHeader> {
    let header = FrameHeader::of_show_bytes(bytes);
    let is_finite = are_finite(&[header.head_travel_m, header.head_speed_mps, header.time_scale]);
    let is_dragon = (1..=MAX_BENCHES).contains(&(header.bench_count as usize));
    let is_known = ShowState::from_wire(header.state).is_some();
    (is_run(header.run_id) && is_finite && is_known && is_dragon).then_some(header)
}

/// Decodes an alert as a monitor publishes it. It names two benches, the lower one first, or none; an alert about a board
/// at a border of the stage names one.
pub(super) fn decode_alert(bytes: &[u8]) -> Option<Alert> {
    let alert: Alert = read(bytes)?;
    let is_finite = are_finite(&[alert.clearance_m]) && are_finite(&alert.point_m);
    let (a, b) = (alert.bench_a, alert.bench_b);
    let is_none = a == Alert::NO_BENCH && b == Alert::NO_BENCH;
    let has_benches = if alert.alert_kind()?.is_of_one_bench() {
        (a as usize) < MAX_BENCHES && b == Alert::NO_BENCH
    } else {
        is_none || (a < b && (b as usize) < MAX_BENCHES)
    };
    (is_run(alert.run_id) && is_finite && has_benches).then_some(alert)
}

/// Decodes a reply. Unknown refusal codes, which another version may send, are accepted.
pub(super) fn decode_reply(bytes: &[u8]) -> Option<CommandReply> {
    read(bytes).filter(|reply: &CommandReply| is_run(reply.run_id))
}

/// Position in the show at which a command was sent: its attachment, two little-endian `u64`. With it the other host rejects a
/// command that was delayed between the hosts and must no longer be executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    pub(super) run_id: u64,
    /// The tick that the run had reached.
    pub(super) tick: u64,
}

pub(super) fn encode_seen(seen: Seen) -> Vec<u8> {
    [seen.run_id, seen.tick].as_bytes().to_vec()
}

pub(super) fn decode_seen(bytes: &[u8]) -> Option<Seen> {
    let [run_id, tick] = read(bytes)?;
    is_run(run_id).then_some(Seen { run_id, tick })
}

/// The run of a description, and the rate of its frames: the attachment of a description, three little-endian `u64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Described {
    /// The run's id.
    pub run_id: u64,
    /// The sender selects the frames whose tick is a multiple of this, and those that change the state.
    pub every: u64,
    /// Frames per second of the run before this selection; 0 if unknown. A recording that is replayed faster than it was made
    /// has a higher rate than its configuration.
    pub rate_hz: u64,
}

/// Encodes the attachment of a description.
pub fn encode_described(described: Described) -> Vec<u8> {
    [described.run_id, described.every, described.rate_hz].as_bytes().to_vec()
}

/// Decodes a description and its attachment. It does not parse the text as a configuration: readers of the text do so.
pub(super) fn decode_description(bytes: &[u8], attached: &[u8]) -> Option<(Described, String)> {
    let [run_id, every, rate_hz] = read(attached)?;
    let is_rate = (1..=MAX_EVERY).contains(&every) && rate_hz <= u64::from(FASTEST_HZ);
    if !is_run(run_id) || !is_rate || bytes.len() > MAX_DESCRIPTION_LEN {
        return None;
    }
    Some((Described { run_id, every, rate_hz }, str::from_utf8(bytes).ok()?.to_owned()))
}

/// Run ids are below this bound, so every f64 can represent them exactly.
const RUN_ID_END: u64 = 1 << 53;

fn is_run(run_id: u64) -> bool {
    run_id < RUN_ID_END
}

fn are_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

/// Decodes a payload that has exactly the length of its type. A command needs no other check: the server checks its values.
pub(super) fn read<Kind: FromBytes>(bytes: &[u8]) -> Option<Kind> {
    Kind::read_from_bytes(bytes).ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use bench_dragon_ipc::{AlertKind, frame_bytes};

    use super::*;

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn accepted_bytes_encode_back_to_the_same_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let mut handles = Vec::new();
            for form in [FrameForm::OneDragon, FrameForm::Formation] {
                if let Some(header) = decode_frame(form, &bytes, &mut handles) {
                    prop_assert_eq!(frame_bytes(&header, &handles), bytes.clone());
                }
            }
            if let Some(alert) = decode_alert(&bytes) {
                prop_assert_eq!(alert.as_bytes().to_vec(), bytes.clone());
            }
            if let Some(command) = read::<Command>(&bytes) {
                prop_assert_eq!(command.as_bytes().to_vec(), bytes.clone());
            }
            if let Some(reply) = decode_reply(&bytes) {
                prop_assert_eq!(reply.as_bytes().to_vec(), bytes.clone());
            }
            if let Some(seen) = decode_seen(&bytes) {
                prop_assert_eq!(encode_seen(seen), bytes.clone());
            }
            let (text, attached) = bytes.split_at(bytes.len().saturating_sub(DESCRIBED_BYTES));
            if let Some((described, toml)) = decode_description(text, attached) {
                prop_assert_eq!([toml.as_bytes(), &encode_described(described)].concat(), bytes);
            }
        }
    }

    fn finite_double() -> impl Strategy<Value = f64> {
        any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |value| value.is_finite())
    }

    fn any_dragons() -> impl Strategy<Value = Vec<DragonMotion>> {
        let dragon = (finite_double(), finite_double(), 1_u32..=20, 0_u32..3);
        proptest::collection::vec(dragon, 1..=MAX_DRAGONS).prop_map(|dragons| {
            let mut first_handle = 0;
            let of_frame = |(travel_m, speed_mps, bench_count, state)| {
                let first = first_handle;
                first_handle += bench_count + 1;
                DragonMotion { travel_m, speed_mps, first_handle: first, bench_count, state, reserved: 0 }
            };
            dragons.into_iter().map(of_frame).collect()
        })
    }

    /// Headers of one dragon, and of the plan of several.
    fn any_header() -> impl Strategy<Value = FrameHeader> {
        let course = [finite_double(), finite_double()];
        (of_one_dragon(), proptest::option::of((course, any_dragons()))).prop_map(|(header, plan)| {
            let Some((course, dragons)) = plan else { return header };
            let bench_count = dragons.iter().map(|dragon| dragon.bench_count).sum();
            FrameHeader { bench_count, ..header }.of_plan(course, &dragons).expect("not too many dragons")
        })
    }

    prop_compose! {
        fn of_one_dragon()(
            run_id in 0..RUN_ID_END, tick: u64, show_time_ns: i64, scheduled_ns: u64, published_ns: u64,
            head_travel_m in finite_double(), head_speed_mps in finite_double(), time_scale in finite_double(),
            bench_count in 1_u32..=40, state in 0_u32..6,
        ) -> FrameHeader {
            FrameHeader { run_id, tick, show_time_ns, scheduled_ns, published_ns, head_travel_m, head_speed_mps, time_scale,
                bench_count, state, ..FrameHeader::default() }.of_one_dragon()
        }
    }

    fn any_handle() -> impl Strategy<Value = HandleState> {
        let vector = || [finite_double(), finite_double(), finite_double()];
        (vector(), vector()).prop_map(|(position_m, velocity_mps)| HandleState { position_m, velocity_mps })
    }

    fn any_frame() -> impl Strategy<Value = (FrameHeader, Vec<HandleState>)> {
        any_header().prop_flat_map(|header| {
            let count = header.handle_count();
            (Just(header), proptest::collection::vec(any_handle(), count))
        })
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn a_frame_is_decoded_bit_for_bit((header, handles) in any_frame()) {
            let bytes = frame_bytes(&header, &handles);
            let of_plan = COURSE_BYTES + header.dragons().len() * DRAGON_BYTES;
            let of_plan = if header.is_plan == 1 { of_plan } else { 0 };
            prop_assert_eq!(bytes.len(), HEADER_BYTES + handles.len() * HANDLE_BYTES + of_plan);
            let mut read = vec![HandleState::default(); 3];
            let read_header = decode_frame(FrameForm::of(&header), &bytes, &mut read).expect("the frame has just been encoded");
            prop_assert_eq!(frame_bytes(&read_header, &read), bytes);
        }

        #[test]
        fn a_frame_of_wrong_length_is_rejected((header, handles) in any_frame(), cut in 1_usize..200, extra in 1_usize..99) {
            let (form, bytes) = (FrameForm::of(&header), frame_bytes(&header, &handles));
            let mut read = Vec::new();
            let rest = &bytes[..bytes.len().saturating_sub(cut)];
            prop_assert!(decode_frame(form, rest, &mut read).is_none());
            prop_assert!(decode_frame(form, &[bytes, vec![0; extra]].concat(), &mut read).is_none());
        }

        #[test]
        fn a_frame_with_a_changed_byte_is_rejected_or_encodes_back_to_its_bytes(
            (header, handles) in any_frame(), at: prop::sample::Index, byte: u8,
        ) {
            let mut bytes = frame_bytes(&header, &handles);
            let at = at.index(bytes.len());
            bytes[at] = byte;
            let mut read = Vec::new();
            if let Some(header) = decode_frame(FrameForm::of(&header), &bytes, &mut read) {
                prop_assert_eq!(frame_bytes(&header, &read), bytes);
            }
        }

        #[test]
        fn a_frame_with_one_nan_is_rejected((header, handles) in any_frame(), at: prop::sample::Index) {
            let mut bytes = frame_bytes(&header, &handles);
            let at = HEADER_BYTES + at.index(handles.len() * 6) * 8;
            bytes[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
            prop_assert_eq!(decode_frame(FrameForm::of(&header), &bytes, &mut Vec::new()), None);
        }
    }

    #[test]
    fn header_fields_have_the_offsets_of_the_bus() {
        let header =
            FrameHeader { run_id: 1, tick: 2, show_time_ns: -3, bench_count: 4, state: 1, ..FrameHeader::default() };
        let bytes = frame_bytes(&header, &[]);
        assert_eq!(bytes[0..8], 1_u64.to_le_bytes());
        assert_eq!(bytes[8..16], 2_u64.to_le_bytes());
        assert_eq!(bytes[16..24], (-3_i64).to_le_bytes());
        assert_eq!(bytes[64..68], 4_u32.to_le_bytes());
        assert_eq!(bytes[68..72], 1_u32.to_le_bytes());
    }

    #[test]
    fn header_values_that_no_source_sends_are_rejected() {
        let handles = [HandleState::default(); 2];
        let sound = FrameHeader { bench_count: 1, ..FrameHeader::default() }.of_one_dragon();
        let read = |header: FrameHeader| {
            decode_frame(FrameForm::of(&header), &frame_bytes(&header, &handles), &mut Vec::new())
        };
        assert_eq!(read(sound), Some(sound));
        for odd in [
            FrameHeader { bench_count: 0, ..sound },
            FrameHeader { bench_count: u32::MAX, ..sound },
            FrameHeader { run_id: RUN_ID_END, ..sound },
            FrameHeader { state: 8, ..sound },
            FrameHeader { head_travel_m: f64::INFINITY, ..sound },
        ] {
            assert_eq!(read(odd), None, "{odd:?}");
        }
    }

    #[test]
    fn an_alert_names_two_benches_or_none() {
        let alert = Alert {
            run_id: 7,
            tick: 1,
            show_time_ns: 5,
            forecast_ns: Alert::NO_FORECAST,
            clearance_m: 0.0,
            point_m: [0.0; 2],
            kind: 1,
            bench_a: 0,
            bench_b: 8,
            reserved: 0,
        };
        let none = Alert { bench_a: Alert::NO_BENCH, bench_b: Alert::NO_BENCH, ..alert };
        let outside = Alert { kind: AlertKind::Outside.to_wire(), bench_b: Alert::NO_BENCH, ..alert };
        for sound in [alert, none, outside] {
            assert_eq!(decode_alert(sound.as_bytes()), Some(sound));
        }
        for (bench_a, bench_b) in [(8, 0), (3, 3), (0, Alert::NO_BENCH)] {
            let odd = Alert { bench_a, bench_b, ..alert };
            assert_eq!(decode_alert(odd.as_bytes()), None, "{bench_a} and {bench_b}");
        }
    }

    #[test]
    fn a_description_is_utf8_text_with_a_run_and_two_rates() {
        let described = Described { run_id: 5, every: 10, rate_hz: 10_000 };
        let read = |text: &[u8], described| decode_description(text, &encode_described(described));
        assert_eq!(read(b"[dragon]", described), Some((described, "[dragon]".to_owned())));
        assert_eq!(read(b"\xff", described), None);
        for odd in [
            Described { every: 0, ..described },
            Described { every: u64::MAX, ..described },
            Described { rate_hz: u64::MAX, ..described },
        ] {
            assert_eq!(read(b"", odd), None, "{odd:?}");
        }
        assert!(
            read(b"", Described { rate_hz: 0, ..described }).is_some(),
            "unknown rate: a description of another version"
        );
        assert!(read(&vec![b' '; MAX_DESCRIPTION_LEN + 1], described).is_none());
    }
}
