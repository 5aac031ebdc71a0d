//! Messages to desks: replies to commands, and the state of the show. Pure.

use rosc::{OscMessage, OscPacket, OscType, encoder};

use super::state::ShowReport;
use crate::config::PlannedCue;

/// The reply to a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Reply<'a> {
    pub(super) command: &'a str,
    /// The tick from which the command holds, or the reason of the refusal.
    pub(super) outcome: Result<u64, &'a str>,
}

impl Reply<'_> {
    /// `/dragon/reply`: command (s), accepted (i: 1 or 0), tick (i), reason (s: empty if accepted).
    pub(super) fn encode(&self) -> Vec<u8> {
        let Self { command, outcome } = *self;
        let args = vec![
            OscType::String(command.to_owned()),
            OscType::Int(outcome.is_ok().into()),
            tick(outcome.unwrap_or_default()),
            OscType::String(outcome.err().unwrap_or_default().to_owned()),
        ];
        encode("/dragon/reply", args)
    }
}

/// `/dragon/state`: state (s), show time in seconds (f), speed of the head in metres per second of wall time (f), tick (i).
pub(super) fn encode_state(report: &ShowReport) -> Vec<u8> {
    let ShowReport { state, show_time_s, speed_mps, tick: last } = *report;
    let args = vec![
        OscType::String(state.to_owned()),
        OscType::Float(show_time_s as f32),
        OscType::Float(speed_mps as f32),
        tick(last),
    ];
    encode("/dragon/state", args)
}

/// `/dragon/cue`: name (s), plan time in seconds (f), note (s).
pub(crate) fn encode_cue(PlannedCue { name, at_s, note, .. }: &PlannedCue) -> Vec<u8> {
    let text = |text: &String| OscType::String(text.clone());
    encode("/dragon/cue", vec![text(name), OscType::Float(*at_s as f32), text(note)])
}

/// The lowest 31 bits of a tick: few receivers read integers of 64 bits.
fn tick(tick: u64) -> OscType {
    OscType::Int((tick & 0x7fff_ffff) as i32)
}

fn encode(addr: &str, args: Vec<OscType>) -> Vec<u8> {
    let message = OscPacket::Message(OscMessage { addr: addr.to_owned(), args });
    encoder::encode(&message).expect("writing to a vector cannot fail")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> (String, Vec<OscType>) {
        match rosc::decoder::decode_udp(bytes) {
            Ok((b"", OscPacket::Message(OscMessage { addr, args }))) => (addr, args),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_reply_has_the_tick_or_the_reason() {
        let text = |text: &str| OscType::String(text.to_owned());
        let (address, accepted) = decoded(&Reply { command: "hold", outcome: Ok((1 << 40) + 7) }.encode());
        assert_eq!(
            (&*address, accepted),
            ("/dragon/reply", vec![text("hold"), OscType::Int(1), OscType::Int(7), text("")])
        );
        let (_, refused) = decoded(&Reply { command: "seek", outcome: Err("the show is held") }.encode());
        assert_eq!(refused, [text("seek"), OscType::Int(0), OscType::Int(0), text("the show is held")]);
    }
}
