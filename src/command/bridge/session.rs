//! The session of a packet bridge: sends and counts packets, and reports when sending fails and works again.

use std::fmt::Display;
use std::process::ExitCode;

use serde::Serialize;

use super::feed::Release;
use crate::bridge::{Freshness, Outage, OutageChange, Outlet, Packets};
use crate::command::flags::Format;
use crate::command::print::{print_notice, print_report};
use crate::output::Counted;

/// A line that `bridge psn` and `bridge osc` print.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum BridgeLine {
    /// A server is running, and the first frame is sent next.
    Started {
        to: String,
        /// The instant of `CLOCK_MONOTONIC` from which the bridge's own timestamps count.
        epoch_ns: u64,
    },
    /// Sending has begun to fail, or works again.
    Notice {
        message: String,
    },
    /// No frame has arrived for too long: the last one is sent as stale.
    Silent {
        /// Seconds since the server sent that frame.
        age_s: f64,
    },
    Resumed,
    Summary(BridgeSummary),
}

/// Totals of a bridge.
#[derive(Clone, Copy, Default, Serialize)]
struct BridgeSummary {
    /// Frames sent.
    frames: u64,
    /// Frames among these that were stale.
    stale: u64,
    /// Packets passed to the network.
    packets: u64,
    bytes: u64,
    errors: u64,
    /// Frames dropped because the receiver had not accepted the frame before.
    dropped: u64,
    /// Releases that the bridge missed because it was busy.
    missed: u64,
}

pub(super) struct PacketSession {
    format: Format,
    /// The receiver, in words.
    to: String,
    outlet: Box<dyn Outlet>,
    outage: Outage,
    /// Whether the last frame that was sent was stale.
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

    /// Sends packets. Returns whether at least one was sent.
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

    /// Reports the beginning and the end of the server's silence.
    fn note_freshness(&mut self, freshness: Freshness) -> anyhow::Result<()> {
        let was_stale = std::mem::replace(&mut self.is_stale, !freshness.is_fresh());
        match freshness {
            Freshness::Stale { age_ns } if !was_stale => {
                let age_s = age_ns as f64 * 1e-9;
                let text = format!("no frame for {age_s:.1} s: the last one is sent as stale, with all speeds 0");
                print_notice(self.format, &BridgeLine::Silent { age_s }, &text)
            }
            Freshness::Fresh if was_stale => print_notice(self.format, &BridgeLine::Resumed, "frames arrive again"),
            _ => Ok(()),
        }
    }

    /// Reports the totals. `missed` is the number of missed releases.
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
