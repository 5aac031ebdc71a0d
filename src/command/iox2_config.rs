//! `iox2-config`: the iceoryx2 configuration of an instance.

use std::process::ExitCode;

use bench_dragon_ipc::Domain;

use crate::cli::BusArgs;
use crate::command::output::print_line;

pub(crate) fn run(args: &BusArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.instance.clone())?;
    print_line(domain.iceoryx2_toml().trim_end())?;
    Ok(ExitCode::SUCCESS)
}
