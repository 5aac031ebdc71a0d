//! What goes over the wire: the bus's own layouts, which are little-endian, checked before anything is made of them. Their
//! bytes are those that `IntoBytes::as_bytes` returns, for a whole frame [`frame_bytes`](bench_dragon_ipc::frame_bytes).
//!
//! Pure: bytes in, values out. Whoever sends may be another program, another version, or an enemy; so a length is compared
//! before anything is read, nothing in a payload decides how much memory is taken, and a number that no source would send
//! is refused.

use bench_dragon_geometry::dragon::MAX_BENCHES;
use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use bench_dragon_ipc::{
    Alert, AlertKind, Command, CommandReply, FrameHeader, FromBytes, HandleState, IntoBytes as _, ShowState,
};

use crate::source::replay::FASTEST_HZ;

const _: () = assert!(cfg!(target_endian = "little"), "the bus and the wire have the same bytes");

/// Encodings of the payloads. What run a description is of stands in its attachment, see [`Described`].
pub(super) const FRAME_ENCODING: &str = "application/octet-stream;bench_dragon.Frame.v1";
pub(super) const ALERT_ENCODING: &str = "application/octet-stream;bench_dragon.Alert.v1";
pub(super) const COMMAND_ENCODING: &str = "application/octet-stream;bench_dragon.Command.v3";
pub(super) const REPLY_ENCODING: &str = "application/octet-stream;bench_dragon.CommandReply.v1";
pub(super) const DESCRIPTION_ENCODING: &str = "text/toml";

const HEADER_BYTES: usize = size_of::<FrameHeader>();
const HANDLE_BYTES: usize = size_of::<HandleState>();
/// Bytes of the longest frame that is taken.
pub(super) const MAX_FRAME_BYTES: usize = HEADER_BYTES + (MAX_BENCHES + 1) * HANDLE_BYTES;
pub(super) const ALERT_BYTES: usize = size_of::<Alert>();
pub(super) const COMMAND_BYTES: usize = size_of::<Command>();
pub(super) const REPLY_BYTES: usize = size_of::<CommandReply>();
/// Bytes of what is attached to a command, and to a description.
pub(super) const SEEN_BYTES: usize = size_of::<[u64; 2]>();
pub(super) const DESCRIBED_BYTES: usize = size_of::<[u64; 3]>();

/// The most that may be left out between two frames that are sent: all but one a second of the fastest run.
pub const MAX_EVERY: u64 = FASTEST_HZ as u64;

/// Reads a frame as a source publishes it. The handles are written over what `handles` holds, so that its memory is used again.
pub(super) fn decode_frame(bytes: &[u8], handles: &mut Vec<HandleState>) -> Option<FrameHeader> {
    let (head, body) = bytes.split_at_checked(HEADER_BYTES)?;
    let header = decode_header(head)?;
    let handle_count = header.bench_count as usize + 1;
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

fn decode_header(bytes: &[u8]) -> Option<FrameHeader> {
    let header: FrameHeader = read(bytes)?;
    let is_finite = are_finite(&[header.head_travel_m, header.head_speed_mps, header.time_scale]);
    let is_dragon = (1..=MAX_BENCHES).contains(&(header.bench_count as usize));
    let is_known = ShowState::from_wire(header.state).is_some();
    (is_run(header.run_id) && is_finite && is_known && is_dragon).then_some(header)
}

/// Reads an alert as a monitor publishes it: of two benches, the lower one first, or of none.
pub(super) fn decode_alert(bytes: &[u8]) -> Option<Alert> {
    let alert: Alert = read(bytes)?;
    let is_finite = are_finite(&[alert.clearance_m]) && are_finite(&alert.point_m);
    let is_known = AlertKind::from_wire(alert.kind).is_some();
    let (a, b) = (alert.bench_a, alert.bench_b);
    let is_none = a == Alert::NO_BENCH && b == Alert::NO_BENCH;
    let is_pair = a < b && (b as usize) < MAX_BENCHES;
    (is_run(alert.run_id) && is_finite && is_known && (is_none || is_pair)).then_some(alert)
}

/// Reads a reply. A reason that this version does not know is one all the same.
pub(super) fn decode_reply(bytes: &[u8]) -> Option<CommandReply> {
    read(bytes).filter(|reply: &CommandReply| is_run(reply.run_id))
}

/// What whoever commands has seen of the show: attached to a command, as two little-endian `u64`. By it the other side rejects
/// a command that was held up between the hosts, and which must not be carried out any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    pub(super) run_id: u64,
    /// The tick that it has come to.
    pub(super) tick: u64,
}

pub(super) fn encode_seen(seen: Seen) -> Vec<u8> {
    [seen.run_id, seen.tick].as_bytes().to_vec()
}

pub(super) fn decode_seen(bytes: &[u8]) -> Option<Seen> {
    let [run_id, tick] = read(bytes)?;
    is_run(run_id).then_some(Seen { run_id, tick })
}

/// What a description is of: attached to it, as three little-endian `u64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Described {
    /// The run.
    pub run_id: u64,
    /// Of the run's frames, those are sent whose tick is a multiple of this, and those that change the state.
    pub every: u64,
    /// Frames of the run a second before that choice; 0 where it is not known. A recording that is played faster than it was
    /// made has more than its configuration says.
    pub rate_hz: u64,
}

/// What is attached to a description, as bytes.
pub fn encode_described(described: Described) -> Vec<u8> {
    [described.run_id, described.every, described.rate_hz].as_bytes().to_vec()
}

/// Reads a description, and what it is of. The text is not read as a configuration: that is its readers' affair.
pub(super) fn decode_description(bytes: &[u8], attached: &[u8]) -> Option<(Described, String)> {
    let [run_id, every, rate_hz] = read(attached)?;
    let is_rate = (1..=MAX_EVERY).contains(&every) && rate_hz <= u64::from(FASTEST_HZ);
    if !is_run(run_id) || !is_rate || bytes.len() > MAX_DESCRIPTION_LEN {
        return None;
    }
    Some((Described { run_id, every, rate_hz }, str::from_utf8(bytes).ok()?.to_owned()))
}

/// Numbers of runs are smaller, so that every double holds them.
const RUN_ID_END: u64 = 1 << 53;

fn is_run(run_id: u64) -> bool {
    run_id < RUN_ID_END
}

fn are_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

/// What lies in a payload that is exactly as long as its kind. Of a command no more is asked: its values are the server's to judge.
pub(super) fn read<Kind: FromBytes>(bytes: &[u8]) -> Option<Kind> {
    Kind::read_from_bytes(bytes).ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use bench_dragon_ipc::frame_bytes;

    use super::*;

    proptest! {
        #[test]
        fn whatever_is_taken_of_hostile_bytes_is_what_they_say(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let mut handles = Vec::new();
            if let Some(header) = decode_frame(&bytes, &mut handles) {
                prop_assert_eq!(frame_bytes(&header, &handles), bytes.clone());
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
            let bytes = frame_bytes(&header, &handles);
            prop_assert_eq!(bytes.len(), HEADER_BYTES + handles.len() * HANDLE_BYTES);
            let mut read = vec![HandleState::default(); 3];
            let read_header = decode_frame(&bytes, &mut read).expect("it was encoded here");
            prop_assert_eq!(frame_bytes(&read_header, &read), bytes);
        }

        #[test]
        fn a_frame_that_is_cut_or_longer_is_refused((header, handles) in any_frame(), cut in 1_usize..200, extra in 1_usize..99) {
            let bytes = frame_bytes(&header, &handles);
            let mut read = Vec::new();
            prop_assert!(decode_frame(&bytes[..bytes.len().saturating_sub(cut)], &mut read).is_none());
            prop_assert!(decode_frame(&[bytes, vec![0; extra]].concat(), &mut read).is_none());
        }

        #[test]
        fn a_frame_with_any_byte_changed_is_refused_or_is_what_it_says(
            (header, handles) in any_frame(), at: prop::sample::Index, byte: u8,
        ) {
            let mut bytes = frame_bytes(&header, &handles);
            let at = at.index(bytes.len());
            bytes[at] = byte;
            let mut read = Vec::new();
            if let Some(header) = decode_frame(&bytes, &mut read) {
                prop_assert_eq!(frame_bytes(&header, &read), bytes);
            }
        }

        #[test]
        fn a_frame_with_one_value_that_is_no_number_is_refused((header, handles) in any_frame(), at: prop::sample::Index) {
            let mut bytes = frame_bytes(&header, &handles);
            let at = HEADER_BYTES + at.index(handles.len() * 6) * 8;
            bytes[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
            prop_assert_eq!(decode_frame(&bytes, &mut Vec::new()), None);
        }
    }

    #[test]
    fn a_header_stands_where_the_bus_has_it() {
        let header =
            FrameHeader { run_id: 1, tick: 2, sim_time_ns: -3, bench_count: 4, state: 1, ..FrameHeader::default() };
        let bytes = frame_bytes(&header, &[]);
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
        let read = |header: FrameHeader| decode_frame(&frame_bytes(&header, &handles), &mut Vec::new());
        assert_eq!(read(sound), Some(sound));
        for odd in [
            FrameHeader { bench_count: 0, ..sound },
            FrameHeader { bench_count: u32::MAX, ..sound },
            FrameHeader { run_id: RUN_ID_END, ..sound },
            FrameHeader { state: 6, ..sound },
            FrameHeader { head_travel_m: f64::INFINITY, ..sound },
        ] {
            assert_eq!(read(odd), None, "{odd:?}");
        }
    }

    #[test]
    fn an_alert_is_about_two_benches_or_none() {
        let alert = Alert {
            run_id: 7,
            tick: 1,
            sim_time_ns: 5,
            forecast_ns: Alert::NO_FORECAST,
            clearance_m: 0.0,
            point_m: [0.0; 2],
            kind: 1,
            bench_a: 0,
            bench_b: 8,
            reserved: 0,
        };
        let none = Alert { bench_a: Alert::NO_BENCH, bench_b: Alert::NO_BENCH, ..alert };
        for sound in [alert, none] {
            assert_eq!(decode_alert(sound.as_bytes()), Some(sound));
        }
        for (bench_a, bench_b) in [(8, 0), (3, 3), (0, Alert::NO_BENCH)] {
            let odd = Alert { bench_a, bench_b, ..alert };
            assert_eq!(decode_alert(odd.as_bytes()), None, "{bench_a} and {bench_b}");
        }
    }

    #[test]
    fn a_description_is_text_of_a_run_and_says_how_many_frames_there_are_and_are_sent() {
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
        assert!(read(b"", Described { rate_hz: 0, ..described }).is_some(), "a description of another version");
        assert!(read(&vec![b' '; MAX_DESCRIPTION_LEN + 1], described).is_none());
    }
}
