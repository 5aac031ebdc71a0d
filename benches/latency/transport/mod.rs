//! The contestants, one file each: how frames are sent, and how they are read.

mod bare;
mod ours;
mod udp;
mod unix;
mod zenoh;

pub(crate) use zenoh::clear_up;

use crate::publishing::publish as pace;
use crate::reading;
use crate::setting::{Setting, Transport};

/// Publishes until the parent closes stdin.
pub(crate) fn publish(setting: Setting) {
    match setting.transport {
        Transport::Ours => panic!("ours is published by the real server"),
        Transport::Bare => pace(bare::BareSender::open(setting)),
        Transport::Unix => pace(unix::UnixSender::open(setting)),
        Transport::Udp => pace(udp::UdpSender::open(setting)),
        Transport::ZenohTcp => pace(zenoh::TcpSender::open()),
        Transport::ZenohShm => pace(zenoh::ShmSender::open()),
    }
}

/// Reads one turn.
pub(crate) fn read(setting: Setting, place: &str) {
    match setting.transport {
        Transport::Ours => reading::read(setting, ours::Subscriber::open(setting, place)),
        Transport::Bare => reading::read(setting, bare::BareReceiver::open(setting, place)),
        Transport::Unix => reading::read(setting, unix::UnixReceiver::open(setting, place)),
        Transport::Udp => reading::read(setting, udp::UdpReceiver::open(setting, place)),
        Transport::ZenohTcp | Transport::ZenohShm => {
            reading::read(setting, zenoh::ZenohReceiver::open(setting, place));
        }
    }
}
