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

/// Encoding of frames: a [`FrameHeader`] and its handles.
pub const FRAME_ENCODING: &str = "application/octet-stream;bench_dragon.Frame.v1";
/// Bytes of a header.
pub const HEADER_BYTES: usize = size_of::<FrameHeader>();
/// Bytes of a handle.
pub const HANDLE_BYTES: usize = size_of::<HandleState>();
/// Bytes of the longest frame that is taken.
pub const MAX_FRAME_BYTES: usize = HEADER_BYTES + (MAX_BENCHES + 1) * HANDLE_BYTES;

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
    handles.resize(handle_count, HandleState::default());
    handles.as_mut_bytes().copy_from_slice(body);
    for handle in handles {
        finite(&handle.position_m)?;
        finite(&handle.velocity_mps)?;
    }
    Ok(header)
}

fn decode_header(bytes: &[u8]) -> Result<FrameHeader, WireError> {
    let header: FrameHeader = read(bytes)?;
    run_id(header.run_id)?;
    finite(&[header.head_travel_m, header.head_speed_mps, header.time_scale])?;
    ShowState::from_wire(header.state).ok_or(WireError::Unknown(header.state))?;
    let is_dragon = (1..=MAX_BENCHES).contains(&(header.bench_count as usize));
    if is_dragon { Ok(header) } else { Err(WireError::BenchCount(header.bench_count)) }
}

/// Encoding of alerts.
pub const ALERT_ENCODING: &str = "application/octet-stream;bench_dragon.Alert.v1";
/// Bytes of an alert.
pub const ALERT_BYTES: usize = size_of::<Alert>();

/// Reads an alert.
///
/// # Errors
/// Whatever is not as a monitor publishes it.
pub fn decode_alert(bytes: &[u8]) -> Result<Alert, WireError> {
    let alert: Alert = read(bytes)?;
    run_id(alert.run_id)?;
    finite(&[alert.clearance_m])?;
    finite(&alert.point_m)?;
    AlertKind::from_wire(alert.kind).ok_or(WireError::Unknown(alert.kind))?;
    let (a, b) = (alert.bench_a, alert.bench_b);
    let is_none = a == Alert::NO_BENCH && b == Alert::NO_BENCH;
    if is_none || (a < b && (b as usize) < MAX_BENCHES) { Ok(alert) } else { Err(WireError::Pair(a, b)) }
}

/// Encoding of commands.
pub const COMMAND_ENCODING: &str = "application/octet-stream;bench_dragon.Command.v3";
/// Encoding of replies.
pub const REPLY_ENCODING: &str = "application/octet-stream;bench_dragon.CommandReply.v1";
/// Bytes of a command.
pub const COMMAND_BYTES: usize = size_of::<Command>();
/// Bytes of a reply.
pub const REPLY_BYTES: usize = size_of::<CommandReply>();

/// Bytes of what is attached to a command.
pub const SEEN_BYTES: usize = 16;

/// What whoever commands has seen of the show: attached to a command, as two little-endian `u64`. By it the other side tells
/// one that was held up on its way, and which must not be carried out any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The run.
    pub run_id: u64,
    /// The tick that it has come to.
    pub tick: u64,
}

/// What is attached to a command, as bytes.
pub fn encode_seen(seen: Seen) -> Vec<u8> {
    [seen.run_id, seen.tick].as_bytes().to_vec()
}

/// Reads what is attached to a command.
///
/// # Errors
/// [`WireError::Length`], [`WireError::RunId`].
pub fn decode_seen(bytes: &[u8]) -> Result<Seen, WireError> {
    let [run, tick] = read(bytes)?;
    run_id(run)?;
    Ok(Seen { run_id: run, tick })
}

/// Reads a command. Its kind and values are the server's to judge.
///
/// # Errors
/// [`WireError::Length`].
pub fn decode_command(bytes: &[u8]) -> Result<Command, WireError> {
    read(bytes)
}

/// Reads a reply. A reason that this version does not know is one all the same.
///
/// # Errors
/// [`WireError::Length`], [`WireError::RunId`].
pub fn decode_reply(bytes: &[u8]) -> Result<CommandReply, WireError> {
    let reply: CommandReply = read(bytes)?;
    run_id(reply.run_id)?;
    Ok(reply)
}

/// Encoding of the description. What run it is of stands in its attachment, see [`Described`].
pub const DESCRIPTION_ENCODING: &str = "text/toml";
/// Bytes of what is attached to a description.
pub const DESCRIBED_BYTES: usize = 24;
/// The most that may be left out between two frames that are sent: all but one a second of the fastest run.
pub const MAX_EVERY: u64 = FASTEST_HZ as u64;

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

/// Reads a description and what it is of.
///
/// # Errors
/// Whatever is not as a source publishes it. The text is not read as a configuration: that is its readers' affair.
pub fn decode_description(bytes: &[u8], attached: &[u8]) -> Result<(Described, String), WireError> {
    let [run, every, rate_hz] = read(attached)?;
    let described = Described { run_id: run, every, rate_hz };
    run_id(described.run_id)?;
    if bytes.len() > MAX_DESCRIPTION_LEN {
        return Err(WireError::Length { got: bytes.len(), expected: MAX_DESCRIPTION_LEN });
    }
    let is_pace = (1..=MAX_EVERY).contains(&described.every) && described.rate_hz <= u64::from(FASTEST_HZ);
    let text = core::str::from_utf8(bytes).ok().filter(|_| is_pace).ok_or(WireError::Description)?;
    Ok((described, text.to_owned()))
}

/// What is wrong with a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// It is not as long as its kind is, or as its header says.
    #[error("{got} bytes where {expected} are expected")]
    Length {
        /// Bytes that have come.
        got: usize,
        /// Bytes that are right; the least number where several are.
        expected: usize,
    },
    /// A dragon has at least one bench and not more than a configuration may have.
    #[error("a dragon of {0} benches")]
    BenchCount(u32),
    /// A number of a run is under 2^53.
    #[error("run {0}, which no source has")]
    RunId(u64),
    /// A number of a state or kind that this version does not know.
    #[error("{0} is no number of a state or kind")]
    Unknown(u32),
    /// A place, a speed or a clearance that is no number.
    #[error("a value that is not finite")]
    NotFinite,
    /// Two benches are named, the lower one first, or none.
    #[error("benches {0} and {1} are no pair")]
    Pair(u32, u32),
    /// A text that is none, or a step between frames or a rate that no source has.
    #[error("a description that is none")]
    Description,
}

/// Numbers of runs are smaller, so that every double holds them.
pub(super) const RUN_ID_END: u64 = 1 << 53;

pub(super) fn run_id(run_id: u64) -> Result<(), WireError> {
    if run_id < RUN_ID_END { Ok(()) } else { Err(WireError::RunId(run_id)) }
}

pub(super) fn finite(values: &[f64]) -> Result<(), WireError> {
    if values.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(WireError::NotFinite) }
}

/// What lies in a payload that is exactly as long as its kind.
fn read<Kind: FromBytes>(bytes: &[u8]) -> Result<Kind, WireError> {
    let length = WireError::Length { got: bytes.len(), expected: size_of::<Kind>() };
    Kind::read_from_bytes(bytes).map_err(|_| length)
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
            if let Ok(header) = decode_frame(&bytes, &mut handles) {
                prop_assert_eq!(frame_bytes(&header, &handles), bytes.clone());
            }
            if let Ok(alert) = decode_alert(&bytes) {
                prop_assert_eq!(alert.as_bytes().to_vec(), bytes.clone());
            }
            if let Ok(command) = decode_command(&bytes) {
                prop_assert_eq!(command.as_bytes().to_vec(), bytes.clone());
            }
            if let Ok(reply) = decode_reply(&bytes) {
                prop_assert_eq!(reply.as_bytes().to_vec(), bytes.clone());
            }
            if let Ok(seen) = decode_seen(&bytes) {
                prop_assert_eq!(encode_seen(seen), bytes.clone());
            }
            let (text, attached) = bytes.split_at(bytes.len().saturating_sub(DESCRIBED_BYTES));
            if let Ok((described, toml)) = decode_description(text, attached) {
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
            prop_assert!(decode_frame(&bytes[..bytes.len().saturating_sub(cut)], &mut read).is_err());
            prop_assert!(decode_frame(&[bytes, vec![0; extra]].concat(), &mut read).is_err());
        }

        #[test]
        fn a_frame_with_any_byte_changed_is_refused_or_is_what_it_says(
            (header, handles) in any_frame(), at: prop::sample::Index, byte: u8,
        ) {
            let mut bytes = frame_bytes(&header, &handles);
            let at = at.index(bytes.len());
            bytes[at] = byte;
            let mut read = Vec::new();
            if let Ok(header) = decode_frame(&bytes, &mut read) {
                prop_assert_eq!(frame_bytes(&header, &read), bytes);
            }
        }

        #[test]
        fn a_frame_with_one_value_that_is_no_number_is_refused((header, handles) in any_frame(), at: prop::sample::Index) {
            let mut bytes = frame_bytes(&header, &handles);
            let at = HEADER_BYTES + at.index(handles.len() * 6) * 8;
            bytes[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
            prop_assert_eq!(decode_frame(&bytes, &mut Vec::new()), Err(WireError::NotFinite));
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
        assert_eq!(read(sound), Ok(sound));
        assert_eq!(read(FrameHeader { bench_count: 0, ..sound }), Err(WireError::BenchCount(0)));
        assert_eq!(read(FrameHeader { bench_count: u32::MAX, ..sound }), Err(WireError::BenchCount(u32::MAX)));
        assert_eq!(read(FrameHeader { run_id: RUN_ID_END, ..sound }), Err(WireError::RunId(RUN_ID_END)));
        assert_eq!(read(FrameHeader { state: 6, ..sound }), Err(WireError::Unknown(6)));
        assert_eq!(read(FrameHeader { head_travel_m: f64::INFINITY, ..sound }), Err(WireError::NotFinite));
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
            assert_eq!(decode_alert(sound.as_bytes()), Ok(sound));
        }
        for (bench_a, bench_b) in [(8, 0), (3, 3), (0, Alert::NO_BENCH)] {
            let odd = Alert { bench_a, bench_b, ..alert };
            assert_eq!(decode_alert(odd.as_bytes()), Err(WireError::Pair(bench_a, bench_b)));
        }
    }

    #[test]
    fn a_description_is_text_of_a_run_and_says_how_many_frames_there_are_and_are_sent() {
        let described = Described { run_id: 5, every: 10, rate_hz: 10_000 };
        let read = |text: &[u8], described| decode_description(text, &encode_described(described));
        assert_eq!(read(b"[dragon]", described), Ok((described, "[dragon]".to_owned())));
        assert_eq!(read(b"\xff", described), Err(WireError::Description));
        assert_eq!(read(b"", Described { every: 0, ..described }), Err(WireError::Description));
        assert_eq!(read(b"", Described { every: u64::MAX, ..described }), Err(WireError::Description));
        assert_eq!(read(b"", Described { rate_hz: u64::MAX, ..described }), Err(WireError::Description));
        assert!(read(b"", Described { rate_hz: 0, ..described }).is_ok(), "a description of another version");
        assert!(read(&vec![b' '; MAX_DESCRIPTION_LEN + 1], described).is_err());
    }
}
