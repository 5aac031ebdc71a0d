//! A minimal HTTP client: one request, one reply.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};

use serde_json::Value;
use test_support::eventually::DEADLINE;

/// The reply to a request.
#[derive(Debug)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    /// First line and headers.
    pub(crate) head: String,
    pub(crate) body: String,
}

/// Requests a path, as a client on the same machine does.
pub(crate) fn get(address: SocketAddr, path: &str) -> Reply {
    ask(address, "GET", path, &format!("Host: {address}\r\n"))
}

/// Sends a request with these headers, each with its end of line.
pub(crate) fn ask(address: SocketAddr, method: &str, path: &str, headers: &str) -> Reply {
    send(address, method, path, headers, "")
}

/// Posts JSON with these headers, each with its end of line.
pub(crate) fn post(address: SocketAddr, path: &str, headers: &str, body: &Value) -> Reply {
    let body = body.to_string();
    let own = format!("Host: {address}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n", body.len());
    send(address, "POST", path, &(own + headers), &body)
}

fn send(address: SocketAddr, method: &str, path: &str, headers: &str, body: &str) -> Reply {
    let mut stream = TcpStream::connect_timeout(&address, DEADLINE).expect("the program listens");
    stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    write!(stream, "{method} {path} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n{body}").expect("a request");
    let mut text = String::new();
    let read = stream.read_to_string(&mut text);
    read.unwrap_or_else(|error| panic!("{method} {path}: {error} after {text:?}"));
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or_else(|| panic!("a whole reply: {text}"));
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
    Reply { status: status.expect("a status"), head: head.to_lowercase(), body: body.to_owned() }
}
