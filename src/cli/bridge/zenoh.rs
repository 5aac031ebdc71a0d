//! `bridge zenoh`: sends this machine's bus over the network, or receives another machine's bus.

use std::process::ExitCode;

use bench_dragon_ipc::Domain;
use clap::Args;

use super::BridgeArgs;
use crate::bridge::zenoh::{
    BridgeError, BridgeSession, KeyPrefix, ReceiverSummary, ReceivingBridge, SenderPorts, SenderSettings,
    SenderSummary, SendingBridge, SessionMode, SessionSettings, Share, Side, Silence, ZenohReport, check_endpoint,
    wire::MAX_EVERY,
};
use crate::cli::bus_readers::open_when_there;
use crate::cli::flags::{BadInput, Format, SpinArgs, within};
use crate::cli::print::{percentiles, print_notice, print_report, print_to_stderr};
use crate::config::RATE_HZ;
use crate::output::Counted;
use crate::system::stop::StopFlag;

#[cfg(feature = "zenoh")]
/// Copy the bus to another machine by zenoh; every client works there unchanged.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge zenoh --listen tcp/10.0.0.5:7447             on the server's machine
  bench-dragon bridge zenoh --receive --connect tcp/10.0.0.5:7447  on the other one
  bench-dragon bridge zenoh --config tls.json5 --rate 60 --allow-commands

The bridge listens and connects only as the flags and the configuration specify. Without any endpoint a sending bridge listens \
on tcp/127.0.0.1:7447, and a receiving bridge connects there.")]
pub(crate) struct ZenohArgs {
    /// Receive another machine's frames and publish them on this instance's bus, instead of sending this bus.
    #[arg(long, conflicts_with = "spin_us")]
    pub(crate) receive: bool,
    /// zenoh's own configuration file, JSON5, with TLS, passwords or timeouts; everything that it does not mention stays off.
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    pub(crate) config: Option<std::path::PathBuf>,
    /// Connect to this endpoint; may be repeated.
    #[arg(long, value_name = "ENDPOINT", value_parser = check_endpoint)]
    pub(crate) connect: Vec<String>,
    /// Listen on this endpoint; may be repeated. Only this machine can reach a loopback endpoint.
    #[arg(long, value_name = "ENDPOINT", value_parser = check_endpoint)]
    pub(crate) listen: Vec<String>,
    /// Role of this bridge in the zenoh network [default: configured, else peer].
    #[arg(long, value_enum)]
    pub(crate) mode: Option<SessionMode>,
    /// Prefix of all keys [default: bench-dragon/ and the instance].
    #[arg(long, value_name = "PREFIX")]
    pub(crate) key: Option<KeyPrefix>,
    /// Send one frame of every N frames [default: 1].
    #[arg(long, value_name = "N", conflicts_with_all = ["rate", "receive"], allow_negative_numbers = true, value_parser = within(1..=MAX_EVERY))]
    pub(crate) every: Option<u64>,
    /// Most frames to send per second, 1 to 100000 [default: all].
    #[arg(long, value_name = "HZ", conflicts_with = "receive", allow_negative_numbers = true, value_parser = within(RATE_HZ))]
    pub(crate) rate: Option<u32>,
    /// Accept commands to the server (pause, seek, stop and all others) from anyone who can reach this bridge.
    #[arg(long, conflicts_with = "receive")]
    pub(crate) allow_commands: bool,
    #[command(flatten)]
    pub(crate) clock: SpinArgs,
}

pub(super) fn run(args: &BridgeArgs, zenoh: &ZenohArgs) -> anyhow::Result<ExitCode> {
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let prefix = zenoh.key.clone().unwrap_or_else(|| KeyPrefix::of(&args.bus.instance));
    let side = if zenoh.receive { Side::Receiving } else { Side::Sending };
    let format = args.format.format;
    if let Some(session) = open(zenoh, side, &stop)? {
        let key = prefix.to_string();
        report(
            format,
            &ZenohReport::Started { key, listens: session.listens.clone(), connects: session.connects.clone() },
        )?;
        match side {
            Side::Sending => send(&domain, session, prefix, zenoh, format, &stop)?,
            Side::Receiving => receive(&domain, session, prefix, format, &stop)?,
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn open(zenoh: &ZenohArgs, side: Side, stop: &StopFlag) -> anyhow::Result<Option<BridgeSession>> {
    let settings = SessionSettings {
        config: zenoh.config.clone(),
        mode: zenoh.mode,
        connect: zenoh.connect.clone(),
        listen: zenoh.listen.clone(),
    };
    BridgeSession::open(&settings, side, stop.as_atomic(), report_waiting)
        .map_err(|error| if let BridgeError::Settings(why) = error { BadInput(why).into() } else { error.into() })
}

fn report_waiting(connects: &[String]) {
    print_to_stderr(&format!("waiting for a peer at {}", listed(connects)));
}

fn send(
    domain: &Domain,
    session: BridgeSession,
    prefix: KeyPrefix,
    zenoh: &ZenohArgs,
    format: Format,
    stop: &StopFlag,
) -> anyhow::Result<()> {
    let share = zenoh.rate.map_or(Share::OneOf(zenoh.every.unwrap_or(1)), Share::RateHz);
    let settings = SenderSettings { prefix, share, allows_commands: zenoh.allow_commands, spin: zenoh.clock.spin() };
    let ports = open_when_there(domain.instance(), stop, || SenderPorts::open(domain))?;
    let mut summary = SenderSummary::default();
    if let Some(ports) = ports {
        let sender = SendingBridge::open(domain, session, ports, settings)?;
        summary = sender.run(stop.as_atomic(), |line| report(format, &line))?;
    }
    report(format, &ZenohReport::Sent(summary))
}

fn receive(
    domain: &Domain,
    session: BridgeSession,
    prefix: KeyPrefix,
    format: Format,
    stop: &StopFlag,
) -> anyhow::Result<()> {
    let receiver = ReceivingBridge::open(domain, session, prefix)?;
    let summary = receiver.run(stop.as_atomic(), |line| report(format, &line))?;
    report(format, &ZenohReport::Received(summary))
}

fn report(format: Format, line: &ZenohReport) -> anyhow::Result<()> {
    match line {
        ZenohReport::Sent(_) | ZenohReport::Received(_) => print_report(format, line, text(line)),
        _ => print_notice(format, line, &text(line)),
    }
}

/// A line in words.
fn text(line: &ZenohReport) -> String {
    match line {
        ZenohReport::Started { key, listens, connects } => {
            let ways = [("listening on", listens), ("connecting to", connects)];
            let ways = ways.map(|(way, endpoints)| format!(", {way} {}", listed(endpoints))).concat();
            format!("{key}{ways}; Ctrl-C ends it")
        }
        ZenohReport::Sending { run_id, every: 1 } => format!("sending run {run_id}, every frame"),
        ZenohReport::Sending { run_id, every } => format!("sending run {run_id}, one frame of {every}"),
        ZenohReport::Found { remote_run_id, .. } => format!("found run {remote_run_id}"),
        ZenohReport::Receiving { run_id, remote_run_id } => format!("receiving run {remote_run_id}, here run {run_id}"),
        ZenohReport::Refused { remote_run_id, reason } => format!("run {remote_run_id} is not received: {reason}"),
        ZenohReport::Alone { connects } if connects.is_empty() => "no peer is connected".to_owned(),
        ZenohReport::Alone { connects } => {
            let tried = listed(connects);
            format!("no peer is connected, still trying {tried}; RUST_LOG=zenoh=debug logs the reason")
        }
        ZenohReport::Connected { unheard } => {
            format!("a peer is connected; {} reached no peer", Counted(*unheard, "frame"))
        }
        ZenohReport::Silent { reason: Silence::LinkOrSource, .. } => {
            "no frames arrive, although a source exists: the link is cut, or the source has stopped".to_owned()
        }
        ZenohReport::Silent { reason: Silence::NoSource, run_id: None } => {
            "no frames arrive: there is no source; both sides need the same --instance or --key".to_owned()
        }
        ZenohReport::Silent { reason: Silence::NoSource, run_id: Some(_) } => {
            "no frames arrive: there is no source".to_owned()
        }
        ZenohReport::Silent { reason: Silence::NoConnection, .. } => {
            "no frames arrive: no peer is connected, still trying; RUST_LOG=zenoh=debug logs the reason".to_owned()
        }
        ZenohReport::Resumed { lost, .. } => format!("frames arrive again, {lost} were lost in transit"),
        ZenohReport::Sent(summary) => sent(summary),
        ZenohReport::Received(summary) => received(summary),
    }
}

fn listed(endpoints: &[String]) -> String {
    if endpoints.is_empty() { "nothing".to_owned() } else { endpoints.join(" ") }
}

fn sent(summary: &SenderSummary) -> String {
    let SenderSummary { frames, unheard, lost, alerts, commands, refused } = summary;
    format!(
        "{} sent, {unheard} without a connected peer, {lost} lost on the bus, {}, {} passed on, {refused} refused",
        Counted(*frames, "frame"),
        Counted(*alerts, "alert"),
        Counted(*commands, "command")
    )
}

fn received(summary: &ReceiverSummary) -> String {
    let ReceiverSummary { runs, frames, lost, dropped, malformed, foreign, not_new, too_fast, .. } = summary;
    let ReceiverSummary { alerts, commands, handling_us, .. } = summary;
    let refused = malformed + foreign + not_new + too_fast;
    format!(
        "{} of {}, {lost} lost in transit ({dropped} of them dropped here), {}, {} passed on; refused {refused}: \
         {malformed} malformed, {foreign} of other runs, {not_new} not new, {too_fast} too fast; handled in \
         {} \u{b5}s",
        Counted(*frames, "frame"),
        Counted(*runs, "run"),
        Counted(*alerts, "alert"),
        Counted(*commands, "command"),
        percentiles(*handling_us)
    )
}
