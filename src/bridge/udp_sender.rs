//! Datagrams to one address, unicast, broadcast or multicast.

use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::time::Duration;

use rustix::net::sockopt::set_ip_multicast_if;

use super::outlet::{Delivery, Outlet, Packets};

/// How long a datagram may wait for the network to take those before it.
const PATIENCE: Duration = Duration::from_millis(20);

/// Where datagrams go, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UdpTarget {
    /// The receiver.
    pub to: SocketAddrV4,
    /// The address of the interface by which they leave; without one, the routing table decides.
    pub interface: Option<Ipv4Addr>,
    /// Networks that a multicast datagram may pass through.
    pub multicast_ttl: u32,
}

/// Sends datagrams. Its socket is bound to a port that the system chooses, and connected: it takes datagrams from nobody but
/// the receiver, and reads none.
#[derive(Debug)]
pub struct UdpSender {
    target: UdpTarget,
    /// `None` where the receiver cannot be reached: a new one is made for the next frame.
    socket: Option<UdpSocket>,
}

impl UdpSender {
    /// Makes a sender. That the receiver cannot be reached is no error: it may be by and by.
    ///
    /// # Errors
    /// The operating system's reason why there can be no socket, above all that no interface has the address.
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
                    // It was an earlier datagram that was refused; this one has not been sent yet.
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
    socket.set_write_timeout(Some(PATIENCE))?;
    socket.set_multicast_ttl_v4(target.multicast_ttl)?;
    socket.set_broadcast(true)?;
    if let Some(interface) = target.interface {
        set_ip_multicast_if(&socket, &interface)?;
    }
    Ok(socket)
}
