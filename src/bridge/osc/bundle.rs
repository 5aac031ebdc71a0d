//! Messages in bundles.

use rosc::OscTime;

use crate::bridge::packets::{MAX_PACKET_LEN, Packets};

const HEADER: &[u8] = b"#bundle\0";
const HEADER_LEN: usize = HEADER.len() + 8;
/// Bytes before each message: its length.
const PREFIX_LEN: usize = 4;
/// From 1900, where OSC's time begins, to 1970, in seconds.
const UNIX_EPOCH_S: u64 = 2_208_988_800;

/// Adds bundles of these messages to `packets`, as many in each as a datagram holds, all under one time.
pub(super) fn pack(messages: &Packets, time: OscTime, packets: &mut Packets) {
    let mut rest = messages.iter().peekable();
    while rest.peek().is_some() {
        packets.push(|bytes| {
            let start = bytes.len();
            bytes.extend_from_slice(HEADER);
            bytes.extend_from_slice(&time.seconds.to_be_bytes());
            bytes.extend_from_slice(&time.fractional.to_be_bytes());
            let is_first = |len: usize| len == HEADER_LEN;
            while let Some(message) = rest.next_if(|message| {
                let len = bytes.len() - start;
                is_first(len) || len + PREFIX_LEN + message.len() <= MAX_PACKET_LEN
            }) {
                bytes.extend_from_slice(&(message.len() as u32).to_be_bytes());
                bytes.extend_from_slice(message);
            }
        });
    }
}

/// A Unix time in nanoseconds as OSC's: whole seconds since 1900, which begin anew in 2036, and 2⁻³² of a second.
pub(super) fn osc_time(unix_ns: u64) -> OscTime {
    let (seconds, nanos) = (unix_ns / 1_000_000_000 + UNIX_EPOCH_S, unix_ns % 1_000_000_000);
    OscTime { seconds: seconds as u32, fractional: ((nanos << 32) / 1_000_000_000) as u32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_counts_seconds_since_1900_and_their_fractions() {
        assert_eq!(osc_time(0), OscTime { seconds: 2_208_988_800, fractional: 0 });
        assert_eq!(osc_time(1_500_000_000), OscTime { seconds: 2_208_988_801, fractional: 1 << 31 });
        assert_eq!(osc_time(999_999_999).fractional, u32::MAX - 4);
    }
}
