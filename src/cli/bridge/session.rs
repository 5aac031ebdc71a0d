//! The session of a packet bridge: sends and counts packets, and reports when sending fails and works again.

use std::fmt::Display;
use std::ops::Range;
use std::process::ExitCode;

use serde::Serialize;

use super::feed::DueFrame;
use crate::bridge::{BenchSelection, Freshness, Outage, OutageChange, Outlet, Packets};
use crate::cli::flags::Format;
use crate::cli::print::{print_notice, print_report, print_to_stderr};
use crate::config::NamedLayout;
use crate::output::Counted;
use crate::system::clock::monotonic_ns;

/// A line that `bridge psn`, `bridge osc` and `bridge timecode` print.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum BridgeLine {
    /// A server is running, and the first frame is sent next.
    Started {
        to: String,
        /// The instant of `CLOCK_MONOTONIC` from which the bridge's own timestamps count.
        epoch_ns: u64,
        /// All that an operator enters at the receiver.
        settings: String,
    },
    /// The dragons have other names or another number of benches than before.
    Changed {
        settings: String,
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
    /// Periods that the bridge missed because it was busy.
    missed: u64,
}

pub(super) struct PacketSession {
    format: Format,
    /// The receiver, in words.
    to: String,
    /// Frames per second, in words.
    rate: String,
    epoch_ns: u64,
    /// What happens while the server is silent, in words.
    when_silent: &'static str,
    is_announced: bool,
    outlet: Box<dyn Outlet>,
    /// Number of benches of the last frame, and the names of its dragons; `None` before the first frame.
    dragons: Option<(usize, NamedLayout)>,
    outage: Outage,
    /// Whether the last frame that was sent was stale.
    is_stale: bool,
    summary: BridgeSummary,
}

impl PacketSession {
    pub(super) fn new(format: Format, to: impl Display, rate: impl Display, outlet: Box<dyn Outlet>) -> Self {
        Self {
            format,
            to: to.to_string(),
            rate: rate.to_string(),
            epoch_ns: monotonic_ns(),
            when_silent: "the last one is sent as stale, with all speeds 0",
            is_announced: false,
            outlet,
            dragons: None,
            outage: Outage::default(),
            is_stale: false,
            summary: BridgeSummary::default(),
        }
    }

    /// Describes what happens while the server is silent.
    pub(super) fn when_silent(self, when_silent: &'static str) -> Self {
        Self { when_silent, ..self }
    }

    /// Start of the bridge, in nanoseconds of `CLOCK_MONOTONIC`.
    pub(super) fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// Whether a frame is the first one, or the first one of other dragons than before.
    pub(super) fn are_other(&self, benches: usize, dragons: &NamedLayout) -> bool {
        self.dragons.as_ref().is_none_or(|(known, names)| *known != benches || names != dragons)
    }

    /// Announces the receiver's settings at the first frame, and at the first frame of other dragons. Reports chosen benches that
    /// these do not have.
    pub(super) fn note_dragons(
        &mut self,
        benches: usize,
        dragons: &NamedLayout,
        chosen: &BenchSelection,
        settings: impl FnOnce() -> anyhow::Result<String>,
    ) -> anyhow::Result<()> {
        if !self.are_other(benches, dragons) {
            return Ok(());
        }
        let settings = settings()?;
        match self.dragons.replace((benches, dragons.clone())) {
            None => self.announce(settings)?,
            Some(_) => print_notice(self.format, &BridgeLine::Changed { settings: settings.clone() }, &settings)?,
        }
        match missing(chosen, benches, dragons) {
            Some(message) => self.notify(&message),
            None => Ok(()),
        }
    }

    /// Announces the receiver's settings at the first call.
    pub(super) fn announce_once(&mut self, settings: impl FnOnce() -> String) -> anyhow::Result<()> {
        if std::mem::replace(&mut self.is_announced, true) { Ok(()) } else { self.announce(settings()) }
    }

    fn announce(&self, settings: String) -> anyhow::Result<()> {
        let Self { format, to, rate, epoch_ns, .. } = self;
        if *format == Format::Text {
            print_to_stderr(&settings);
        }
        let started = BridgeLine::Started { to: to.clone(), epoch_ns: *epoch_ns, settings };
        print_notice(*format, &started, &format!("sending to {to} at {rate} Hz; Ctrl-C ends it"))
    }

    pub(super) fn send_frame(&mut self, packets: &Packets, due: &DueFrame<'_>) -> anyhow::Result<()> {
        self.send_at(packets, due.now_ns, (!due.is_last).then_some(due.latest.freshness))
    }

    /// Sends the packets of a frame. `freshness`: that of the frame of the bus; none for a farewell.
    pub(super) fn send_at(
        &mut self,
        packets: &Packets,
        now_ns: u64,
        freshness: Option<Freshness>,
    ) -> anyhow::Result<()> {
        if let Some(freshness) = freshness {
            self.note_freshness(freshness)?;
        }
        let is_sent = self.send(packets, now_ns)?;
        self.summary.frames += u64::from(is_sent);
        self.summary.stale += u64::from(is_sent && freshness.is_some_and(|freshness| !freshness.is_fresh()));
        Ok(())
    }

    /// Sends packets. Returns whether at least one was sent.
    pub(super) fn send(&mut self, packets: &Packets, now_ns: u64) -> anyhow::Result<bool> {
        let delivery = self.outlet.send(packets, now_ns);
        self.summary.packets += delivery.packets;
        self.summary.bytes += delivery.bytes;
        self.summary.errors += delivery.errors;
        self.summary.dropped += u64::from(delivery.is_dropped);
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
                let text = format!("no frame for {age_s:.1} s: {}", self.when_silent);
                print_notice(self.format, &BridgeLine::Silent { age_s }, &text)
            }
            Freshness::Fresh if was_stale => print_notice(self.format, &BridgeLine::Resumed, "frames arrive again"),
            _ => Ok(()),
        }
    }

    /// Reports the totals. `missed` is the number of missed periods.
    pub(super) fn finish(mut self, missed: u64) -> anyhow::Result<ExitCode> {
        self.summary.missed = missed;
        let BridgeSummary { frames, stale, packets, bytes, errors, dropped, missed } = self.summary;
        let text = format!(
            "{} ({stale} stale) in {} of {}, {}, {dropped} dropped, {} missed",
            Counted(frames, "frame"),
            Counted(packets, "packet"),
            Counted(bytes, "byte"),
            Counted(errors, "error"),
            Counted(missed, "period")
        );
        print_report(self.format, &BridgeLine::Summary(self.summary), text)?;
        Ok(ExitCode::SUCCESS)
    }

    fn notify(&self, message: &str) -> anyhow::Result<()> {
        print_notice(self.format, &BridgeLine::Notice { message: message.to_owned() }, message)
    }
}

/// Describes the chosen benches that these dragons, of `benches` benches in all, do not have.
fn missing(chosen: &BenchSelection, benches: usize, dragons: &NamedLayout) -> Option<String> {
    let missing = chosen.missing_of(dragons, benches)?;
    let last = |range: &Range<usize>| range.len().saturating_sub(1);
    let last_of = |(name, benches): (&str, Range<usize>)| format!("the last bench of {name} is {}", last(&benches));
    let lasts = if dragons.are_named() {
        dragons.dragons().map(last_of).collect::<Vec<_>>().join(", ")
    } else {
        format!("the dragon's last bench is {}", last(&(0..benches)))
    };
    let message = if chosen.of(dragons).count(benches) == 0 {
        format!("no bench is sent: --benches is {chosen}, {lasts}")
    } else {
        format!("benches {missing} are not sent: {lasts}")
    };
    Some(message)
}
