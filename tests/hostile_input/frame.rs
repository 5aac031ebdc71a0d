//! A message on the topic of the frames in a recording.

use bench_dragon::recording::cdr::{decode_frame, encode_frame};

/// Fails unless a message is rejected, or is a frame that keeps its bits when it is written again.
pub(crate) fn check(input: &[u8]) {
    let Some((header, handles)) = decode_frame(input) else { return };
    assert!(size_of_val(handles.as_slice()) <= input.len(), "the message contains every handle");
    let mut message = Vec::new();
    encode_frame(&mut message, &header, &handles);
    let (header_again, handles_again) = decode_frame(&message).expect("the written message is a frame");
    let mut again = Vec::new();
    encode_frame(&mut again, &header_again, &handles_again);
    assert_eq!(again, message);
}
