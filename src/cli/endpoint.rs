//! The network ends of the commands that run beside a show.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, UdpSocket};
use std::{fmt, io};

/// Transport of an end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Transport {
    Tcp,
    Udp,
}

/// An address at which a command listens, or to which it sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Endpoint {
    Listens(Transport, SocketAddr),
    /// With the address of the network interface, if one is chosen.
    Sends(Transport, SocketAddr, Option<Ipv4Addr>),
}

impl Endpoint {
    pub(crate) fn address(self) -> SocketAddr {
        let (Self::Listens(_, address) | Self::Sends(_, address, _)) = self;
        address
    }

    pub(crate) fn transport(self) -> Transport {
        let (Self::Listens(transport, _) | Self::Sends(transport, ..)) = self;
        transport
    }

    /// Opens and closes the end, without sending anything. Returns the address of this machine that it used.
    pub(crate) fn probe(self) -> io::Result<SocketAddr> {
        match self {
            Self::Listens(Transport::Tcp, address) => TcpListener::bind(address)?.local_addr(),
            Self::Listens(Transport::Udp, address) => UdpSocket::bind(address)?.local_addr(),
            // A multicast leaves by its interface, whatever the routing table says.
            Self::Sends(_, address, Some(from)) if address.ip().is_multicast() => {
                UdpSocket::bind((from, 0))?.local_addr()
            }
            Self::Sends(_, address, from) => {
                let any: IpAddr =
                    if address.is_ipv4() { Ipv4Addr::UNSPECIFIED.into() } else { Ipv6Addr::UNSPECIFIED.into() };
                let socket = UdpSocket::bind((from.map_or(any, IpAddr::from), 0))?;
                socket.set_broadcast(true)?;
                // Asks the routing table; no packet leaves.
                socket.connect(address)?;
                socket.local_addr()
            }
        }
    }
}

impl fmt::Display for Transport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Tcp => "TCP",
            Self::Udp => "UDP",
        })
    }
}
