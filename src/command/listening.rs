//! Listening for browsers and scrapers, and telling where.

use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};

use anyhow::anyhow;
use serde::{Deserialize, Serialize};

use crate::cli::{Format, SiteArgs};
use crate::command::output::{print_json, print_line};
use crate::display::web::Site;

/// What is printed once there is something to open.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "type", rename = "listening")]
pub(super) struct ListeningLine {
    pub(super) url: String,
    pub(super) address: SocketAddr,
}

/// Listens at an address.
pub(crate) fn open(listen: SocketAddr, args: &SiteArgs) -> anyhow::Result<Site> {
    let name = rustix::system::uname();
    let machine = name.nodename().to_str().ok();
    Site::open(listen, machine, &args.allowed_hosts).map_err(|error| cannot_listen(listen, &error))
}

/// The error of an address that cannot be had.
pub(super) fn cannot_listen(listen: SocketAddr, error: &io::Error) -> anyhow::Error {
    let remedy = if error.kind() == ErrorKind::AddrInUse { "; port 0 takes a free one" } else { "" };
    anyhow!("cannot listen on {listen}: {error}{remedy}")
}

/// The address of a page, by which others reach it too where it listens to them.
pub(crate) fn url(address: SocketAddr, page: &str) -> String {
    let reached = SocketAddr::new(reachable(address.ip()), address.port());
    format!("http://{reached}/{page}")
}

/// Tells people in these words, and machines in a line of JSON, that a page can be opened.
pub(crate) fn announce(format: Format, words: &str, url: String, address: SocketAddr) -> anyhow::Result<()> {
    match format {
        Format::Json => print_json(&ListeningLine { url, address }),
        Format::Text => Ok(print_line(format_args!("{words}{url}"))?),
    }
}

/// The address by which others reach a machine that listens on all of its own.
fn reachable(ip: IpAddr) -> IpAddr {
    if !ip.is_unspecified() {
        return ip;
    }
    // Where there is no network to be found, there is this machine.
    outward_address().unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST))
}

/// The address that packets leave from. None is sent: 192.0.2.0/24 is nobody's.
fn outward_address() -> io::Result<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9))?;
    Ok(socket.local_addr()?.ip())
}
