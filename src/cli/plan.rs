//! `plan`: the planner's page in a browser.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Args, ValueHint};

use super::flags::{BadInput, ConfigArgs, FormatArgs, listen_address};
use super::load_config;
use super::print::print_to_stderr;
use super::web::{SiteArgs, announce, listen, token, url};
use crate::display::planner::Planner;
use crate::system::stop::StopFlag;

/// Serve a page that draws a configuration, and changes it where you drag.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon plan street.toml                  prints the address to open
  bench-dragon plan                              the paper's dragon; save it under a name
  bench-dragon plan street.toml --listen 127.0.0.1:0

The page needs no server of a show. It answers as `bench-dragon solve` does, while you drag. A browser on this machine needs no \
token to look; saving needs the token in the printed address. Only files in the folder of CONFIG are read and written.")]
pub(crate) struct PlanArgs {
    /// Configuration file, in TOML [default: the paper's dragon].
    #[arg(value_name = "CONFIG", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
    /// Only read the configuration, within the limits of every command. The page does so before it reads a large text.
    #[arg(long, hide = true)]
    pub(crate) check: bool,
    /// Address and port of the page; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8224", value_parser = listen_address)]
    pub(crate) listen: SocketAddr,
    #[command(flatten)]
    pub(crate) site: SiteArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

pub(super) fn run(args: &PlanArgs) -> anyhow::Result<ExitCode> {
    load_config(&ConfigArgs { config: args.config.clone() }, |_| ())?;
    if args.check {
        return Ok(ExitCode::SUCCESS);
    }
    let token = token()?;
    let stop = StopFlag::on_signals()?;
    let site = listen(args.listen, &args.site)?;
    let address = site.address;
    let secret = token.secret().to_owned();
    let planner = Planner::open(args.config.as_deref(), token, address.ip())
        .map_err(|error| BadInput(format!("the configuration cannot be opened: {error}")))?;
    announce(args.format.format, "", url(address, &format!("#token={secret}")), address)?;
    if !address.ip().is_loopback() {
        print_to_stderr("anyone with this address and token can see and change the plan; nothing is encrypted");
    }
    site.serve(planner.router(), &stop, planner.closing()).context("the page cannot be served")?;
    Ok(ExitCode::SUCCESS)
}
