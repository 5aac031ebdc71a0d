//! Packets over TCP, framed by SLIP (RFC 1055), to a receiver that may come and go, or be slow.

use std::io::{self, ErrorKind, Write as _};
use std::net::{SocketAddrV4, TcpStream};
use std::time::Duration;

use rustix::net::sockopt::{set_socket_send_buffer_size, set_tcp_user_timeout};

use super::outlet::{Delivery, Outlet, Packets};

/// How long a receiver may take to accept; there is nobody else to be kept waiting meanwhile.
const CONNECT_PATIENCE: Duration = Duration::from_millis(500);
/// From a connection's end to the first attempt at another one; each further one waits twice as long.
const FIRST_PAUSE_NS: u64 = 100_000_000;
const LONGEST_PAUSE_NS: u64 = 5_000_000_000;
/// Frames that may wait on this machine for a receiver that is slower: whatever waits is old when it comes.
const FRAMES_KEPT: usize = 3;
/// How long a receiver may take nothing before the connection counts as lost.
const TAKING_PATIENCE_MS: u32 = 5_000;
/// How long the last packets may take at the end.
const FAREWELL: Duration = Duration::from_millis(200);

/// Connects to a receiver, again and again where it has to. A frame is left out where the one before has not been taken
/// whole, so that a slow receiver gets whole packets, and poses that are as old as the system's buffers of both sides make
/// them; the one here is small.
#[derive(Debug)]
pub struct SlipSender {
    to: SocketAddrV4,
    connection: Option<TcpStream>,
    /// When to connect again, and how long to wait after the next failure.
    retry_ns: u64,
    pause_ns: u64,
    /// What the receiver has not taken yet, from `taken` on.
    pending: Vec<u8>,
    taken: usize,
    /// The longest frame that the system's buffer has been made for.
    longest: usize,
}

impl SlipSender {
    /// A sender that connects with its first frame.
    pub fn new(to: SocketAddrV4) -> Self {
        let pause_ns = FIRST_PAUSE_NS;
        Self { to, connection: None, retry_ns: 0, pause_ns, pending: Vec::new(), taken: 0, longest: 0 }
    }

    fn deliver(&mut self, packets: &Packets, now_ns: u64) -> io::Result<Delivery> {
        self.connect(now_ns)?;
        if !self.flush()? {
            let trouble = io::Error::new(ErrorKind::TimedOut, "it is slower than the bridge, frames are left out");
            return Ok(Delivery { dropped: true, trouble: Some(trouble), ..Delivery::default() });
        }
        let mut delivery = Delivery::default();
        for packet in packets.iter() {
            let before = self.pending.len();
            append_framed(packet, &mut self.pending);
            delivery.count(self.pending.len() - before, Ok(()));
        }
        self.keep_few()?;
        self.flush()?;
        self.pause_ns = FIRST_PAUSE_NS;
        Ok(delivery)
    }

    fn connect(&mut self, now_ns: u64) -> io::Result<()> {
        if self.connection.is_some() {
            return Ok(());
        }
        if now_ns < self.retry_ns {
            return Err(ErrorKind::NotConnected.into());
        }
        let stream = TcpStream::connect_timeout(&self.to.into(), CONNECT_PATIENCE)?;
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        set_tcp_user_timeout(&stream, TAKING_PATIENCE_MS)?;
        self.connection = Some(stream);
        self.longest = 0;
        Ok(())
    }

    /// Has the system keep few frames. Left to itself it keeps megabytes, and a slow receiver gets poses of many seconds ago.
    fn keep_few(&mut self) -> io::Result<()> {
        if let Some(stream) = &self.connection
            && self.pending.len() > self.longest
        {
            self.longest = self.pending.len();
            // The system doubles it, for what it needs beside the bytes.
            set_socket_send_buffer_size(stream, FRAMES_KEPT * self.longest)?;
        }
        Ok(())
    }

    /// Hands over what the receiver takes at once. Returns whether that was all.
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
        self.pause_ns = (2 * self.pause_ns).min(LONGEST_PAUSE_NS);
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
            // Whoever does not take the rest now is not waited for.
            let _ = stream.set_nonblocking(false);
            let _ = stream.set_write_timeout(Some(FAREWELL));
            let _ = stream.write_all(&self.pending[self.taken..]);
        }
    }
}

const END: u8 = 0xC0;
const ESCAPE: u8 = 0xDB;
const ESCAPED_END: u8 = 0xDC;
const ESCAPED_ESCAPE: u8 = 0xDD;

/// Appends a packet between two ENDs, the first of which ends whatever noise came before.
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
    fn what_ends_or_escapes_is_escaped() {
        let mut stream = Vec::new();
        append_framed(&[1, END, 2, ESCAPE, 3], &mut stream);
        append_framed(&[], &mut stream);
        assert_eq!(stream, [END, 1, ESCAPE, ESCAPED_END, 2, ESCAPE, ESCAPED_ESCAPE, 3, END, END, END]);
    }
}
