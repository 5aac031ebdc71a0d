//! What goes over the wire: the bus's own layouts, little-endian whatever the machine, and checked before anything is made of
//! them.
//!
//! Pure: bytes in, values out. Whoever sends may be another program, another version, or an enemy; so a length is compared
//! before anything is read, nothing in a payload decides how much memory is taken, and a number that no source would send
//! is refused.

mod alert;
mod command;
mod description;
mod error;
mod fields;
mod frame;

pub use alert::{ALERT_BYTES, ALERT_ENCODING, decode_alert, encode_alert};
pub use command::{
    COMMAND_BYTES, COMMAND_ENCODING, REPLY_BYTES, REPLY_ENCODING, SEEN_BYTES, Seen, decode_command, decode_reply,
    decode_seen, encode_command, encode_reply, encode_seen,
};
pub use description::{
    DESCRIBED_BYTES, DESCRIPTION_ENCODING, Described, MAX_EVERY, decode_description, encode_described,
};
pub use error::WireError;
pub use frame::{FRAME_ENCODING, HANDLE_BYTES, HEADER_BYTES, MAX_FRAME_BYTES, decode_frame, encode_frame};

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whatever_is_taken_of_hostile_bytes_is_what_they_say(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let mut handles = Vec::new();
            if let Ok(header) = decode_frame(&bytes, &mut handles) {
                prop_assert_eq!(encode_frame(&header, &handles), bytes.clone());
            }
            if let Ok(alert) = decode_alert(&bytes) {
                prop_assert_eq!(encode_alert(&alert).to_vec(), bytes.clone());
            }
            if let Ok(command) = decode_command(&bytes) {
                prop_assert_eq!(encode_command(&command).to_vec(), bytes.clone());
            }
            if let Ok(reply) = decode_reply(&bytes) {
                prop_assert_eq!(encode_reply(&reply).to_vec(), bytes.clone());
            }
            if let Ok(seen) = decode_seen(&bytes) {
                prop_assert_eq!(encode_seen(seen).to_vec(), bytes.clone());
            }
            let (text, attached) = bytes.split_at(bytes.len().saturating_sub(DESCRIBED_BYTES));
            if let Ok((described, toml)) = decode_description(text, attached) {
                prop_assert_eq!([toml.as_bytes(), &encode_described(described)].concat(), bytes);
            }
        }
    }
}
