//! Ports for what has to be told one before it listens.

use std::net::UdpSocket;

/// A port of loopback that nobody has at this moment.
pub(crate) fn free_port() -> u16 {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.local_addr().expect("a bound socket has an address").port()
}
