//! `hand-over`: writes a plan as files for those who build, dance and light the show.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Args, ValueHint};
use serde::Serialize;

use super::flags::{BadInput, ConfigArgs, FormatArgs, finite, nanoseconds};
use super::load_config;
use super::print::print_report;
use super::solve::{WorkArgs, keep_drawing, title, work_default};
use crate::config::Config;
use crate::hand_over::{FILES, HandOver, Settings};
use crate::output::figure::Paper;
use crate::output::terminal_text::Printable;
use crate::system::whole_file;

/// Write a plan as files for others: the show in a browser, plans on paper, the floor for CAD, a sheet for each bench, all poses.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("work", |arg| work_default(arg, "1000")))]
#[command(after_help = "Examples:
  bench-dragon hand-over examples/night.toml --out for-the-crew
  bench-dragon hand-over examples/square.toml --out square --at 30,60 --paper a2
  bench-dragon hand-over --out paper --title \"The paper's dragon\"

show.html plays the show in any browser, from a file and without a network. The folder is created; files of the same names are \
replaced. A file that would be too large is left out, with the reason.")]
pub(crate) struct HandOverArgs {
    /// Configuration file, in TOML [default: the paper's dragon].
    #[arg(value_name = "CONFIG", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
    /// Folder for the files.
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    pub(crate) out: PathBuf,
    /// Further moments beside start, cues, first contact and end: show times in seconds, separated by commas.
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) at: Vec<f64>,
    /// Seconds between two poses of the tables, 0.001 to 1000.
    #[arg(long, value_name = "SECONDS", default_value = "1", allow_negative_numbers = true, value_parser = step_s)]
    pub(crate) step: f64,
    /// Name of the show, 1 to 80 ASCII letters, digits and signs [default: the configuration's file].
    #[arg(long, value_name = "TEXT", value_parser = title)]
    pub(crate) title: Option<String>,
    /// Size of the plans: a0 to a4, letter, tabloid.
    #[arg(long, value_name = "SIZE", default_value = "a3")]
    pub(crate) paper: Paper,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

fn step_s(text: &str) -> Result<f64, String> {
    let step_s = nanoseconds(text).ok().map(|step_ns| step_ns as f64 / 1e9);
    step_s
        .filter(|step_s| (0.001..=1000.0).contains(step_s))
        .ok_or_else(|| "must be from 0.001 to 1000, with at most nine decimals".to_owned())
}

#[derive(Serialize)]
struct Report<'a> {
    folder: &'a Path,
    files: Vec<Written>,
    left_out: Vec<LeftOut>,
    /// The first contact of the plan; null if there is none, or none up to `searched_to_s`.
    contact_s: Option<f64>,
    /// Show time up to which a contact was searched for, if it was not to the end.
    searched_to_s: Option<f64>,
}

#[derive(Serialize)]
struct Written {
    file: &'static str,
    what: &'static str,
    bytes: usize,
}

#[derive(Serialize)]
struct LeftOut {
    file: &'static str,
    because: String,
}

pub(super) fn run(args: &HandOverArgs) -> anyhow::Result<ExitCode> {
    let config = load_config(&ConfigArgs { config: args.config.clone() }, |_| ())?;
    let settings = Settings {
        title: args.title.clone().unwrap_or_else(|| name(args.config.as_deref())),
        paper: args.paper,
        at_s: &args.at,
        step_s: args.step,
        meter: args.work.longest_meter(),
    };
    let show = HandOver::of(&config, settings).map_err(BadInput)?;
    keep_configuration(args, &config)?;
    fs::create_dir_all(&args.out).map_err(|error| {
        BadInput(format!("--out is {}, must be a folder that can be created: {error}", Printable(&args.out)))
    })?;
    let (mut files, mut left_out) = (Vec::new(), Vec::new());
    for file in FILES {
        match show.make(file) {
            Ok(bytes) => {
                whole_file::write(&args.out.join(file.name), &bytes)?;
                files.push(Written { file: file.name, what: file.what, bytes: bytes.len() });
            }
            Err(because) => {
                remove_earlier(&args.out.join(file.name))?;
                left_out.push(LeftOut { file: file.name, because });
            }
        }
    }
    let contact_s = show.contact().map(|contact| contact.time_s);
    let report = Report { folder: &args.out, files, left_out, contact_s, searched_to_s: show.searched_to_s() };
    let text = report.text(&show);
    print_report(args.format.format, &report, text).context("the list of files cannot be printed")?;
    Ok(ExitCode::SUCCESS)
}

/// Removes the file of an earlier plan, which would be taken for one of this plan.
fn remove_earlier(file: &Path) -> Result<(), BadInput> {
    match fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(BadInput(format!("{} of an earlier plan cannot be removed: {error}", Printable(file))))
        }
        _ => Ok(()),
    }
}

/// The name of a show: that of its configuration's file.
fn name(config: Option<&Path>) -> String {
    let stem = config.and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| title(stem).is_ok()).unwrap_or_else(|| "Bench dragon".to_owned())
}

/// Fails if a file to write is the configuration, or the drawing of a route.
fn keep_configuration(args: &HandOverArgs, config: &Config) -> Result<(), BadInput> {
    let same = |one: &Path, other: &Path| {
        one.canonicalize().ok().zip(other.canonicalize().ok()).is_some_and(|(one, other)| one == other)
    };
    let documents = config.named().map(|named| named.dragons().iter().map(|dragon| dragon.config.document()));
    let documents: Vec<_> = documents.into_iter().flatten().chain([config.document()]).collect();
    for file in FILES {
        let written = args.out.join(file.name);
        if args.config.as_ref().is_some_and(|config| same(config, &written)) {
            let written = Printable(&written);
            return Err(BadInput(format!("--out would replace {written}, the configuration: choose another folder")));
        }
        documents.iter().try_for_each(|document| keep_drawing("--out", &written, document))?;
    }
    Ok(())
}

impl Report<'_> {
    fn text(&self, show: &HandOver<'_>) -> String {
        let Self { folder, files, left_out, .. } = self;
        let mut lines = vec![format!("{} files in {}", files.len(), Printable(folder))];
        lines.extend(files.iter().map(|Written { file, what, .. }| format!("{file:<14} {what}")));
        lines.extend(left_out.iter().map(|LeftOut { file, because }| format!("{file:<14} left out: {because}")));
        lines.extend(show.attention().map(|words| format!("attention      {words}")));
        lines.join("\n")
    }
}
