//! Sending of datagrams to one address: unicast, broadcast or multicast.

use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::time::Duration;

use rustix::net::sockopt::set_ip_multicast_if;

use super::outlet::{Delivery, Outlet, Packets};

/// Longest time that a send blocks while the system's send buffer is full.
const SEND_TIMEOUT: Duration = Duration::from_millis(20);

/// The receiver of datagrams, and the settings of the socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UdpTarget {
    /// The receiver.
    pub to: SocketAddrV4,
    /// The address of the interface that sends; `None`: the routing table decides.
    pub interface: Option<Ipv4Addr>,
    /// Time to live of multicast datagrams: the number of networks that they may pass through.
    pub multicast_ttl: u32,
}

/// Sends datagrams. Its socket has a port that the system chooses, and is connected to the receiver, so the system discards
/// datagrams from other addresses. The sender reads none.
#[derive(Debug)]
pub struct UdpSender {
    target: UdpTarget,
    /// `None` while the receiver is unreachable. The next frame opens a new socket.
    socket: Option<UdpSocket>,
}

impl UdpSender {
    /// Opens a socket. An unreachable receiver is not an error: every send tries again.
    ///
    /// # Errors
    /// The operating system's error if it cannot open the socket, usually because no interface has the given address.
    pub fn open(target: UdpTarget) -> io::Result<Self> {
        let socket = bind(target)?;
        Ok(Self { target, socket: socket.connect(target.to).is_ok().then_some(socket) })
    }

    fn reopen(&mut self) -> io::Result<()> {
        if self.socket.is_none() {
            let socket = bind(self.target)?;
            socket.connect(self.target.to)?;
            self.socket = Some(socket);
        }
        Ok(())
    }
}

impl Outlet for UdpSender {
    fn send(&mut self, packets: &Packets, _now_ns: u64) -> Delivery {
        let mut delivery = Delivery::default();
        if let Err(error) = self.reopen() {
            delivery.count(0, Err(error));
            return delivery;
        }
        for packet in packets.iter() {
            let Some(socket) = &self.socket else { break };
            let mut sent = send_one(socket, packet);
            if let Err(error) = &sent {
                if error.kind() == ErrorKind::ConnectionRefused {
                    // The error reports that an earlier datagram was rejected. This one has not been sent yet.
                    delivery.count(0, sent);
                    sent = send_one(socket, packet);
                } else {
                    self.socket = None;
                }
            }
            delivery.count(packet.len(), sent);
        }
        delivery
    }
}

fn send_one(socket: &UdpSocket, packet: &[u8]) -> io::Result<()> {
    socket.send(packet).map(|_| ())
}

fn bind(target: UdpTarget) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind((target.interface.unwrap_or(Ipv4Addr::UNSPECIFIED), 0))?;
    socket.set_write_timeout(Some(SEND_TIMEOUT))?;
    socket.set_multicast_ttl_v4(target.multicast_ttl)?;
    socket.set_broadcast(true)?;
    if let Some(interface) = target.interface {
        set_ip_multicast_if(&socket, &interface)?;
    }
    Ok(socket)
}
