//! The check sheet: the findings before a show, on one page that a stage engineer signs.
//!
//! `doctor --tonight --out DIR` writes it into the show's folder, as a page to print and as JSON. The show with this folder puts the
//! page before its report.

use std::path::{Path, PathBuf};
use std::{fs, io};

use anyhow::Context as _;
use bench_dragon_geometry::number::Fixed;
use jiff::Timestamp;
use jiff::tz::TimeZone;
use serde::{Deserialize, Serialize};

use super::finding::{Examination, Examined, Verdict};
use super::{Target, machine};
use crate::cli::flags::BadInput;
use crate::cli::show::{SUMMARY, create_private, used_before};
use crate::config::Config;
use crate::output::report::{self, Block, Fact, Layout, Report, Section, Table, Weight};
use crate::output::terminal_text::Printable;
use crate::output::{Counted, json};
use crate::system::machine::Machine;
use crate::system::whole_file;

/// The page, and the same for programs.
const PAGE: &str = "checks.html";
const JSON: &str = "checks.json";
/// Checks that only people can make.
const BY_HAND: [&str; 4] = [
    "The wired emergency stop was pressed, and it stopped everyone.",
    "Each desk shows the dragon where it stands.",
    "Each tablet shows the page; those who steer have tried hold.",
    "The ground is clear, and everyone is in place.",
];

/// The findings before a show, with what was checked.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct CheckSheet {
    /// Wall time, RFC 3339 in UTC.
    at: String,
    /// The file of the configuration; null for the paper's dragon.
    config_file: Option<PathBuf>,
    /// Checksum of the configuration with all its keys, as the show's folder has it.
    config_sum: String,
    /// The plan in words.
    plan: String,
    machine: Machine,
    /// This program, its bus and the kernel.
    versions: String,
    #[serde(flatten)]
    examination: Examination,
}

/// Refuses a folder whose show is over, and removes the sheet of earlier checks: it must not stay beside checks that fail. Call it
/// before the checks.
pub(super) fn make_room(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        return Err(BadInput(format!("--out is {}, which is not a folder", Printable(folder))).into());
    }
    if folder.join(SUMMARY).exists() {
        return Err(used_before(folder, SUMMARY).into());
    }
    for path in [PAGE, JSON].map(|name| folder.join(name)) {
        match fs::remove_file(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            removed => removed.with_context(|| format!("cannot remove {}", path.display()))?,
        }
    }
    Ok(())
}

/// Checksum (CRC-32) of a configuration with all its keys.
fn sum(config: &Config) -> String {
    format!("{:08x}", crc32fast::hash(config.to_toml().as_bytes()))
}

impl CheckSheet {
    pub(super) fn new(examination: Examination, target: &Target, config_file: Option<PathBuf>) -> Self {
        Self {
            at: Timestamp::now().to_string(),
            config_file,
            config_sum: sum(&target.config),
            plan: plan(target),
            machine: Machine::read(),
            versions: machine::version(target).message,
            examination,
        }
    }

    /// Writes the sheet into the folder of a show, which is created if it is missing. Returns the path of the page.
    pub(super) fn write(&self, folder: &Path) -> anyhow::Result<PathBuf> {
        create_private(folder).with_context(|| format!("cannot create {}", folder.display()))?;
        whole_file::write(&folder.join(JSON), &json::indented(self)?)?;
        let page = folder.join(PAGE);
        let title =
            fs::canonicalize(folder).ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
        let title = title.unwrap_or_else(|| folder.to_string_lossy().into_owned());
        whole_file::write(&page, self.report(&title, None).html().as_bytes())?;
        Ok(page)
    }

    /// Reads the sheet of a folder; `None` where there is none.
    ///
    /// # Errors
    /// The file cannot be read, or is no check sheet.
    pub(crate) fn read(folder: &Path) -> anyhow::Result<Option<Self>> {
        let path = folder.join(JSON);
        let text = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            read => read.with_context(|| format!("cannot read {}", path.display()))?,
        };
        serde_json::from_slice(&text).map(Some).with_context(|| format!("{} is no check sheet", path.display()))
    }

    /// The page. `played` is the configuration that the show has played since then.
    pub(crate) fn report(&self, title: &str, played: Option<&Config>) -> Report {
        let at = self.at.parse::<Timestamp>().map(|at| at.to_zoned(TimeZone::system()));
        let at = at.map_or_else(|_| self.at.clone(), |at| at.strftime("%A, %-d %B %Y, %H:%M:%S (UTC%:z)").to_string());
        Report {
            kind: "Checks before the show".to_owned(),
            title: title.to_owned(),
            subtitle: at,
            verdict: self.verdict(played),
            sections: self.sections(),
            layout: Layout::Sheet,
            cover: None,
        }
    }

    fn verdict(&self, played: Option<&Config>) -> report::Verdict {
        let verdict = self.examination.verdict();
        match played.map(sum).filter(|played| *played != self.config_sum) {
            Some(played) => report::Verdict {
                weight: verdict.weight.max(Weight::Attention),
                words: format!(
                    "{} The show then played another configuration (checksum {played}) than the checked one.",
                    verdict.words
                ),
            },
            None => verdict,
        }
    }

    fn sections(&self) -> Vec<Section> {
        let is_open = |check: &&Examined| check.finding.remedy.is_some();
        let (open, settled): (Vec<_>, Vec<_>) = self.examination.checks.iter().partition(is_open);
        let section = |heading: &str, blocks| Section { heading: heading.to_owned(), begins_page: false, blocks };
        let mut sections = vec![section("", vec![Block::Facts(self.facts())])];
        if !open.is_empty() {
            sections.push(section("To settle", vec![Block::Table(to_settle(&open))]));
        }
        sections.push(section("In order", vec![Block::Table(in_order(&settled))]));
        sections.push(section("By hand", vec![Block::Ticks(BY_HAND.map(str::to_owned).to_vec())]));
        let lines = ["Stage engineer", "Date and time", "Signature"].map(str::to_owned);
        sections.push(section("", vec![Block::ToSign(lines.to_vec())]));
        sections
    }

    fn facts(&self) -> Vec<Fact> {
        let file = self.config_file.as_ref().map_or("the paper's dragon".to_owned(), |file| file.display().to_string());
        let Machine { host, kernel, processors, processor, clock_source } = &self.machine;
        let processors = processors.map(|number| Counted(number as u64, "processor").to_string());
        let more = [processors, processor.clone(), clock_source.clone(), Some(kernel.clone())];
        vec![
            Fact::new("Configuration", file).more(format!("checksum {}", self.config_sum)),
            Fact::new("Plan", &*self.plan),
            Fact::new("Machine", host).more(more.into_iter().flatten().collect::<Vec<_>>().join(", ")),
            Fact::new("Versions", &*self.versions),
        ]
    }
}

/// The plan of the show, in words.
fn plan(target: &Target) -> String {
    let Target { config, from_s, until_s, .. } = target;
    let layout = config.formation().layout();
    let tables = config.tables();
    let dragons = config.named().map_or(1, |_| layout.dragons() as u64);
    let guard = if tables.monitor.guard {
        format!("a guard with {} mm", Fixed::<1>(tables.monitor.margin_m * 1e3))
    } else {
        "no guard".to_owned()
    };
    format!(
        "{} of {}, show time {} to {} s, {} Hz, {guard}",
        Counted(layout.benches() as u64, "bench"),
        Counted(dragons, "dragon"),
        Fixed::<1>(*from_s),
        Fixed::<1>(*until_s),
        tables.serve.rate_hz
    )
}

/// Problems and warnings with their remedies, problems first.
fn to_settle(checks: &[&Examined]) -> Table {
    let mut checks = checks.to_vec();
    checks.sort_by_key(|check| check.finding.status != Verdict::Problem);
    let row = |check: &&Examined| {
        let (finding, sign) = (&check.finding, if check.finding.status == Verdict::Problem { "\u{2715}" } else { "!" });
        let remedy = finding.remedy.clone().unwrap_or_default();
        vec![format!("{sign} {}", finding.status.shown().0), check.name.clone(), finding.message.clone(), remedy]
    };
    Table {
        columns: vec!["", "check", "finding", "remedy"],
        rows: checks.iter().map(row).collect(),
        ..Table::default()
    }
}

/// The checks that need nothing.
fn in_order(checks: &[&Examined]) -> Table {
    let row = |check: &&Examined| {
        let sign = if check.finding.status == Verdict::Ok { "\u{2713}" } else { "?" };
        vec![format!("{sign} {}", check.name), check.finding.message.clone()]
    };
    Table {
        columns: vec!["check", "finding"],
        rows: checks.iter().map(row).collect(),
        empty: "No check.".to_owned(),
        left_out: Some("? is not known: the machine does not report it, or a program cannot know it.".to_owned()),
        ..Table::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::doctor::finding::Finding;

    fn sheet(findings: &[(&str, Finding)], config: &Config) -> CheckSheet {
        let examined =
            |(name, finding): &(&str, Finding)| Examined { name: (*name).to_owned(), finding: finding.clone() };
        CheckSheet {
            at: "2026-11-26T17:00:00Z".to_owned(),
            config_file: Some("<night>.toml".into()),
            config_sum: sum(config),
            plan: "5 benches".to_owned(),
            machine: Machine::read(),
            versions: "bench-dragon".to_owned(),
            examination: Examination::new(findings.iter().map(examined).collect(), Vec::new()),
        }
    }

    #[test]
    fn a_sheet_comes_back_from_its_folder_and_a_folder_without_one_has_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let config = Config::from_toml("").expect("valid");
        assert!(CheckSheet::read(folder.path()).expect("readable").is_none());
        let written = sheet(&[("disk", Finding::warning("1 GB", "little", "free some"))], &config);
        let page = written.write(folder.path()).expect("the folder is ours");
        let html = fs::read_to_string(page).expect("a page");
        assert!(
            html.contains("&lt;night&gt;.toml") && html.contains("! warning") && html.contains("free some"),
            "{html}"
        );
        let read = CheckSheet::read(folder.path()).expect("readable").expect("a sheet");
        assert_eq!(read.report("x", None).html(), written.report("x", None).html());
        fs::write(folder.path().join(JSON), "{}").expect("the folder is ours");
        let error = CheckSheet::read(folder.path()).expect_err("it is empty");
        assert!(error.to_string().ends_with("checks.json is no check sheet"), "{error}");
    }

    #[test]
    fn a_show_of_another_configuration_is_named_on_the_sheet() {
        let checked = Config::from_toml("").expect("valid");
        let sheet = sheet(&[("disk", Finding::ok("1 TB", "much"))], &checked);
        let same = sheet.report("x", Some(&checked)).verdict;
        assert_eq!(
            (same.weight, same.words),
            (Weight::Good, "Ready: 0 problems, 0 warnings, 1 ok, 0 not known.".to_owned())
        );
        let other = Config::from_toml("[serve]\nrate_hz = 50\n").expect("valid");
        let verdict = sheet.report("x", Some(&other)).verdict;
        assert_eq!(verdict.weight, Weight::Attention);
        assert!(verdict.words.contains("another configuration"), "{}", verdict.words);
    }

    #[test]
    fn problems_stand_before_warnings() {
        let findings = [("a", Finding::warning("", "slow", "wait")), ("b", Finding::problem("", "broken", "fix"))];
        let sheet = sheet(&findings, &Config::from_toml("").expect("valid"));
        let table = to_settle(&sheet.examination.checks.iter().collect::<Vec<_>>());
        let names: Vec<&str> = table.rows.iter().map(|row| &*row[1]).collect();
        assert_eq!(names, ["b", "a"]);
    }
}
