//! `completions` and `man`: shell completions and manual pages, generated from the definition of the command line.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::builder::Resettable;
use clap::{Args, Command, CommandFactory as _, ValueHint};
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use crate::cli::Cli;
use crate::cli::flags::BadInput;
use crate::cli::print::{print_bytes, print_line};
use crate::output::terminal_text::Printable;
use crate::system::whole_file;

/// Print a script that completes this program's subcommands, options and files in a shell.
#[derive(Clone, Copy, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon completions bash > ~/.local/share/bash-completion/completions/bench-dragon
  bench-dragon completions zsh > ~/.zfunc/_bench-dragon
  bench-dragon completions fish > ~/.config/fish/completions/bench-dragon.fish
  bench-dragon completions elvish > ~/.config/elvish/lib/bench-dragon.elv
  source <(bench-dragon completions bash)     only for this shell

The folder must exist. The completions work in shells that are started afterwards. bash needs its package bash-completion. \
zsh needs the line fpath+=~/.zfunc before compinit in ~/.zshrc. Elvish needs the line use bench-dragon in its rc.elv. For \
PowerShell, add the script to its $PROFILE.")]
pub(crate) struct CompletionsArgs {
    /// Shell to complete in.
    #[arg(value_enum, value_name = "SHELL")]
    pub(crate) shell: Shell,
}

/// Print a page of the manual, or write all pages into a folder.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon man | man -l -
  bench-dragon man solve contact | man -l -
  bench-dragon man --out ~/.local/share/man/man1

After the last example, man bench-dragon and man bench-dragon-solve-contact find their pages.")]
pub(crate) struct ManArgs {
    /// Subcommand whose page to print, as in `solve contact` [default: the program itself].
    #[arg(value_name = "SUBCOMMAND", conflicts_with = "out")]
    pub(crate) subcommand: Vec<String>,
    /// Write all pages, one per subcommand, into this folder; a missing folder is created.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
}

const NAME: &str = "bench-dragon";
/// The name without a hyphen. With a hyphen, the bash script of `clap_complete` does not complete after a subcommand.
const NAME_IN_BASH: &str = "bench_dragon";

pub(super) fn completions(args: CompletionsArgs) -> anyhow::Result<ExitCode> {
    print_bytes(script(args.shell)?)?;
    Ok(ExitCode::SUCCESS)
}

fn script(shell: Shell) -> anyhow::Result<String> {
    let (mut program, mut script) = (Cli::command(), Vec::new());
    let name = if shell == Shell::Bash { NAME_IN_BASH } else { NAME };
    clap_complete::generate(shell, &mut program, name, &mut script);
    // At the end of a line is the name of the program that the function completes, so the hyphen goes back there.
    Ok(String::from_utf8(script)?.replace(&format!(" {NAME_IN_BASH}\n"), &format!(" {NAME}\n")))
}

pub(super) fn man(args: &ManArgs) -> anyhow::Result<ExitCode> {
    let mut program = Cli::command();
    // Sets the full name of each subcommand, and the arguments that it inherits from its parents.
    program.build();
    match &args.out {
        Some(folder) => write_all(&program, folder)?,
        None => print_bytes(page(find(&program, &args.subcommand)?)?)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Finds a subcommand by its name, which may have several words.
fn find<'a>(program: &'a Command, name: &[String]) -> Result<&'a Command, BadInput> {
    name.iter().try_fold(program, |command, word| {
        command.find_subcommand(word).ok_or_else(|| {
            let allowed: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            let allowed = if allowed.is_empty() { "nothing".to_owned() } else { allowed.join(", ") };
            let (name, parent) = (name.join(" "), called(command));
            BadInput(format!("SUBCOMMAND is {name}, must be a subcommand: allowed after {parent}: {allowed}"))
        })
    })
}

fn called(command: &Command) -> &str {
    command.get_bin_name().unwrap_or_else(|| command.get_name())
}

/// Writes the pages of a subcommand and of all its own subcommands, and prints their paths.
fn write_all(program: &Command, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).map_err(|error| {
        BadInput(format!("--out is {}, must be a folder that can be created: {error}", folder.display()))
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

/// The manual section of all pages: user commands.
const SECTION: &str = "1";

const MANUAL: &str = "bench-dragon manual";
/// No date, so that the same program has the same pages. roff needs quotation marks for an empty argument.
const NO_DATE: &str = "\"\"";
/// The beginning of every page, after its title.
const NAME_SECTION: &str = ".SH NAME\n";
/// Turns hyphenation and justification off, because users copy words from the page.
const AS_TYPED: &str = ".nh\n.ad l\n";

const EXIT_STATUSES: [(&str, &str); 3] = [("0", "done"), ("1", "failed"), ("2", "bad arguments or configuration")];
/// Additional exit statuses, each with an argument of the subcommands that have it.
const OTHER_STATUSES: [(&str, (&str, &str)); 2] = [
    ("fail_on_contact", ("3", "contact with --fail-on-contact")),
    ("rotate_mb", ("4", "the recording's disk is full")),
];

/// The name of a subcommand's page: `bench-dragon-solve-contact`.
fn page_title(command: &Command) -> &str {
    command.get_display_name().unwrap_or_else(|| command.get_name())
}

/// The page of a subcommand that has been built, in roff.
fn page(command: &Command) -> anyhow::Result<String> {
    let Epilogue { examples, notes } = Epilogue::of(command);
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    let description = format!("{about}\n\n{}", notes.join("\n"));
    // The version is in the page's title. Examples and exit statuses have separate sections.
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
    let takes = |command: &Command, id: &str| command.get_arguments().any(|argument| argument.get_id() == id);
    let others = OTHER_STATUSES.into_iter().filter_map(|(id, status)| {
        let is_possible = takes(command, id) || command.get_subcommands().any(|command| takes(command, id));
        is_possible.then_some(status)
    });
    page.control("SH", ["EXIT STATUS"]);
    for (status, meaning) in EXIT_STATUSES.into_iter().chain(others) {
        page.control("TP", []).text([bold(status)]).text([roman(meaning)]);
    }
}

/// Adds references to the pages of the parents.
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

/// The text after a subcommand's help: examples, then notes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Epilogue {
    /// Lines to type. Two or more blanks separate a line from its remark, if it has one.
    pub(crate) examples: Vec<String>,
    /// Lines of prose, with an empty line between two paragraphs.
    pub(crate) notes: Vec<String>,
}

impl Epilogue {
    /// The epilogue of a subcommand. Examples are the indented lines under a line that begins with "Example".
    pub(crate) fn of(command: &Command) -> Self {
        let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let mut epilogue = Self::default();
        let mut are_examples = false;
        for line in text.lines() {
            if line.starts_with("Example") && line.ends_with(':') {
                are_examples = true;
                continue;
            }
            are_examples &= line.starts_with("  ");
            if are_examples {
                epilogue.examples.push(line.trim().to_owned());
            } else if !line.is_empty() || !epilogue.notes.is_empty() {
                epilogue.notes.push(line.to_owned());
            }
        }
        epilogue
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    /// The program, its subcommands and theirs.
    fn commands() -> Vec<Command> {
        let mut program = Cli::command();
        program.build();
        let mut commands = vec![program];
        let mut next = 0;
        while let Some(command) = commands.get(next) {
            let under: Vec<Command> = command.get_subcommands().cloned().collect();
            commands.extend(under);
            next += 1;
        }
        commands
    }

    /// The calls of the program in a shell line: the commands between pipes, lists and substitutions, without redirections
    /// to files.
    fn calls(example: &str) -> Vec<Vec<String>> {
        let line = example.split_once("  ").map_or(example, |(line, _remark)| line);
        let parts = line.replace("&&", "|").replace("<(", "|").replace(')', "|");
        let words = |part: &str| -> Vec<String> {
            let command = part.split_once('>').map_or(part, |(command, _file)| command);
            shlex::split(command).expect("an example has closed quotation marks")
        };
        parts.split('|').map(words).filter(|words| words.first().is_some_and(|word| word == "bench-dragon")).collect()
    }

    #[test]
    fn every_help_has_examples_that_the_program_accepts() {
        for command in commands() {
            let name = command.get_bin_name().unwrap_or("bench-dragon").to_owned();
            let epilogue = Epilogue::of(&command);
            assert!(!epilogue.examples.is_empty(), "the help of {name} has no example");
            let calls: Vec<Vec<String>> = epilogue.examples.iter().flat_map(|example| calls(example)).collect();
            let is_of_it = |call: &Vec<String>| format!("{} ", call.join(" ")).starts_with(&format!("{name} "));
            assert!(calls.iter().any(is_of_it), "no example in the help of {name} calls {name}");
            for call in calls {
                if let Err(error) = Cli::try_parse_from(&call) {
                    panic!("in the help of {name}: {}\n{error}", call.join(" "));
                }
            }
        }
    }

    #[test]
    fn calls_are_found_at_any_position_in_a_line() {
        let found = |line: &str| -> Vec<String> { calls(line).iter().map(|words| words.join(" ")).collect() };
        assert_eq!(found("bench-dragon hz      its rate > 3"), ["bench-dragon hz"]);
        assert_eq!(found("bench-dragon echo --format json | jq .tick"), ["bench-dragon echo --format json"]);
        assert_eq!(found("mkdir -p a && bench-dragon iox2-config > a/b && iox2 list"), ["bench-dragon iox2-config"]);
        assert_eq!(found("source <(bench-dragon completions bash)"), ["bench-dragon completions bash"]);
        assert_eq!(found("cargo run -- hz"), [""; 0]);
    }

    #[test]
    fn lines_that_are_not_examples_are_notes() {
        let command = Command::new("dance").after_help("Examples:\n  dance a   b\n  dance c\n\nOf c,\nthis.\n\nMore.");
        let Epilogue { examples, notes } = Epilogue::of(&command);
        assert_eq!(examples, ["dance a   b", "dance c"]);
        assert_eq!(notes, ["Of c,", "this.", "", "More."]);
    }
}
