//! UDP on loopback, whose packets are long enough for a frame: one datagram for each reader. A slow reader loses the newest
//! frames.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

use bench_dragon_ipc::{FrameHeader, HandleState};

use crate::arrival::Arrival;
use crate::frame_bytes::{self, Encoder, FRAME_BYTES};
use crate::publishing::{Sender, announce};
use crate::reading::Receiver;
use crate::setting::{Mode, Setting};

/// Any free port, on loopback only.
const LOOPBACK: (Ipv4Addr, u16) = (Ipv4Addr::LOCALHOST, 0);

pub(crate) struct UdpSender {
    encoder: Encoder,
    bytes: Vec<u8>,
    socket: UdpSocket,
    readers: BTreeSet<SocketAddr>,
}

impl UdpSender {
    /// Opens a socket and waits for all readers.
    pub(crate) fn open(setting: Setting) -> Self {
        let socket = UdpSocket::bind(LOOPBACK).expect("a free port");
        announce(&socket.local_addr().expect("the socket is bound").to_string());
        let mut readers = BTreeSet::new();
        while readers.len() < setting.readers {
            let (_, address) = socket.recv_from(&mut [0]).expect("each reader sends one datagram");
            readers.insert(address);
        }
        Self { encoder: Encoder::new(), bytes: vec![0; FRAME_BYTES], socket, readers }
    }
}

impl Sender for UdpSender {
    fn send(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) {
        self.encoder.encode(fill, &mut self.bytes);
        for reader in &self.readers {
            // Sending to a reader that has ended is not an error.
            self.socket.send_to(&self.bytes, reader).expect("loopback accepts datagrams of this size");
        }
    }
}

pub(crate) struct UdpReceiver {
    socket: UdpSocket,
    bytes: Vec<u8>,
}

impl UdpReceiver {
    pub(crate) fn open(setting: Setting, place: &str) -> Self {
        let socket = UdpSocket::bind(LOOPBACK).expect("a free port");
        socket.connect(place).expect("loopback exists");
        socket.send(b"!").expect("the publisher listens");
        socket.set_nonblocking(setting.mode == Mode::Polling).expect("the socket supports both modes");
        Self { socket, bytes: vec![0; FRAME_BYTES] }
    }
}

impl Receiver for UdpReceiver {
    fn receive(&mut self) -> Option<Arrival> {
        match self.socket.recv(&mut self.bytes) {
            Ok(length) => Some(frame_bytes::read(&self.bytes[..length])),
            Err(error) if error.kind() == ErrorKind::WouldBlock => None,
            Err(error) => panic!("the socket failed: {error}"),
        }
    }
}
