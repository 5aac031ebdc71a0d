//! `ctl`: one command, one reply.

use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::{BusError, CommandClient, CommandReply, Domain, Refusal, Request};
use serde::Serialize;

use crate::cli::{CtlArgs, Format, Order};
use crate::command::output::{complain, print_json, print_line};

/// How long a server may take to answer: far more than a tick at the lowest rate.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often a seek that is not proved yet is sent again.
const PROOF_PERIOD: Duration = Duration::from_millis(20);

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
    let reply = call(&CommandClient::open(&domain, "ctl")?, request(args.order))?;
    let outcome = reply.outcome();
    let reason = outcome.err().map(|refusal| refusal.to_string());
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

/// Sends a command. A seek that the server's guard has still to prove is sent again until it is.
fn call(client: &CommandClient, request: Request) -> Result<CommandReply, BusError> {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let reply = client.call(request, PATIENCE)?;
        if reply.outcome() != Err(Refusal::NotProved) || Instant::now() >= deadline {
            return Ok(reply);
        }
        thread::sleep(PROOF_PERIOD);
    }
}

fn request(order: Order) -> Request {
    match order {
        Order::Pause => Request::Pause,
        Order::Resume => Request::Resume,
        Order::Speed { speed_mps } => Request::Speed { speed_mps },
        Order::Seek { sim_time_s } => Request::Seek { sim_time_s },
        Order::Hold => Request::Hold,
        Order::Release => Request::Release,
        Order::Stop => Request::Stop,
    }
}
