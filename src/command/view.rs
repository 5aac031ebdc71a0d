//! `view`: the page's process.

use std::env::{self, VarError};
use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_ipc::Domain;

use crate::cli::ViewArgs;
use crate::command::BadInput;
use crate::command::listening;
use crate::command::observing::observe_while;
use crate::command::output::complain;
use crate::display::observe::Observer;
use crate::display::view::{Token, TokenError, View, ViewSettings};
use crate::system::stop::StopFlag;

/// Scenes a second: those of most screens.
const SCENES_HZ: u32 = 60;
/// The token of one's own, where it is set.
pub(super) const TOKEN_VARIABLE: &str = "BENCH_DRAGON_TOKEN";

pub(crate) fn run(args: &ViewArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let token = token()?;
    let stop = StopFlag::on_signals()?;
    let site = listening::open(args.listen, &args.site)?;
    let address = site.address();
    announce(args, &token, address)?;
    let settings = ViewSettings { token, is_read_only: args.read_only, address: address.ip() };
    let view = View::open(domain.clone(), settings)?;
    let observer = Observer::new(domain, "view", SCENES_HZ).with_plan();
    let serve = || {
        site.serve(view.router(), &stop, view.closing())?;
        view.close();
        Ok(())
    };
    observe_while(&observer, stop.as_atomic(), |scene| view.show(scene), serve)?;
    Ok(ExitCode::SUCCESS)
}

fn token() -> anyhow::Result<Token> {
    match env::var(TOKEN_VARIABLE) {
        Ok(text) => {
            text.parse().map_err(|error| BadInput(format!("the environment's {TOKEN_VARIABLE} {error}")).into())
        }
        Err(VarError::NotUnicode(_)) => {
            Err(BadInput(format!("the environment's {TOKEN_VARIABLE} {TokenError}")).into())
        }
        Err(VarError::NotPresent) => Ok(Token::random().context("the kernel has no random numbers")?),
    }
}

fn announce(args: &ViewArgs, token: &Token, address: SocketAddr) -> anyhow::Result<()> {
    let fragment =
        if args.read_only && address.ip().is_loopback() { String::new() } else { format!("#token={}", token.secret()) };
    listening::announce(args.format.format, "", listening::url(address, &fragment), address)?;
    if !address.ip().is_loopback() {
        complain("whoever has this address and its token can look, and steer unless --read-only; it is not encrypted");
    }
    Ok(())
}
