//! The channels of one file: a number for each kind of message.

use std::io::{Seek, Write};

use mcap::{McapResult, Writer};

use super::schema::{ALERT_TOPIC, COMMAND_TOPIC, FRAME_TOPIC, POSE_TOPIC};

/// What a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Frame,
    Poses,
    Alert,
    Command,
}

/// The numbers that a file has given to the kinds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channels {
    frames: u16,
    poses: u16,
    alerts: u16,
    commands: u16,
}

impl Channels {
    /// Declares all channels in a file.
    pub(super) fn declare<W: Write + Seek>(writer: &mut Writer<W>) -> McapResult<Self> {
        Ok(Self {
            frames: FRAME_TOPIC.declare(writer)?,
            poses: POSE_TOPIC.declare(writer)?,
            alerts: ALERT_TOPIC.declare(writer)?,
            // Behind those of earlier versions, whose numbers stay.
            commands: COMMAND_TOPIC.declare(writer)?,
        })
    }

    /// The channel of a kind.
    pub(super) fn of(self, kind: Kind) -> u16 {
        match kind {
            Kind::Frame => self.frames,
            Kind::Poses => self.poses,
            Kind::Alert => self.alerts,
            Kind::Command => self.commands,
        }
    }
}
