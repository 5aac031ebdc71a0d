//! A source of timecode, on a thread of the test.

use std::net::{ToSocketAddrs, UdpSocket};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Sends a hundred timecodes per second, as OSC, until the other end of `over` is dropped.
pub(crate) fn send_timecode(listen: impl ToSocketAddrs, over: &Receiver<()>) {
    let (socket, begun) = (UdpSocket::bind("127.0.0.1:0").expect("a port"), Instant::now());
    while over.recv_timeout(Duration::from_millis(10)) == Err(RecvTimeoutError::Timeout) {
        let position_s = begun.elapsed().as_secs_f32().to_be_bytes();
        let message = [&b"/timecode\0\0\0,f\0\0"[..], &position_s].concat();
        // The send may fail if the server has ended.
        let _ = socket.send_to(&message, &listen);
    }
}
