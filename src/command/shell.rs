//! `completions` and `man`: what an installation gives the shell, made from the command line itself.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use clap::builder::Resettable;
use clap::{Command, CommandFactory as _};
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use crate::cli::{BadInput, Cli, CompletionsArgs, Epilogue, ManArgs};
use crate::command::print::{print_bytes, print_line};
use crate::output::terminal_text::Printable;
use crate::system::whole_file;

const NAME: &str = "bench-dragon";
/// The name without a hyphen: with one, the script that `clap_complete` writes for bash knows nothing of what follows a command.
const NAME_IN_BASH: &str = "bench_dragon";

pub(super) fn completions(args: CompletionsArgs) -> anyhow::Result<ExitCode> {
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

pub(super) fn man(args: &ManArgs) -> anyhow::Result<ExitCode> {
    let mut program = Cli::command();
    // Gives every command its whole name and the arguments that it has from those above it.
    program.build();
    match &args.out {
        Some(folder) => write_all(&program, folder)?,
        None => print_bytes(page(find(&program, &args.command)?)?)?,
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
        let path = folder.join(format!("{}.{SECTION}", page_title(command)));
        whole_file::write(&path, page(command)?.as_bytes())?;
        print_line(Printable(&path))?;
        let shown: Vec<&Command> = command.get_subcommands().filter(|command| !command.is_hide_set()).collect();
        commands.extend(shown.into_iter().rev());
    }
    Ok(())
}

/// The section that all pages are in: commands of users.
const SECTION: &str = "1";

const MANUAL: &str = "bench-dragon manual";
/// No date, so that the same program has the same pages. What is empty has to be quoted by itself.
const NO_DATE: &str = "\"\"";
/// How every page begins, after its title.
const NAME_SECTION: &str = ".SH NAME\n";
/// Words are neither broken nor set apart: many are to be typed.
const AS_TYPED: &str = ".nh\n.ad l\n";

const EXIT_STATUSES: [(&str, &str); 3] = [("0", "done"), ("1", "failed"), ("2", "bad arguments or configuration")];
/// What one more means, for commands that have the flag.
const CONTACT_STATUS: (&str, &str) = ("3", "contact seen where --fail-on-contact was given");

/// The name of a command's page: `bench-dragon-solve-contact`.
fn page_title(command: &Command) -> &str {
    command.get_display_name().unwrap_or_else(|| command.get_name())
}

/// The page of a command that has been built, in roff.
fn page(command: &Command) -> anyhow::Result<String> {
    let Epilogue { examples, notes } = Epilogue::of(command);
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    let description = format!("{about}\n\n{}", notes.join("\n"));
    // The version is in the page's title; examples and exit statuses have sections of their own.
    let described = command.clone().version(Resettable::Reset).long_about(description.trim_end().to_owned());
    let described = described.after_help(Resettable::Reset).after_long_help(Resettable::Reset);
    let source = format!("bench-dragon {}", env!("CARGO_PKG_VERSION"));
    let mut generated = Vec::new();
    Man::new(described).section(SECTION).date(NO_DATE).source(source).manual(MANUAL).render(&mut generated)?;
    let generated = String::from_utf8(generated)?;
    let (title, sections) = generated.split_once(NAME_SECTION).expect("every page begins with a name");
    let mut own = Roff::new();
    add_examples(&examples, &mut own);
    add_exit_status(command, &mut own);
    add_see_also(command, &mut own);
    Ok([title, AS_TYPED, NAME_SECTION, sections, &own.render()].concat())
}

fn add_examples(examples: &[String], page: &mut Roff) {
    page.control("SH", ["EXAMPLES"]);
    for (i, example) in examples.iter().enumerate() {
        match example.split_once("  ") {
            Some((line, remark)) => page.control("TP", []).text([bold(line)]).text([roman(remark.trim())]),
            None if i == 0 => page.text([bold(example)]),
            None => page.control("PP", []).text([bold(example)]),
        };
    }
}

fn add_exit_status(command: &Command, page: &mut Roff) {
    let has_flag = |command: &Command| command.get_arguments().any(|flag| flag.get_id() == "fail_on_contact");
    let tells_contact = has_flag(command) || command.get_subcommands().any(has_flag);
    page.control("SH", ["EXIT STATUS"]);
    for (status, meaning) in EXIT_STATUSES.into_iter().chain(tells_contact.then_some(CONTACT_STATUS)) {
        page.control("TP", []).text([bold(status)]).text([roman(meaning)]);
    }
}

/// The pages of the commands that this one is under.
fn add_see_also(command: &Command, page: &mut Roff) {
    let words: Vec<&str> = called(command).split(' ').collect();
    for above in 1..words.len() {
        if above == 1 {
            page.control("SH", ["SEE ALSO"]);
        }
        let comma = if above + 1 < words.len() { "," } else { "" };
        page.text([bold(words[..above].join("-")), roman(format!("({SECTION}){comma}"))]);
    }
}
