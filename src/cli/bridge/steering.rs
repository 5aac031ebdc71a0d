//! Steering by `bridge osc`: its flags, and what it prints.

use std::env::{self, VarError};
use std::net::SocketAddr;
use std::sync::Arc;

use bench_dragon_ipc::Domain;
use clap::Args;
use serde::Serialize;

use crate::bridge::LatestFrame;
use crate::bridge::osc_steering::{
    AllowedNetworks, Network, Refused, Secret, SecretError, SteeringCounts, SteeringEvent, SteeringListener,
    SteeringSettings,
};
use crate::cli::flags::{BadInput, Format, listen_address, within};
use crate::cli::print::{print_notice, print_report};
use crate::cli::web::cannot_listen;
use crate::config::{PlannedCue, PlannedCues};
use crate::output::Counted;

/// Environment variable with the secret. Other users of the machine see the flags of a process, but not its environment.
const SECRET_VARIABLE: &str = "BENCH_DRAGON_OSC_SECRET";

/// Flags for commands by Open Sound Control.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Steering")]
pub(crate) struct SteeringArgs {
    /// Accept commands at this address and port, from the addresses of --allow only.
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = listen_address, requires = "allow")]
    pub(crate) listen: Option<SocketAddr>,
    /// Addresses and networks from which commands are accepted, such as 10.0.0.7,10.0.1.0/24,::1. This machine has to be listed,
    /// too.
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "listen")]
    pub(crate) allow: Vec<Network>,
    /// First argument that each message must have, 8 to 64 letters, digits, - and _. The environment variable
    /// BENCH_DRAGON_OSC_SECRET may contain it instead.
    #[arg(long, value_name = "TEXT", requires = "listen")]
    pub(crate) secret: Option<Secret>,
    /// Also accept release, seek, cue and stop.
    #[arg(long, requires = "listen")]
    pub(crate) full: bool,
    /// Port of the sender's machine that gets replies and the state [default: the port that it sends from].
    #[arg(long, value_name = "PORT", requires = "listen", allow_negative_numbers = true, value_parser = within(1..=65_535_u16))]
    pub(crate) reply_port: Option<u16>,
    /// Further address and port that gets the state; may be repeated.
    #[arg(long, value_name = "ADDRESS:PORT", requires = "listen", value_parser = listen_address)]
    pub(crate) state_to: Vec<SocketAddr>,
}

/// A line about steering.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum SteeringLine<'a> {
    Listening {
        listen: SocketAddr,
        allow: Vec<String>,
        /// Whether messages need a secret.
        secret: bool,
        full: bool,
    },
    Answered {
        from: SocketAddr,
        command: &'a str,
        accepted: bool,
        /// The tick from which the command holds; null if it was refused.
        tick: Option<u64>,
        reason: Option<&'a str>,
    },
    Refused {
        from: String,
        why: Refused,
        /// Messages since the last such line.
        messages: u64,
    },
    Steered(SteeringCounts),
}

/// A listener, with the format of its lines.
pub(super) struct Steering {
    format: Format,
    listener: SteeringListener,
}

impl SteeringArgs {
    /// Starts to listen, if there is `--listen`.
    pub(super) fn start(&self, domain: Domain, format: Format) -> anyhow::Result<Option<Steering>> {
        let Some(listen) = self.listen else { return Ok(None) };
        let secret = self.secret()?;
        let has_secret = secret.is_some();
        let settings = SteeringSettings {
            listen,
            allowed: AllowedNetworks(self.allow.clone()),
            secret,
            is_full: self.full,
            reply_port: self.reply_port,
            state_to: self.state_to.clone(),
        };
        let started = SteeringListener::start(settings, domain, move |event| report(format, &event));
        let listener = started.map_err(|error| cannot_listen(listen, &error))?;
        let line = SteeringLine::Listening {
            listen: listener.listen,
            allow: self.allow.iter().map(Network::to_string).collect(),
            secret: has_secret,
            full: self.full,
        };
        let all = if self.full { "all commands" } else { "commands but release, seek, cue and stop" };
        let key = if has_secret { ", with the secret" } else { "" };
        let allowed = AllowedNetworks(self.allow.clone());
        let text = format!("Open Sound Control on UDP {}: {all} from {allowed}{key}", listener.listen);
        print_notice(format, &line, &text)?;
        Ok(Some(Steering { format, listener }))
    }

    fn secret(&self) -> Result<Option<Secret>, BadInput> {
        let bad = |error: SecretError| BadInput(format!("the environment's {SECRET_VARIABLE} {error}"));
        match env::var(SECRET_VARIABLE) {
            _ if self.secret.is_some() => Ok(self.secret.clone()),
            Ok(text) => text.parse().map(Some).map_err(bad),
            Err(VarError::NotUnicode(_)) => Err(bad(SecretError)),
            Err(VarError::NotPresent) => Ok(None),
        }
    }
}

impl Steering {
    /// Takes the state of the show from the newest frame, and the cues that it has just reached.
    pub(super) fn note(&self, latest: &LatestFrame, planned: &Arc<PlannedCues>, reached: &[PlannedCue]) {
        self.listener.note(latest, planned, reached);
    }

    /// Stops listening, and reports the totals.
    pub(super) fn finish(self) -> anyhow::Result<()> {
        let counts = self.listener.finish();
        let SteeringCounts { accepted, refused, replaced, strangers, malformed, floods } = counts;
        let text = format!(
            "{accepted} accepted, {refused} refused, {replaced} replaced by newer values; {} of strangers, {}, {}",
            Counted(strangers, "message"),
            Counted(malformed, "malformed packet"),
            Counted(floods, "flood")
        );
        print_report(self.format, &SteeringLine::Steered(counts), text)
    }
}

/// Prints an event. If nobody reads stdout any more, desks steer all the same.
fn report(format: Format, event: &SteeringEvent) {
    let _ = match event {
        SteeringEvent::Answered { from, command, outcome } => {
            let (tick, reason) = (outcome.as_ref().ok().copied(), outcome.as_ref().err().map(String::as_str));
            let line = SteeringLine::Answered { from: *from, command, accepted: tick.is_some(), tick, reason };
            let text = match outcome {
                Ok(tick) => format!("{command} from {from}: accepted from tick {tick} on"),
                Err(reason) => format!("{command} from {from}: refused: {reason}"),
            };
            print_notice(format, &line, &text)
        }
        SteeringEvent::Refused { from, why, messages } => {
            let line = SteeringLine::Refused { from: from.to_string(), why: *why, messages: *messages };
            let text = format!("refused {}, the last one from {from}: {why}", Counted(*messages, "message"));
            print_notice(format, &line, &text)
        }
    };
}
