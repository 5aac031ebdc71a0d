//! `ctl`: one command and its reply, or the status of the show.

use std::process::ExitCode;
use std::sync::atomic::Ordering;

use bench_dragon_ipc::{Domain, GuardLock, Refusal, Request, Sender};
use jiff::Zoned;
use serde::Serialize;

use crate::cli::{CtlArgs, CtlCommand, Format};
use crate::command::print::{complain, print_json, print_line};
use crate::command_queue;
use crate::display::observe::{Observer, Snapshot, SourcePresence};
use crate::output::report::StatusReport;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

#[derive(Serialize)]
struct ReplyLine {
    accepted: bool,
    run_id: u64,
    tick: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

pub(crate) fn run(args: &CtlArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let Some(request) = request(args.command) else { return status(domain, args.format.format) };
    let stop = StopFlag::on_signals()?;
    let reply = command_queue::call(&domain, "ctl", Sender::Ctl, request, || stop.is_set())?;
    let outcome = reply.outcome();
    let reason = outcome.err().map(|refusal| match refusal {
        Refusal::NotProved if GuardLock::holder(&domain).is_none() => {
            format!("{}: no guard runs, start `bench-dragon monitor --guard`", refusal.explain(&request))
        }
        _ => refusal.explain(&request),
    });
    match (args.format.format, &reason) {
        (Format::Json, _) => {
            let accepted = reason.is_none();
            print_json(&ReplyLine { accepted, run_id: reply.run_id, tick: reply.tick, reason })?;
        }
        (Format::Text, None) => print_line(format_args!("accepted, from tick {} on", reply.tick))?,
        (Format::Text, Some(reason)) => complain(&format!("refused: {reason}")),
    }
    Ok(if outcome.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The request of a command; none for the status.
fn request(command: CtlCommand) -> Option<Request> {
    Some(match command {
        CtlCommand::Status => return None,
        CtlCommand::Pause => Request::Pause,
        CtlCommand::Resume => Request::Resume,
        CtlCommand::Speed { speed_mps } => Request::Speed { speed_mps },
        CtlCommand::Seek { sim_time_s } => Request::Seek { sim_time_s },
        CtlCommand::Hold => Request::Hold,
        CtlCommand::Release => Request::Release,
        CtlCommand::Stop => Request::Stop,
    })
}

/// Snapshots a second.
const SNAPSHOTS_HZ: u32 = 20;
/// So long the bus is read, in nanoseconds: each reader reports in it, and a monitor that has not is missing.
const LOOK_NS: u64 = 2_050_000_000;
/// So long a bus is waited for, in nanoseconds.
const NO_SERVER_NS: u64 = 500_000_000;
/// The longest that all of it takes, in nanoseconds.
const LONGEST_NS: u64 = 4_000_000_000;

/// Prints the status; the exit status is 0 where all is well, and 1 where a lamp is red or no frames come.
fn status(domain: Domain, format: Format) -> anyhow::Result<ExitCode> {
    let (stop, began_ns) = (StopFlag::on_signals()?, monotonic_ns());
    let mut newest = Snapshot::empty(began_ns);
    Observer::new(domain, "ctl-status", SNAPSHOTS_HZ).run(stop.as_atomic(), |snapshot| {
        if has_seen_enough(&snapshot, began_ns) {
            stop.as_atomic().store(true, Ordering::Relaxed);
        }
        newest = snapshot;
    });
    let report = StatusReport::new(&newest, monotonic_ns(), &Zoned::now());
    match format {
        Format::Json => print_json(&report)?,
        Format::Text => report.lines().into_iter().try_for_each(print_line)?,
    }
    Ok(if report.well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn has_seen_enough(snapshot: &Snapshot, began_ns: u64) -> bool {
    let waited_ns = snapshot.seen_ns.saturating_sub(began_ns);
    let has_nobody = snapshot.presence == SourcePresence::Waiting && !snapshot.has_source && waited_ns >= NO_SERVER_NS;
    let has_read =
        snapshot.reading_since_ns.is_some_and(|since_ns| snapshot.seen_ns.saturating_sub(since_ns) >= LOOK_NS);
    has_nobody || waited_ns >= LONGEST_NS || has_read && snapshot.frame.is_some() && snapshot.status.is_some()
}
