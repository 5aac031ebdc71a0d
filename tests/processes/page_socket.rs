//! A minimal WebSocket client (RFC 6455) on a view: the messages that a page gets, without the frames, and commands.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;

use serde_json::Value;
use test_support::eventually::DEADLINE;

const TEXT: u8 = 1;
const CLOSE: u8 = 8;

/// An open stream of a view on this machine.
pub(crate) struct PageSocket(BufReader<TcpStream>);

impl PageSocket {
    /// Opens the stream of the view at an address.
    pub(crate) fn open(address: &str) -> Self {
        Self::open_with(address, "bench-dragon.view.v1")
    }

    /// Opens the stream as a page with the token does, which may send commands.
    pub(crate) fn open_to_steer(address: &str, token: &str) -> Self {
        Self::open_with(address, &format!("bench-dragon.view.v1, bench-dragon.token.{token}"))
    }

    fn open_with(address: &str, protocols: &str) -> Self {
        let mut stream = TcpStream::connect(address).expect("the view listens");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        // The example key of the RFC.
        let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                       Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: ";
        write!(stream, "GET /stream HTTP/1.1\r\nHost: {address}\r\n{upgrade}{protocols}\r\n\r\n").expect("a request");
        let mut reader = BufReader::new(stream);
        let mut lines = Vec::new();
        while lines.last().is_none_or(|line: &String| line != "\r\n") {
            let mut line = String::new();
            assert_ne!(reader.read_line(&mut line).expect("a reply"), 0, "the reply has ended: {lines:?}");
            lines.push(line);
        }
        assert!(lines[0].starts_with("HTTP/1.1 101 "), "{lines:?}");
        Self(reader)
    }

    /// Returns all messages up to the close of the stream.
    pub(crate) fn read_to_end(mut self) -> Vec<Value> {
        let mut messages = Vec::new();
        loop {
            let (opcode, payload) = self.message();
            match opcode {
                TEXT => messages.push(serde_json::from_slice(&payload).expect("JSON")),
                CLOSE => return messages,
                _ => {}
            }
        }
    }

    /// Sends a text, of at most 125 bytes. A client masks its messages; this mask changes nothing.
    pub(crate) fn send(&mut self, text: &Value) {
        let text = text.to_string();
        let length = u8::try_from(text.len()).ok().filter(|&length| length < 126).expect("a short text");
        let frame = [&[0x80 | TEXT, 0x80 | length, 0, 0, 0, 0], text.as_bytes()].concat();
        self.0.get_mut().write_all(&frame).expect("the stream is open");
    }

    /// Sends a command, and returns the reply to it.
    pub(crate) fn ask(&mut self, command: &Value) -> Value {
        self.send(command);
        loop {
            let (opcode, payload) = self.message();
            assert_ne!(opcode, CLOSE, "the stream has ended before the reply to {command}");
            let text = (opcode == TEXT).then(|| serde_json::from_slice::<Value>(&payload).expect("JSON"));
            if let Some(reply) = text.filter(|text| text["type"] == "reply") {
                return reply;
            }
        }
    }

    fn message(&mut self) -> (u8, Vec<u8>) {
        let [first, length] = self.bytes();
        let length = match length {
            126 => u64::from(u16::from_be_bytes(self.bytes())),
            127 => u64::from_be_bytes(self.bytes()),
            length => u64::from(length),
        };
        let mut payload = vec![0; usize::try_from(length).expect("it fits into memory")];
        self.0.read_exact(&mut payload).expect("a whole message");
        (first & 0x0f, payload)
    }

    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes).expect("a message before the deadline");
        bytes
    }
}

/// The outcome among a page's messages. Fails if there is not exactly one kind of it.
pub(crate) fn outcome(messages: &[Value]) -> &Value {
    let outcomes: Vec<&Value> = messages.iter().filter(|message| message["type"] == "outcome").collect();
    let [first, others @ ..] = &outcomes[..] else { panic!("no outcome in {messages:?}") };
    assert!(others.iter().all(|other| other == first), "{outcomes:?}");
    first
}
