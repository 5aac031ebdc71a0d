//! Sending of packets over TCP, framed by SLIP (RFC 1055). The receiver may disconnect, return, or be slow.

use std::io::{self, ErrorKind, Write as _};
use std::net::{SocketAddrV4, TcpStream};
use std::time::Duration;

use rustix::net::sockopt::{set_socket_send_buffer_size, set_tcp_user_timeout};

use super::outlet::{Delivery, Outlet, Packets};

/// Longest time that an attempt to connect blocks. The bridge has no other receiver that this delays.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);
/// Time from the end of a connection to the first attempt at another one. The delay doubles after each failure.
const FIRST_RETRY_DELAY_NS: u64 = 100_000_000;
const LONGEST_RETRY_DELAY_NS: u64 = 5_000_000_000;
/// Frames that this machine buffers for a slow receiver. Buffered frames are old when they arrive, so the limit is low.
const MAX_BUFFERED_FRAMES: usize = 3;
/// The connection counts as lost after the receiver has accepted no bytes for this time.
const STALLED_RECEIVER_TIMEOUT_MS: u32 = 5_000;
/// Longest time that sending the last packets blocks when the bridge ends.
const FINAL_SEND_TIMEOUT: Duration = Duration::from_millis(200);

/// Sends packets over TCP, and reconnects after every failure. It drops a frame while part of the previous frame is unsent, so
/// a slow receiver still gets whole packets. The delay of these packets depends on the system's buffers on both machines.
/// The send buffer on this machine is small.
#[derive(Debug)]
pub struct SlipSender {
    to: SocketAddrV4,
    connection: Option<TcpStream>,
    /// Earliest time of the next attempt to connect, and the delay after the next failure.
    retry_ns: u64,
    pause_ns: u64,
    /// Framed bytes of the last frame. The system has not accepted those from `taken` on.
    pending: Vec<u8>,
    taken: usize,
    /// The longest frame in bytes, by which the system's send buffer is sized.
    longest: usize,
}

impl SlipSender {
    /// Returns a sender that connects when it sends its first frame.
    pub fn new(to: SocketAddrV4) -> Self {
        let pause_ns = FIRST_RETRY_DELAY_NS;
        Self { to, connection: None, retry_ns: 0, pause_ns, pending: Vec::new(), taken: 0, longest: 0 }
    }

    fn deliver(&mut self, packets: &Packets, now_ns: u64) -> io::Result<Delivery> {
        self.connect(now_ns)?;
        if !self.flush()? {
            let trouble =
                io::Error::new(ErrorKind::TimedOut, "the receiver is slower than the bridge, frames are dropped");
            return Ok(Delivery { is_dropped: true, trouble: Some(trouble), ..Delivery::default() });
        }
        let mut delivery = Delivery::default();
        for packet in packets.iter() {
            let before = self.pending.len();
            append_framed(packet, &mut self.pending);
            delivery.count(self.pending.len() - before, Ok(()));
        }
        self.limit_send_buffer()?;
        self.flush()?;
        self.pause_ns = FIRST_RETRY_DELAY_NS;
        Ok(delivery)
    }

    fn connect(&mut self, now_ns: u64) -> io::Result<()> {
        if self.connection.is_some() {
            return Ok(());
        }
        if now_ns < self.retry_ns {
            return Err(ErrorKind::NotConnected.into());
        }
        let stream = TcpStream::connect_timeout(&self.to.into(), CONNECT_TIMEOUT)?;
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        set_tcp_user_timeout(&stream, STALLED_RECEIVER_TIMEOUT_MS)?;
        self.connection = Some(stream);
        self.longest = 0;
        Ok(())
    }

    /// Limits the system's send buffer to a few frames. The default buffer holds megabytes, which delays poses to a slow
    /// receiver by many seconds.
    fn limit_send_buffer(&mut self) -> io::Result<()> {
        if let Some(stream) = &self.connection
            && self.pending.len() > self.longest
        {
            self.longest = self.pending.len();
            // The system doubles the value, to have room for its own data.
            set_socket_send_buffer_size(stream, MAX_BUFFERED_FRAMES * self.longest)?;
        }
        Ok(())
    }

    /// Sends as many pending bytes as the system accepts without blocking. Returns whether none remain.
    fn flush(&mut self) -> io::Result<bool> {
        let Some(stream) = &mut self.connection else { return Ok(false) };
        while self.taken < self.pending.len() {
            match stream.write(&self.pending[self.taken..]) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(len) => self.taken += len,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(false),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.pending.clear();
        self.taken = 0;
        Ok(true)
    }

    fn hang_up(&mut self, now_ns: u64) {
        self.connection = None;
        self.retry_ns = now_ns + self.pause_ns;
        self.pause_ns = (2 * self.pause_ns).min(LONGEST_RETRY_DELAY_NS);
        self.pending.clear();
        self.taken = 0;
    }
}

impl Outlet for SlipSender {
    fn send(&mut self, packets: &Packets, now_ns: u64) -> Delivery {
        self.deliver(packets, now_ns).unwrap_or_else(|error| {
            if error.kind() != ErrorKind::NotConnected {
                self.hang_up(now_ns);
            }
            let mut delivery = Delivery::default();
            delivery.count(0, Err(error));
            delivery
        })
    }
}

impl Drop for SlipSender {
    fn drop(&mut self) {
        if let Some(stream) = &mut self.connection {
            // If the receiver does not accept the rest within the timeout, the rest is lost.
            let _ = stream.set_nonblocking(false);
            let _ = stream.set_write_timeout(Some(FINAL_SEND_TIMEOUT));
            let _ = stream.write_all(&self.pending[self.taken..]);
        }
    }
}

const END: u8 = 0xC0;
const ESCAPE: u8 = 0xDB;
const ESCAPED_END: u8 = 0xDC;
const ESCAPED_ESCAPE: u8 = 0xDD;

/// Appends a packet between two END bytes. The first END terminates any noise on the line.
fn append_framed(packet: &[u8], stream: &mut Vec<u8>) {
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
    fn end_and_escape_bytes_are_escaped() {
        let mut stream = Vec::new();
        append_framed(&[1, END, 2, ESCAPE, 3], &mut stream);
        append_framed(&[], &mut stream);
        assert_eq!(stream, [END, 1, ESCAPE, ESCAPED_END, 2, ESCAPE, ESCAPED_ESCAPE, 3, END, END, END]);
    }
}
