//! `man`: the manual, made of the command line's own help.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use clap::{Command, CommandFactory as _};

use super::whole_file;
use crate::cli::{Cli, ManArgs};
use crate::command::BadInput;
use crate::command::output::{print_bytes, print_line};
use crate::command::printable::Printable;

mod page;

use page::Page;

pub(crate) fn run(args: &ManArgs) -> anyhow::Result<ExitCode> {
    let mut program = Cli::command();
    // Gives every command its whole name and the arguments that it has from those above it.
    program.build();
    match &args.out {
        Some(folder) => write_all(&program, folder)?,
        None => print_bytes(Page::of(find(&program, &args.command)?).text()?)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The command of a name, which may be of several words.
fn find<'a>(program: &'a Command, name: &[String]) -> Result<&'a Command, BadInput> {
    name.iter().try_fold(program, |command, word| {
        command.find_subcommand(word).ok_or_else(|| {
            let allowed: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            let allowed = if allowed.is_empty() { "nothing".to_owned() } else { allowed.join(", ") };
            BadInput(format!("COMMAND is {}, must be one: after {} comes {allowed}", name.join(" "), called(command)))
        })
    })
}

/// How a command is called on the command line.
fn called(command: &Command) -> &str {
    command.get_bin_name().unwrap_or_else(|| command.get_name())
}

/// Writes the page of a command and those of the commands under it, and says which.
fn write_all(program: &Command, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).map_err(|error| {
        BadInput(format!("--out is {}, must be a folder that can be made: {error}", folder.display()))
    })?;
    let mut commands = vec![program];
    while let Some(command) = commands.pop() {
        let page = Page::of(command);
        let path = folder.join(page.file_name());
        whole_file::write(&path, page.text()?.as_bytes())?;
        print_line(Printable(&path))?;
        let shown: Vec<&Command> = command.get_subcommands().filter(|command| !command.is_hide_set()).collect();
        commands.extend(shown.into_iter().rev());
    }
    Ok(())
}
