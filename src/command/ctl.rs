//! `ctl`: one command, one reply.

use std::process::ExitCode;

use bench_dragon_ipc::{Domain, GuardLock, Refusal, Request, Sender};
use serde::Serialize;

use crate::cli::{CtlArgs, Format, Order};
use crate::command::ctl_status;
use crate::command::output::{complain, print_json, print_line};
use crate::command_queue;
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
    let Some(request) = request(args.order) else { return ctl_status::run(domain, args.format.format) };
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

/// The command behind an order; none for the status.
fn request(order: Order) -> Option<Request> {
    Some(match order {
        Order::Status => return None,
        Order::Pause => Request::Pause,
        Order::Resume => Request::Resume,
        Order::Speed { speed_mps } => Request::Speed { speed_mps },
        Order::Seek { sim_time_s } => Request::Seek { sim_time_s },
        Order::Hold => Request::Hold,
        Order::Release => Request::Release,
        Order::Stop => Request::Stop,
    })
}
