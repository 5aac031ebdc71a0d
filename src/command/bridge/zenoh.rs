//! `bridge zenoh`: the bus here over the network, and onto a bus there.

use std::process::ExitCode;

use bench_dragon_ipc::Domain;

use crate::bridge::zenoh::{
    BridgeSession, KeyPrefix, ReceiverSummary, ReceivingBridge, SenderPorts, SenderSettings, SenderSummary,
    SendingBridge, SessionSettings, Share, Side, Silence, ZenohReport,
};
use crate::cli::{BadInput, BridgeArgs, Format, ZenohArgs};
use crate::command::follow::open_when_there;
use crate::command::print::{complain, percentiles, print_json, print_line};
use crate::output::Counted;
use crate::system::stop::StopFlag;

pub(super) fn run(args: &BridgeArgs, zenoh: &ZenohArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let prefix = zenoh.key.clone().unwrap_or_else(|| KeyPrefix::of(&args.bus.instance));
    let side = if zenoh.receive { Side::Receiving } else { Side::Sending };
    let format = args.format.format;
    if let Some(session) = open(zenoh, side, &stop)? {
        let key = prefix.to_string();
        tell(
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
    BridgeSession::open(&settings, side, stop.as_atomic(), tell_waiting)
        .map_err(|error| if error.is_bad_input() { BadInput(error.to_string()).into() } else { error.into() })
}

fn tell_waiting(connects: &[String]) {
    complain(&format!("waiting for somebody at {}", listed(connects)));
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
    let settings = SenderSettings { prefix, share, allows_commands: zenoh.allow_commands };
    let ports = open_when_there(domain.instance(), stop, || SenderPorts::open(domain))?;
    let mut summary = SenderSummary::default();
    if let Some(ports) = ports {
        let sender = SendingBridge::open(domain, session, ports, settings)?;
        summary = sender.run(stop.as_atomic(), |line| tell(format, &line))?;
    }
    tell(format, &ZenohReport::Sent(summary))
}

fn receive(
    domain: &Domain,
    session: BridgeSession,
    prefix: KeyPrefix,
    format: Format,
    stop: &StopFlag,
) -> anyhow::Result<()> {
    let receiver = ReceivingBridge::open(domain, session, prefix)?;
    let summary = receiver.run(stop.as_atomic(), |line| tell(format, &line))?;
    tell(format, &ZenohReport::Received(summary))
}

fn tell(format: Format, line: &ZenohReport) -> anyhow::Result<()> {
    if format == Format::Json {
        return print_json(line);
    }
    match line {
        ZenohReport::Started { key, listens, connects } => {
            let ways = [("listening on", listens), ("connecting to", connects)];
            let ways = ways.map(|(way, endpoints)| format!(", {way} {}", listed(endpoints))).concat();
            complain(&format!("{key}{ways}; Ctrl-C ends it"));
        }
        ZenohReport::Sending { run_id, every: 1 } => complain(&format!("sending run {run_id}, every frame")),
        ZenohReport::Sending { run_id, every } => complain(&format!("sending run {run_id}, one frame of {every}")),
        ZenohReport::Found { remote_run_id, .. } => complain(&format!("found run {remote_run_id}")),
        ZenohReport::Receiving { run_id, remote_run_id } => {
            complain(&format!("receiving run {remote_run_id}, here run {run_id}"));
        }
        ZenohReport::Refused { remote_run_id, reason } => {
            complain(&format!("run {remote_run_id} is not received: {reason}"));
        }
        ZenohReport::Alone { connects } => {
            let trying = format!(", still trying {}; RUST_LOG=zenoh=debug tells why", listed(connects));
            complain(&format!("nobody is connected{}", if connects.is_empty() { "" } else { &trying }));
        }
        ZenohReport::Connected { unheard } => {
            complain(&format!("somebody is connected; {} reached nobody", Counted(*unheard, "frame")));
        }
        ZenohReport::Silent { reason: Silence::LinkOrSource, .. } => {
            complain("no frames come, though a source is there: the link is cut, or the source stands");
        }
        ZenohReport::Silent { reason: Silence::NoSource, run_id: None } => {
            complain("no frames come: no source is there; both sides need the same --instance or --key");
        }
        ZenohReport::Silent { reason: Silence::NoSource, run_id: Some(_) } => {
            complain("no frames come: no source is there");
        }
        ZenohReport::Silent { reason: Silence::NoConnection, .. } => {
            complain("no frames come: nobody is connected, still trying; RUST_LOG=zenoh=debug tells why");
        }
        ZenohReport::Resumed { lost, .. } => complain(&format!("frames come again, {lost} have been lost on the way")),
        ZenohReport::Sent(summary) => print_line(sent(summary))?,
        ZenohReport::Received(summary) => print_line(received(summary))?,
    }
    Ok(())
}

fn listed(endpoints: &[String]) -> String {
    if endpoints.is_empty() { "nothing".to_owned() } else { endpoints.join(" ") }
}

fn sent(summary: &SenderSummary) -> String {
    let SenderSummary { frames, unheard, lost, alerts, commands, refused } = summary;
    format!(
        "{} sent, {unheard} with nobody connected, {lost} of the bus lost, {}, {} passed on, {refused} refused",
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
        "{} of {}, {lost} lost on the way ({dropped} of them here), {}, {} passed on; refused {refused}: \
         {malformed} malformed, {foreign} of other runs, {not_new} come already, {too_fast} too many at a time; handled in \
         {} \u{b5}s",
        Counted(*frames, "frame"),
        Counted(*runs, "run"),
        Counted(*alerts, "alert"),
        Counted(*commands, "command"),
        percentiles(*handling_us)
    )
}
