//! The contestants, one file each: how frames are sent, and how they are read.

mod bare;
mod ours;
mod udp;
mod unix;

use crate::publishing::publish;
use crate::reading::read;
use crate::setting::Setting;

/// What carries the frames.
#[derive(Debug)]
pub(crate) struct Transport {
    /// As it stands in the figures' keys.
    pub(crate) name: &'static str,
    /// As people read it.
    pub(crate) title: &'static str,
    /// Publishes until the parent closes stdin; `None` for ours, which the real server publishes.
    pub(crate) publish: Option<fn(Setting)>,
    /// Reads one turn of what is published at a place.
    pub(crate) read: fn(Setting, &str),
}

pub(crate) const OURS: Transport = Transport {
    name: "ours",
    title: "bench-dragon",
    publish: None,
    read: |setting, place| read(setting, ours::Subscriber::open(setting, place)),
};
pub(crate) const BARE: Transport = Transport {
    name: "bare",
    title: "bare iceoryx2",
    publish: Some(|setting| publish(bare::BareSender::open(setting))),
    read: |setting, place| read(setting, bare::BareReceiver::open(setting, place)),
};
pub(crate) const UNIX: Transport = Transport {
    name: "unix",
    title: "Unix stream",
    publish: Some(|setting| publish(unix::UnixSender::open(setting))),
    read: |setting, place| read(setting, unix::UnixReceiver::open(setting, place)),
};
pub(crate) const UDP: Transport = Transport {
    name: "udp",
    title: "UDP, loopback",
    publish: Some(|setting| publish(udp::UdpSender::open(setting))),
    read: |setting, place| read(setting, udp::UdpReceiver::open(setting, place)),
};
