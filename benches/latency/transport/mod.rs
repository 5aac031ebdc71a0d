//! The contestants, one file each: sending and reading of frames.

pub(crate) mod bare;
mod ours;
mod seqlock;
mod udp;
mod unix;

use crate::publishing::publish;
use crate::reading::read;
use crate::setting::Setting;

/// A transport of frames.
#[derive(Debug)]
pub(crate) struct Transport {
    /// Name in the keys of the figures.
    pub(crate) name: &'static str,
    /// Name in tables.
    pub(crate) title: &'static str,
    /// Publishes until the parent closes stdin. `None` for ours: the real server publishes these frames.
    pub(crate) publish: Option<fn(Setting)>,
    /// Whether only polling readers can read it.
    pub(crate) only_polling: bool,
    /// Reads one turn from the publisher with this name or address.
    pub(crate) read: fn(Setting, &str),
}

pub(crate) const OURS: Transport = Transport {
    name: "ours",
    title: "bench-dragon",
    publish: None,
    only_polling: false,
    read: |setting, place| read(setting, ours::Subscriber::open(setting, place)),
};
pub(crate) const BARE: Transport = Transport {
    name: "bare",
    title: "bare iceoryx2",
    publish: Some(|setting| publish(bare::BareSender::open(setting))),
    only_polling: false,
    read: |setting, place| read(setting, bare::BareReceiver::open(setting, place)),
};
pub(crate) const UNIX: Transport = Transport {
    name: "unix",
    title: "Unix stream",
    publish: Some(|setting| publish(unix::UnixSender::open(setting))),
    only_polling: false,
    read: |setting, place| read(setting, unix::UnixReceiver::open(setting, place)),
};
pub(crate) const UDP: Transport = Transport {
    name: "udp",
    title: "UDP, loopback",
    publish: Some(|setting| publish(udp::UdpSender::open(setting))),
    only_polling: false,
    read: |setting, place| read(setting, udp::UdpReceiver::open(setting, place)),
};
pub(crate) const SEQLOCK: Transport = Transport {
    name: "seqlock",
    title: "seqlock ring",
    publish: Some(|setting| publish(seqlock::RingSender::open(setting))),
    only_polling: true,
    read: |setting, place| read(setting, seqlock::RingReceiver::open(place)),
};
