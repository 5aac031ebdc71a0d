//! The commands of `[[show.also]]` in the configuration, which a show runs beside its own children.

use bench_dragon_ipc::Instance;
use clap::Parser as _;

use crate::cli::endpoint::{Endpoint, Transport};
use crate::cli::flags::BadInput;
use crate::cli::{Cli, Subcommand, without_usage};

const ALLOWED: &str = "one of bridge, view, metrics, monitor, hz and echo";

/// A checked command of the configuration.
#[derive(Debug)]
pub(crate) struct AlsoCommand {
    /// Name in messages: the command, and a number if several commands have this name.
    pub(super) name: String,
    endpoints: Vec<Endpoint>,
    /// Arguments, including the command itself and the show's instance.
    pub(super) args: Vec<String>,
}

impl AlsoCommand {
    /// Reads the configured command lines.
    pub(crate) fn read_all(lines: &[&str], instance: &Instance) -> Result<Vec<Self>, BadInput> {
        let mut commands: Vec<Self> = Vec::new();
        for line in lines {
            let refuse = |reason: String| BadInput(format!("[[show.also]] command is {line:?}{reason}"));
            let mut command = Self::read(line, instance).map_err(refuse)?;
            let of_that_name = lines_of(&commands, &command.name);
            if of_that_name > 0 {
                command.name = format!("{} {}", command.name, of_that_name + 1);
            }
            commands.push(command);
        }
        Ok(commands)
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Where the command listens and sends to.
    pub(crate) fn endpoints(&self) -> Vec<Endpoint> {
        self.endpoints.clone()
    }

    /// Whether the command serves a page.
    pub(crate) fn is_page(&self) -> bool {
        self.args.first().is_some_and(|command| command == "view")
    }

    fn read(line: &str, instance: &Instance) -> Result<Self, String> {
        let mut args = shlex::split(line).ok_or(": a quotation mark is missing, or nothing follows a \\")?;
        for flag in ["--instance", "--parent"] {
            if args.iter().any(|arg| arg == flag || arg.starts_with(&format!("{flag}="))) {
                return Err(format!(": must be without {flag}, which the show sets"));
            }
        }
        let has_no_command = args.first().is_none_or(|first| first.starts_with('-'));
        if has_no_command {
            return Err(format!(", must be {ALLOWED}, with its arguments"));
        }
        args.extend(["--instance".to_owned(), instance.to_string()]);
        let program = "bench-dragon".to_owned();
        let cli = Cli::try_parse_from(std::iter::once(&program).chain(&args)).map_err(|error| in_one_line(&error))?;
        Ok(Self { name: name(&cli.subcommand)?.to_owned(), endpoints: endpoints(&cli.subcommand), args })
    }
}

/// Number of commands that have a name, with or without a number.
fn lines_of(commands: &[AlsoCommand], name: &str) -> usize {
    let is_of = |command: &&AlsoCommand| {
        command.name.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
    };
    commands.iter().filter(is_of).count()
}

fn endpoints(subcommand: &Subcommand) -> Vec<Endpoint> {
    match subcommand {
        Subcommand::Bridge(bridge) => bridge.bridge.endpoints(),
        Subcommand::View(view) => vec![Endpoint::Listens(Transport::Tcp, view.listen)],
        Subcommand::Metrics(metrics) => vec![Endpoint::Listens(Transport::Tcp, metrics.listen)],
        _ => Vec::new(),
    }
}

/// The name of a subcommand that reads until it is stopped. The error of any other is the reason for which it is refused.
fn name(subcommand: &Subcommand) -> Result<&'static str, String> {
    let ends_with = |flag: &str| Err(format!(": must be without {flag}, because it must run until it is stopped"));
    match subcommand {
        Subcommand::Bridge(bridge) => bridge.bridge.name_beside_show().map_err(|reason| format!(": {reason}")),
        Subcommand::Monitor(monitor) if monitor.guard => {
            Err(": must be without --guard, which the show sets".to_owned())
        }
        Subcommand::Monitor(monitor) if monitor.fail_on_contact => ends_with("--fail-on-contact"),
        Subcommand::Echo(echo) if echo.count.is_some() => ends_with("--count"),
        Subcommand::Hz(hz) if hz.seconds.is_some() => ends_with("--seconds"),
        Subcommand::View(_) => Ok("view"),
        Subcommand::Metrics(_) => Ok("metrics"),
        Subcommand::Monitor(_) => Ok("monitor"),
        Subcommand::Echo(_) => Ok("echo"),
        Subcommand::Hz(_) => Ok("hz"),
        _ => Err(format!(", must be {ALLOWED}: commands that read until they are stopped")),
    }
}

/// An error of clap in one line. A request for help is also refused.
fn in_one_line(error: &clap::Error) -> String {
    use clap::error::ErrorKind::{DisplayHelp, DisplayHelpOnMissingArgumentOrSubcommand, DisplayVersion};
    if matches!(error.kind(), DisplayHelp | DisplayHelpOnMissingArgumentOrSubcommand | DisplayVersion) {
        return format!(", must be {ALLOWED}, with its arguments");
    }
    let text = error.render().to_string();
    let message = without_usage(&text, &text);
    format!(": {}", message.strip_prefix("error: ").unwrap_or(&message))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(lines: &[&str]) -> Result<Vec<AlsoCommand>, String> {
        AlsoCommand::read_all(lines, &Instance::default()).map_err(|error| error.to_string())
    }

    #[test]
    fn commands_are_split_like_shell_lines_and_equal_names_are_numbered() {
        let lines = ["bridge psn --name 'two words'", "hz", "bridge psn --to 10.0.0.20:56565", "bridge osc --bundle"];
        let commands = read(&lines).expect("all are commands that read");
        let names: Vec<&str> = commands.iter().map(|command| command.name.as_str()).collect();
        assert_eq!(names, ["bridge psn", "hz", "bridge psn 2", "bridge osc"]);
        assert_eq!(commands[0].args, ["bridge", "psn", "--name", "two words", "--instance", "dragon"]);
    }

    #[test]
    fn bridges_may_choose_benches_and_place_them_on_a_desk() {
        let stage = "--benches 0,10..20,200.. --rotate -90 --offset -1.5,2,0 --axes -x,z,y";
        let psn = format!("bridge psn {stage} --first-id 1 --tracker-name 'Bench {{index}}'");
        let commands = read(&[&psn, &format!("bridge osc {stage}")]).expect("both are commands that read");
        assert_eq!(commands[0].args[13..], ["Bench {index}", "--instance", "dragon"]);
    }

    #[test]
    fn a_wrong_command_is_one_line_that_names_it_and_what_is_allowed() {
        for (line, reason) in [
            ("", ", must be one of bridge, view, metrics, monitor, hz and echo, with its arguments"),
            ("--help", ", must be one of bridge"),
            ("hz --help", ", must be one of bridge"),
            ("bridge", ": 'bench-dragon bridge' requires a subcommand"),
            ("hz 'x", ": a quotation mark is missing"),
            ("ctl stop", ", must be one of bridge, view, metrics, monitor, hz and echo: commands that read"),
            ("serve", ", must be one of bridge"),
            ("record x.mcap", ", must be one of bridge"),
            ("pose", ": unrecognized subcommand 'pose'"),
            ("hz --instance other", ": must be without --instance, which the show sets"),
            ("hz --instance=other", ": must be without --instance, which the show sets"),
            ("hz --parent 1", ": must be without --parent, which the show sets"),
            ("hz --seconds 3", ": must be without --seconds, because it must run until it is stopped"),
            ("echo --count 3", ": must be without --count"),
            ("monitor --guard", ": must be without --guard"),
            ("bridge osc --axes x,y", ": invalid value 'x,y' for '--axes <AXES>': must be x, y and z"),
            ("bridge psn --rate 0", ": invalid value '0' for '--rate <HZ>': must be from 1 to 250"),
        ] {
            let error = read(&[line]).expect_err(line);
            let start = format!("[[show.also]] command is {line:?}{reason}");
            assert!(error.starts_with(&start) && !error.contains('\n'), "{error}");
        }
    }
}
