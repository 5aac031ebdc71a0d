//! What the help of a command ends with.

use clap::Command;

/// Examples, then whatever else there is to know.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Epilogue {
    /// Lines to type, each with a remark behind it where two blanks or more part one from it.
    pub(crate) examples: Vec<String>,
    /// Lines of prose, an empty one between two paragraphs.
    pub(crate) notes: Vec<String>,
}

impl Epilogue {
    /// The one of a command: examples are the indented lines under one that begins with "Example".
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
    use clap::CommandFactory as _;
    use clap::Parser as _;

    use super::*;
    use crate::cli::Cli;

    /// The program's commands and those under them.
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

    /// The calls of the program in a line of a shell: what stands between its pipes, lists and substitutions, up to where it
    /// is sent to a file.
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
    fn every_help_has_examples_and_each_of_them_is_a_line_that_the_program_takes() {
        for command in commands() {
            let name = command.get_bin_name().unwrap_or("bench-dragon").to_owned();
            let epilogue = Epilogue::of(&command);
            assert!(!epilogue.examples.is_empty(), "the help of {name} has no example");
            let calls: Vec<Vec<String>> = epilogue.examples.iter().flat_map(|example| calls(example)).collect();
            let is_of_it = |call: &Vec<String>| format!("{} ", call.join(" ")).starts_with(&format!("{name} "));
            assert!(calls.iter().any(is_of_it), "no example in the help of {name} is one of it");
            for call in calls {
                if let Err(error) = Cli::try_parse_from(&call) {
                    panic!("in the help of {name}: {}\n{error}", call.join(" "));
                }
            }
        }
    }

    #[test]
    fn calls_are_found_wherever_they_stand_in_a_line() {
        let found = |line: &str| -> Vec<String> { calls(line).iter().map(|words| words.join(" ")).collect() };
        assert_eq!(found("bench-dragon hz      its rate > 3"), ["bench-dragon hz"]);
        assert_eq!(found("bench-dragon echo --format json | jq .tick"), ["bench-dragon echo --format json"]);
        assert_eq!(found("mkdir -p a && bench-dragon iox2-config > a/b && iox2 list"), ["bench-dragon iox2-config"]);
        assert_eq!(found("source <(bench-dragon completions bash)"), ["bench-dragon completions bash"]);
        assert_eq!(found("cargo run -- hz"), [""; 0]);
    }

    #[test]
    fn what_is_no_example_is_a_note() {
        let command = Command::new("dance").after_help("Examples:\n  dance a   b\n  dance c\n\nOf c,\nthis.\n\nMore.");
        let Epilogue { examples, notes } = Epilogue::of(&command);
        assert_eq!(examples, ["dance a   b", "dance c"]);
        assert_eq!(notes, ["Of c,", "this.", "", "More."]);
    }
}
