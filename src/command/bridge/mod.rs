//! `bridge`: the poses in the words of show control.

use std::process::ExitCode;

use crate::cli::{Bridge, BridgeArgs};

mod feed;
mod psn;
mod session;

pub(crate) fn run(args: &BridgeArgs) -> anyhow::Result<ExitCode> {
    match &args.bridge {
        Bridge::Psn(psn) => psn::run(args, psn),
    }
}
