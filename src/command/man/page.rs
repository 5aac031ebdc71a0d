//! One page of the manual: a command's, in roff.

use clap::Command;
use clap::builder::Resettable;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use super::called;
use crate::cli::Epilogue;

/// The section that all pages are in: commands of users.
const SECTION: &str = "1";

/// What the pages are of.
const MANUAL: &str = "bench-dragon manual";
/// No date, so that the same program has the same pages. What is empty has to be quoted by itself.
const NO_DATE: &str = "\"\"";
/// How every page begins, after its title.
const NAME_SECTION: &str = ".SH NAME\n";
/// Words are neither broken nor set apart: many are to be typed.
const AS_TYPED: &str = ".nh\n.ad l\n";

/// What the exit statuses mean.
const EXIT_STATUSES: [(&str, &str); 3] = [("0", "done"), ("1", "failed"), ("2", "bad arguments or configuration")];
/// What one more means, for commands that have the flag.
const CONTACT_STATUS: (&str, &str) = ("3", "contact seen where --fail-on-contact was given");

/// A page, made of a command that has been built.
#[derive(Debug)]
pub(super) struct Page<'a>(&'a Command);

impl<'a> Page<'a> {
    pub(super) fn of(command: &'a Command) -> Self {
        Self(command)
    }

    /// The file that `man` looks for.
    pub(super) fn file_name(&self) -> String {
        format!("{}.{SECTION}", self.title())
    }

    /// The page in roff.
    pub(super) fn text(&self) -> anyhow::Result<String> {
        let mut generated = Vec::new();
        let source = format!("bench-dragon {}", env!("CARGO_PKG_VERSION"));
        let page = Man::new(self.without_epilogue()).section(SECTION).date(NO_DATE).source(source).manual(MANUAL);
        page.render(&mut generated)?;
        let generated = String::from_utf8(generated)?;
        let (title, sections) = generated.split_once(NAME_SECTION).expect("every page begins with a name");
        let mut own = Roff::new();
        self.add_examples(&mut own);
        self.add_exit_status(&mut own);
        self.add_see_also(&mut own);
        Ok([title, AS_TYPED, NAME_SECTION, sections, &own.render()].concat())
    }

    /// The name of the page: `bench-dragon-solve-contact`.
    fn title(&self) -> &str {
        self.0.get_display_name().unwrap_or_else(|| self.0.get_name())
    }

    /// The command with the notes of its epilogue as its description; examples and exit statuses have sections of their own.
    fn without_epilogue(&self) -> Command {
        let Self(command) = self;
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        let notes = Epilogue::of(command).notes.join("\n");
        let description = format!("{about}\n\n{notes}");
        // The version is in the page's title.
        let unversioned = (*command).clone().version(Resettable::Reset).long_about(description.trim_end().to_owned());
        unversioned.after_help(Resettable::Reset).after_long_help(Resettable::Reset)
    }

    fn add_examples(&self, page: &mut Roff) {
        page.control("SH", ["EXAMPLES"]);
        for (i, example) in Epilogue::of(self.0).examples.iter().enumerate() {
            match example.split_once("  ") {
                Some((line, remark)) => page.control("TP", []).text([bold(line)]).text([roman(remark.trim())]),
                None if i == 0 => page.text([bold(example)]),
                None => page.control("PP", []).text([bold(example)]),
            };
        }
    }

    fn add_exit_status(&self, page: &mut Roff) {
        let Self(command) = self;
        let has_flag = |command: &Command| command.get_arguments().any(|flag| flag.get_id() == "fail_on_contact");
        let tells_contact = has_flag(command) || command.get_subcommands().any(has_flag);
        page.control("SH", ["EXIT STATUS"]);
        for (status, meaning) in EXIT_STATUSES.into_iter().chain(tells_contact.then_some(CONTACT_STATUS)) {
            page.control("TP", []).text([bold(status)]).text([roman(meaning)]);
        }
    }

    /// The pages of the commands that this one is under.
    fn add_see_also(&self, page: &mut Roff) {
        let words: Vec<&str> = called(self.0).split(' ').collect();
        for above in 1..words.len() {
            if above == 1 {
                page.control("SH", ["SEE ALSO"]);
            }
            let comma = if above + 1 < words.len() { "," } else { "" };
            page.text([bold(words[..above].join("-")), roman(format!("({SECTION}){comma}"))]);
        }
    }
}
