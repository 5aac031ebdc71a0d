//! What every bridge does with its packets: send, count, and tell where they no longer get through.

use std::fmt::Display;
use std::process::ExitCode;

use serde::Serialize;

use super::feed::Release;
use crate::bridge::{Freshness, Outage, OutageChange, Outlet, Packets};
use crate::command::flags::Format;
use crate::command::print::{print_notice, print_report};
use crate::output::Counted;

/// A line of `bridge psn` and `bridge osc`.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum BridgeLine {
    /// There is a server, and the first frame is about to be sent.
    Started {
        to: String,
        /// The instant of `CLOCK_MONOTONIC` from which the bridge's own timestamps count.
        epoch_ns: u64,
    },
    /// Sending has begun to fail, or works again.
    Notice {
        message: String,
    },
    /// No frame has come for too long: the last one is sent as stale.
    Silent {
        /// How long ago it was sent by the server.
        age_s: f64,
    },
    Resumed,
    Summary(BridgeSummary),
}

/// What a bridge sent.
#[derive(Clone, Copy, Default, Serialize)]
struct BridgeSummary {
    frames: u64,
    /// Those of them that told a frame of the bus again which was too old to be believed.
    stale: u64,
    /// Packets handed over to the network.
    packets: u64,
    bytes: u64,
    errors: u64,
    /// Frames left out because the receiver had not taken the one before.
    dropped: u64,
    /// Releases that passed while the bridge was busy.
    missed: u64,
}

pub(super) struct PacketSession {
    format: Format,
    /// The receiver, as it is told.
    to: String,
    outlet: Box<dyn Outlet>,
    outage: Outage,
    /// Whether the frame that was sent last was too old to be believed.
    is_stale: bool,
    summary: BridgeSummary,
}

impl PacketSession {
    pub(super) fn new(format: Format, to: impl Display, outlet: Box<dyn Outlet>) -> Self {
        let (outage, summary) = (Outage::default(), BridgeSummary::default());
        Self { format, to: to.to_string(), outlet, outage, is_stale: false, summary }
    }

    pub(super) fn announce(&self, epoch_ns: u64, rate_hz: u32) -> anyhow::Result<()> {
        let to = &self.to;
        let line = BridgeLine::Started { to: to.clone(), epoch_ns };
        print_notice(self.format, &line, &format!("sending to {to} at {rate_hz} Hz; Ctrl-C ends it"))
    }

    pub(super) fn send_frame(&mut self, packets: &Packets, release: &Release<'_>) -> anyhow::Result<()> {
        self.note_freshness(release.latest.freshness)?;
        let is_sent = self.send(packets, release.now_ns)?;
        self.summary.frames += u64::from(is_sent);
        self.summary.stale += u64::from(is_sent && !release.latest.freshness.is_fresh());
        Ok(())
    }

    /// Sends packets. Returns whether any of them has left.
    pub(super) fn send(&mut self, packets: &Packets, now_ns: u64) -> anyhow::Result<bool> {
        let delivery = self.outlet.send(packets, now_ns);
        self.summary.packets += delivery.packets;
        self.summary.bytes += delivery.bytes;
        self.summary.errors += delivery.errors;
        self.summary.dropped += u64::from(delivery.dropped);
        let to = &self.to;
        match (self.outage.note(delivery.trouble.is_some(), now_ns), delivery.trouble) {
            (Some(OutageChange::Began), Some(error)) => {
                self.notify(&format!("cannot send to {to}, still trying: {error}"))?;
            }
            (Some(OutageChange::Ended { failed_frames }), _) => {
                self.notify(&format!(
                    "sending to {to} works again, after {} with errors",
                    Counted(failed_frames, "frame")
                ))?;
            }
            _ => {}
        }
        Ok(delivery.packets > 0)
    }

    /// Tells when the server falls silent, and when it is back.
    fn note_freshness(&mut self, freshness: Freshness) -> anyhow::Result<()> {
        let was_stale = std::mem::replace(&mut self.is_stale, !freshness.is_fresh());
        match freshness {
            Freshness::Stale { age_ns } if !was_stale => {
                let age_s = age_ns as f64 * 1e-9;
                let text =
                    format!("no frame has come for {age_s:.1} s: the last one is sent as stale, with speeds of 0");
                print_notice(self.format, &BridgeLine::Silent { age_s }, &text)
            }
            Freshness::Fresh if was_stale => print_notice(self.format, &BridgeLine::Resumed, "frames come again"),
            _ => Ok(()),
        }
    }

    /// Tells what was sent. `missed` are the releases that passed meanwhile.
    pub(super) fn finish(mut self, missed: u64) -> anyhow::Result<ExitCode> {
        self.summary.missed = missed;
        let BridgeSummary { frames, stale, packets, bytes, errors, dropped, missed } = self.summary;
        let text = format!(
            "{} ({stale} stale) in {} of {}, {}, {dropped} dropped, {} missed",
            Counted(frames, "frame"),
            Counted(packets, "packet"),
            Counted(bytes, "byte"),
            Counted(errors, "error"),
            Counted(missed, "release")
        );
        print_report(self.format, &BridgeLine::Summary(self.summary), text)?;
        Ok(ExitCode::SUCCESS)
    }

    fn notify(&self, message: &str) -> anyhow::Result<()> {
        print_notice(self.format, &BridgeLine::Notice { message: message.to_owned() }, message)
    }
}
