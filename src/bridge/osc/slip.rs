//! SLIP: packets in a stream of bytes.

const END: u8 = 0xC0;
const ESCAPE: u8 = 0xDB;
const ESCAPED_END: u8 = 0xDC;
const ESCAPED_ESCAPE: u8 = 0xDD;

/// Appends a packet between two ENDs, the first of which ends whatever noise came before.
pub(super) fn append(packet: &[u8], stream: &mut Vec<u8>) {
    stream.push(END);
    for byte in packet {
        match *byte {
            END => stream.extend_from_slice(&[ESCAPE, ESCAPED_END]),
            ESCAPE => stream.extend_from_slice(&[ESCAPE, ESCAPED_ESCAPE]),
            byte => stream.push(byte),
        }
    }
    stream.push(END);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_ends_or_escapes_is_escaped() {
        let mut stream = Vec::new();
        append(&[1, END, 2, ESCAPE, 3], &mut stream);
        append(&[], &mut stream);
        assert_eq!(stream, [END, 1, ESCAPE, ESCAPED_END, 2, ESCAPE, ESCAPED_ESCAPE, 3, END, END, END]);
    }
}
