//! One command to the server of an instance, and its reply.

use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::{BusError, CommandClient, CommandReply, Domain, GuardLock, Refusal, Request, Sender};

/// How long a server may take to answer: far more than a tick at the lowest rate.
const PATIENCE: Duration = Duration::from_secs(5);
/// The longest that a hold may take at a desk, where it is sent twice: a little more than that.
pub const HOLD_PATIENCE: Duration = Duration::from_secs(12);
/// How often a seek that is not proved yet is sent again.
const PROOF_PERIOD: Duration = Duration::from_millis(20);

/// Sends a command, under this node name and as this kind of sender, and waits for its reply. A seek that the server's guard has still to prove is sent
/// again until it is, or until it is given up; then it is refused. Where no guard runs, which could prove it, it is refused
/// at once.
///
/// Each call joins the bus anew: a client that stays would take a killed server for one that is slow.
///
/// # Errors
/// As [`CommandClient::open`] and [`CommandClient::call`].
pub fn call(
    domain: &Domain,
    name: &str,
    sender: Sender,
    request: Request,
    is_given_up: impl Fn() -> bool,
) -> Result<CommandReply, BusError> {
    let client = CommandClient::open(domain, name)?.sending_as(sender);
    let began = Instant::now();
    loop {
        let reply = client.call(request, PATIENCE)?;
        let may_be_proved = reply.outcome() == Err(Refusal::NotProved) && GuardLock::holder(domain).is_some();
        if !may_be_proved || began.elapsed() >= PATIENCE || is_given_up() {
            return Ok(reply);
        }
        thread::sleep(PROOF_PERIOD);
    }
}
