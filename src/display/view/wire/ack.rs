//! A page's acknowledgement of a frame.

use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Ack {
    ack: u32,
}

/// The sequence number of the frame that a message acknowledges; `None` for any other message.
///
/// ```
/// use bench_dragon::display::view::wire::read_ack;
///
/// assert_eq!(read_ack(r#"{"ack":7}"#), Some(7));
/// assert_eq!(read_ack(r#"{"ack":-7}"#), None);
/// assert_eq!(read_ack(r#"{"ack":7,"more":1}"#), None);
/// ```
pub fn read_ack(text: &str) -> Option<u32> {
    serde_json::from_str(text).ok().map(|Ack { ack }| ack)
}
