//! `completions`: what completes this program's commands in a shell.

use std::process::ExitCode;

use clap::CommandFactory as _;
use clap_complete::Shell;

use crate::cli::{Cli, CompletionsArgs};
use crate::command::output::print_bytes;

const NAME: &str = "bench-dragon";
/// The name without a hyphen: with one, the script that `clap_complete` writes for bash knows nothing of what follows a command.
const NAME_IN_BASH: &str = "bench_dragon";

pub(crate) fn run(args: CompletionsArgs) -> anyhow::Result<ExitCode> {
    print_bytes(script(args.shell)?)?;
    Ok(ExitCode::SUCCESS)
}

fn script(shell: Shell) -> anyhow::Result<String> {
    let (mut program, mut script) = (Cli::command(), Vec::new());
    let name = if shell == Shell::Bash { NAME_IN_BASH } else { NAME };
    clap_complete::generate(shell, &mut program, name, &mut script);
    // At the end of a line stands the program that the function is for.
    Ok(String::from_utf8(script)?.replace(&format!(" {NAME_IN_BASH}\n"), &format!(" {NAME}\n")))
}
