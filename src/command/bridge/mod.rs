//! `bridge`: the poses in the words of show control.

use std::net::SocketAddrV4;
use std::process::ExitCode;

use anyhow::Context as _;

use crate::bridge::{Outlet, UdpSender, UdpTarget};
use crate::cli::{Bridge, BridgeArgs, NetworkArgs};

mod feed;
mod osc;
mod psn;
mod session;
#[cfg(feature = "zenoh")]
mod zenoh;

/// What a program that was built without zenoh says.
#[cfg(not(feature = "zenoh"))]
pub(in crate::command) const WITHOUT_ZENOH: &str =
    "this program was built without the bridge to other machines: cargo build --release --features zenoh builds it in";

pub(crate) fn run(args: &BridgeArgs) -> anyhow::Result<ExitCode> {
    match &args.bridge {
        Bridge::Psn(psn) => psn::run(args, psn),
        Bridge::Osc(osc) => osc::run(args, osc),
        #[cfg(feature = "zenoh")]
        Bridge::Zenoh(zenoh) => zenoh::run(args, zenoh),
        #[cfg(not(feature = "zenoh"))]
        Bridge::Zenoh(_) => Err(crate::command::BadInput(WITHOUT_ZENOH.to_owned()).into()),
    }
}

/// Makes a sender of datagrams. An error says which interface there is none of.
fn open_udp(to: SocketAddrV4, network: NetworkArgs) -> anyhow::Result<Box<dyn Outlet>> {
    let target = UdpTarget { to, interface: network.interface, multicast_ttl: network.ttl };
    let sender = UdpSender::open(target).with_context(|| match network.interface {
        Some(interface) => format!("no interface can send from {interface}, `ip address` lists those that there are"),
        None => format!("cannot send to {to}"),
    })?;
    Ok(Box::new(sender))
}
