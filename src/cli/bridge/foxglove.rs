//! `bridge foxglove`: shows the show live in Foxglove and Lichtblick.

use std::net::SocketAddr;
use std::process::ExitCode;

use clap::Args;
use serde::Serialize;

use super::BridgeArgs;
use crate::cli::flags::{Format, listen_address, within};
use crate::cli::print::{print_notice, print_report, print_to_stderr};
use crate::cli::web::{SiteArgs, listen, observe_while, reachable, token};
use crate::display::foxglove::{Foxglove, ViewerEvent, ViewerTotals, viewer_url};
use crate::display::observe::{Observer, Snapshot, SourcePresence};
use crate::output::Counted;
use crate::output::terminal_text::printable;
use crate::system::stop::StopFlag;

/// Show the show live in Foxglove and Lichtblick.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge foxglove                   prints the address to open
  bench-dragon bridge foxglove --steer           commands as services, for viewers with the printed token
  bench-dragon bridge foxglove --listen 0.0.0.0:8765 --rate 60

In Foxglove or Lichtblick choose Open connection, Foxglove WebSocket, and paste the printed address. examples/foxglove-layout.json \
is a layout to import. A program on this machine needs no token to watch. Pages of other sites, such as a viewer in a browser, \
other machines, and commands need the token in the printed address. The token is new at each start, unless the environment variable \
BENCH_DRAGON_TOKEN contains one. The connection is not encrypted.

Channels: poses, /tf, boards, alerts, commands, and the status as numbers to plot. The description of the run is in the parameters. \
A slow viewer gets fewer messages, always the newest. docs/reference/foxglove.md has the details.")]
pub(crate) struct FoxgloveArgs {
    /// Address and port for viewers; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8765", value_parser = listen_address)]
    pub(crate) listen: SocketAddr,
    #[command(flatten)]
    pub(crate) site: SiteArgs,
    /// Frames per second, 1 to 250.
    #[arg(long, value_name = "HZ", default_value_t = 30, allow_negative_numbers = true, value_parser = within(1..=250_u32))]
    pub(crate) rate: u32,
    /// Offer the commands as services, to viewers with the token.
    #[arg(long)]
    pub(crate) steer: bool,
}

/// A line of `bridge foxglove`, beside those about viewers.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum FoxgloveLine {
    /// Viewers can connect.
    Listening {
        url: String,
        address: SocketAddr,
        /// Whether viewers with the token may send commands.
        steer: bool,
    },
    /// Frames arrive.
    Started {
        run_id: u64,
    },
    /// No frame has arrived for too long.
    Silent {
        age_s: f64,
    },
    Resumed,
    /// The run has ended in order.
    Ended,
    /// The bus cannot be read.
    Notice {
        message: String,
    },
    Summary(ViewerTotals),
}

pub(super) fn run(args: &BridgeArgs, foxglove: &FoxgloveArgs) -> anyhow::Result<ExitCode> {
    let format = args.format.format;
    let domain = args.bus.domain()?;
    // A viewer that only watches takes no place of an operator's tool.
    let domain = if foxglove.steer { domain.for_operators() } else { domain };
    let token = token()?;
    let stop = StopFlag::on_signals()?;
    let site = listen(foxglove.listen, &foxglove.site)?.with_foreign_pages();
    let address = site.address;
    let url = viewer_url(SocketAddr::new(reachable(address.ip()), address.port()), &token);
    let bridge =
        Foxglove::open(domain.clone(), token, foxglove.steer, address.ip(), move |event| report(format, &event))?;
    print_report(format, &FoxgloveLine::Listening { url: url.clone(), address, steer: foxglove.steer }, url)?;
    if !address.ip().is_loopback() {
        let steer = if foxglove.steer { ", and steer" } else { "" };
        print_to_stderr(&format!("anyone with this address and token can watch{steer}; nothing is encrypted"));
    }
    let mut source =
        SourceReport { format, instance: domain.instance().to_string(), said: Said::Nothing, run_id: None };
    let observer = Observer::new(domain, "bridge-foxglove", foxglove.rate);
    let show = |snapshot: Snapshot| {
        source.note(&snapshot);
        bridge.show(snapshot);
    };
    let serve = || {
        site.serve(bridge.router(), &stop, bridge.closing())?;
        bridge.close();
        Ok(())
    };
    observe_while(&observer, stop.as_atomic(), show, serve)?;
    let totals = bridge.totals();
    let ViewerTotals { viewers, messages, dropped } = totals;
    let text = format!("{}, {}, {dropped} dropped", Counted(viewers, "viewer"), Counted(messages, "message"));
    print_report(format, &FoxgloveLine::Summary(totals), text)?;
    Ok(ExitCode::SUCCESS)
}

/// Prints an event. If nobody reads stdout any more, viewers are served all the same.
fn report(format: Format, event: &ViewerEvent) {
    let text = match event {
        ViewerEvent::Joined { from, steers, viewers } => {
            let steers = if *steers { ", which may steer" } else { "" };
            format!("a viewer from {from} has joined{steers}; {} now", Counted(*viewers as u64, "viewer"))
        }
        ViewerEvent::Left { from, messages, dropped } => {
            format!("a viewer from {from} has left: {}, {dropped} dropped", Counted(*messages, "message"))
        }
        ViewerEvent::Refused { origin } => format!(
            "refused a viewer of {}: it is a page of another site, and needs the address with the token",
            printable(origin)
        ),
    };
    let _ = print_notice(format, event, &text);
}

/// Reports when frames begin, end and begin again.
struct SourceReport {
    format: Format,
    instance: String,
    said: Said,
    /// The run of the last frame.
    run_id: Option<u64>,
}

/// The last report.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Said {
    Nothing,
    Waiting,
    Live,
    Silent,
    Ended,
    Failed,
}

impl SourceReport {
    fn note(&mut self, snapshot: &Snapshot) {
        let run_id = snapshot.header().map(|header| header.run_id);
        let now = match &snapshot.presence {
            // The observer's first snapshot is empty, and has no instance.
            SourcePresence::Waiting if snapshot.has_source || snapshot.instance.is_empty() => Said::Nothing,
            SourcePresence::Waiting => Said::Waiting,
            SourcePresence::Live => Said::Live,
            SourcePresence::Silent { .. } | SourcePresence::Gone { .. } => Said::Silent,
            SourcePresence::Ended { .. } => Said::Ended,
            SourcePresence::Failed { .. } => Said::Failed,
        };
        let is_same_run = std::mem::replace(&mut self.run_id, run_id) == run_id;
        if std::mem::replace(&mut self.said, now) == now && (is_same_run || now != Said::Live) {
            return;
        }
        // If nobody reads stdout any more, viewers are served all the same.
        let _ = match &snapshot.presence {
            SourcePresence::Waiting if now == Said::Nothing => Ok(()),
            SourcePresence::Waiting => {
                print_to_stderr(&format!("waiting for a server on instance {}", self.instance));
                Ok(())
            }
            SourcePresence::Live if is_same_run => {
                print_notice(self.format, &FoxgloveLine::Resumed, "frames arrive again")
            }
            SourcePresence::Live => {
                let line = FoxgloveLine::Started { run_id: run_id.unwrap_or_default() };
                print_notice(self.format, &line, "frames of a new run arrive; Ctrl-C ends the bridge")
            }
            SourcePresence::Ended { .. } => {
                print_notice(self.format, &FoxgloveLine::Ended, "the run has ended: viewers keep its last frame")
            }
            SourcePresence::Failed { reason } => {
                print_notice(self.format, &FoxgloveLine::Notice { message: reason.clone() }, reason)
            }
            presence => {
                let age_s = presence.age_s().unwrap_or_default();
                let text = format!("no frame for {age_s:.1} s: viewers keep the last one, and their clock stands");
                print_notice(self.format, &FoxgloveLine::Silent { age_s }, &text)
            }
        };
    }
}
