//! The first tracker of PosiStageNet frames, read byte by byte.

use std::net::UdpSocket;

use test_support::eventually::DEADLINE;

/// Greatest number of packets until the wanted one: those of a minute, for the paper's dragon at fifty frames a second.
const MAX_PACKETS: usize = 40_000;
/// Offset of the first tracker's status in a DATA packet.
const STATUS_AT: usize = 80;
/// Offset of the first tracker's speed.
const SPEED_AT: usize = 48;
/// Offset of the first tracker's timestamp.
const TIMESTAMP_AT: usize = 88;
/// Offset of the packet's own timestamp.
const SENT_AT: usize = 8;

/// Opens a socket that receives a bridge's packets. Returns it with its address.
pub(crate) fn receiver() -> (UdpSocket, String) {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    let address = socket.local_addr().expect("a bound socket has an address").to_string();
    (socket, address)
}

/// The first tracker of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstTracker {
    pub(crate) status: f32,
    pub(crate) speed: [f32; 3],
    /// The instant for which the pose holds, in microseconds of the bridge's clock.
    pub(crate) time_us: u64,
    /// The instant at which the packet was sent.
    pub(crate) sent_us: u64,
}

impl FirstTracker {
    /// Age of the pose when the packet was sent.
    pub(crate) fn age_us(&self) -> u64 {
        self.sent_us - self.time_us
    }

    /// Reads the first tracker from a packet; `None` unless it is a DATA packet that begins with it.
    pub(crate) fn of(packet: &[u8]) -> Option<Self> {
        let is_first = packet.len() >= TIMESTAMP_AT + 8 && packet[..2] == [0x55, 0x67] && packet[24..26] == [0, 0];
        let float = |at: usize| f32::from_le_bytes(packet[at..at + 4].try_into().expect("four bytes"));
        let time_us = |at: usize| u64::from_le_bytes(packet[at..at + 8].try_into().expect("eight bytes"));
        is_first.then(|| Self {
            status: float(STATUS_AT),
            speed: [0, 4, 8].map(|offset| float(SPEED_AT + offset)),
            time_us: time_us(TIMESTAMP_AT),
            sent_us: time_us(SENT_AT),
        })
    }
}

/// Reads packets until a first tracker is as wanted.
pub(crate) fn wait_for(socket: &UdpSocket, mut is_wanted: impl FnMut(&FirstTracker) -> bool) -> FirstTracker {
    let mut packet = [0; 1_500];
    let mut next = || {
        let len = socket.recv(&mut packet).expect("the bridge continues to send");
        FirstTracker::of(&packet[..len])
    };
    let found = (0..MAX_PACKETS).find_map(|_| next().filter(&mut is_wanted));
    found.expect("one of the packets is as wanted")
}

/// Reads packets until a first tracker has this status. Returns its speed.
pub(crate) fn wait_for_status(socket: &UdpSocket, status: f32) -> [f32; 3] {
    wait_for(socket, |tracker| tracker.status == status).speed
}
