//! The contents of `report.html`: the summary of a show, as words, tables and pictures.

use std::path::{Path, PathBuf};

use bench_dragon_geometry::number::Fixed;

use super::course::CourseReport;
use super::outcome::{Ending, Outcome, touched};
use super::summary::ShowSummary;
use crate::cli::doctor::CheckSheet;
use crate::cli::monitor::lines::{ClearanceReport, ContactReport};
use crate::config::Config;
use crate::output::report::{Block, Fact, Layout, Report, Section, Verdict, Weight};
use crate::system::machine::Machine;

mod facts;
mod pictures;
mod tables;
mod words;

use facts::versions;
use words::{clock, counts_words, duration, holders, millimetres};

/// All that a report is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReportSource<'a> {
    pub(super) summary: &'a ShowSummary,
    pub(super) config: &'a Config,
    /// The file of the configuration; `None` for the paper's dragon.
    pub(super) config_file: Option<&'a Path>,
    pub(super) folder: &'a Path,
    pub(super) instance: &'a str,
    pub(super) machine: &'a Machine,
    /// The check sheet of the show's folder.
    pub(super) checks: Option<&'a CheckSheet>,
    /// The recordings with their sizes in bytes.
    pub(super) recordings: &'a [(PathBuf, Option<u64>)],
}

impl ReportSource<'_> {
    pub(super) fn report(&self) -> Report {
        let CourseReport { begin, end, .. } = self.summary.course;
        let (from, to) = (begin.local(), end.local());
        let has_one_day = from.date() == to.date();
        let to_words = to.strftime(if has_one_day { "%H:%M:%S" } else { "%A, %-d %B %Y, %H:%M:%S" });
        let zone = to.strftime("%Z, UTC%:z");
        Report {
            kind: "Report of a show".to_owned(),
            title: self.name(),
            subtitle: format!("{}, {} to {to_words} ({zone})", from.strftime("%A, %-d %B %Y"), clock(&from)),
            verdict: self.verdict(),
            sections: [
                Section { blocks: vec![Block::Tiles(self.tiles())], ..Section::default() },
                section("Nearest approach", self.nearest()),
                section("Cues", self.cues()),
                section("Holds", vec![Block::Table(self.holds())]),
                section("Restarts", vec![Block::Table(self.restarts())]),
                section("Recordings", vec![Block::Table(self.recordings())]),
                Section { begins_page: true, ..section("Timeline", vec![self.timeline()]) },
                section("Alerts", self.alerts()),
                section("Commands", vec![Block::Table(self.commands())]),
                section("Lateness", self.lateness()),
                section("Machine", vec![Block::Facts(self.machine())]),
                section("Versions", vec![Block::Facts(versions())]),
                section("Configuration", self.configuration()),
            ]
            .into_iter()
            .filter(|section| !section.blocks.is_empty())
            .collect(),
            layout: Layout::Pages,
            cover: self.checks.map(|checks| Box::new(checks.report(&self.name(), Some(self.config)))),
        }
    }

    /// The name of the show: that of its folder.
    fn name(&self) -> String {
        let name = self.folder.file_name().unwrap_or(self.folder.as_os_str());
        name.to_string_lossy().into_owned()
    }

    fn verdict(&self) -> Verdict {
        let ShowSummary { outcome, contact, restart_log, .. } = self.summary;
        let ending = outcome.as_ref().map(|outcome| &outcome.ending);
        let mut words = outcome.as_ref().map_or_else(String::new, |Outcome { text, .. }| text.clone());
        if let (Some(contact), false) = (contact, matches!(ending, Some(Ending::Contact(_)))) {
            words = format!("{words} {}", touched(contact));
        }
        let has_failed = matches!(ending, Some(Ending::Failed { .. }));
        let mut missing: Vec<&str> = restart_log.iter().filter(|end| !end.restarted).map(|end| &*end.role).collect();
        missing.dedup();
        if !missing.is_empty() && !has_failed {
            words = format!("{words} It played in part without {}.", missing.join(", "));
        }
        let weight = if has_failed || contact.is_some() {
            Weight::Danger
        } else if !missing.is_empty() || matches!(ending, Some(Ending::Guard { .. } | Ending::ServerEnded)) {
            Weight::Attention
        } else {
            Weight::Good
        };
        Verdict { weight, words }
    }

    fn tiles(&self) -> Vec<Fact> {
        let ShowSummary { course, frames, restart_log, contact, .. } = self.summary;
        let CourseReport { begin, end, least_clearance, holds, holds_left_out, alert_counts, .. } = course;
        let lost = frames.missed_by_monitor + frames.missed_by_recorder;
        let lost_by =
            format!("{} by the monitor, {} by the recorder", frames.missed_by_monitor, frames.missed_by_recorder);
        let alerts: u64 = alert_counts.values().sum();
        let least = least_clearance.as_ref().map(|least| &least.pair);
        vec![
            Fact::new("Began", clock(&begin.local())).more(begin.local().strftime("%-d %B %Y").to_string()),
            Fact::new("Ended", clock(&end.local())).more(format!("after {}", duration(end.seconds_since(*begin)))),
            Fact::new("Least clearance", least.map_or("not measured".to_owned(), |pair| millimetres(pair.clearance_m)))
                .more(least.map_or_else(String::new, ClearanceReport::who))
                .weighs(Weight::Danger, least.is_some_and(|pair| pair.clearance_m <= 0.0)),
            Fact::new(
                "First contact",
                contact.as_ref().map_or("none".to_owned(), |contact| format!("{} s", Fixed::<3>(contact.time_s))),
            )
            .more(contact.as_ref().map_or_else(String::new, ContactReport::who))
            .weighs(Weight::Danger, contact.is_some()),
            Fact::new("Holds", (holds.len() as u64 + holds_left_out).to_string())
                .more(holders(course))
                .weighs(Weight::Attention, !holds.is_empty()),
            Fact::new("Processes restarted", restart_log.iter().filter(|end| end.restarted).count().to_string())
                .weighs(Weight::Attention, !restart_log.is_empty()),
            Fact::new("Frames lost", format!("{lost} of {}", frames.published))
                .more(lost_by)
                .weighs(Weight::Attention, lost > 0),
            Fact::new("Alerts", alerts.to_string()).more(counts_words(course)),
        ]
    }
}

fn section(heading: &str, blocks: Vec<Block>) -> Section {
    Section { heading: heading.to_owned(), begins_page: false, blocks }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::show::summary::RestartReport;

    fn report(summary: &ShowSummary) -> Report {
        let machine = Machine {
            host: "<host>".to_owned(),
            kernel: "Linux".to_owned(),
            processors: Some(2),
            processor: None,
            clock_source: None,
        };
        let source = ReportSource {
            summary,
            config: &Config::from_toml("[dragon]\nbenches = 5\n").expect("valid"),
            config_file: Some(Path::new("<config>.toml")),
            folder: Path::new("/shows/<night>"),
            instance: "dragon",
            machine: &machine,
            checks: None,
            recordings: &[(PathBuf::from("<file>.mcap"), Some(1_234_567))],
        };
        source.report()
    }

    fn ended(ending: Ending) -> ShowSummary {
        ShowSummary { outcome: Some(ending.into()), ..ShowSummary::default() }
    }

    #[test]
    fn a_show_of_which_nothing_is_known_has_a_report_with_escaped_names() {
        let report = report(&ended(Ending::ServerEnded));
        assert_eq!(report.title, "<night>");
        let html = report.html();
        for name in ["night", "host", "config", "file"] {
            assert!(
                html.contains(&format!("&lt;{name}&gt;")) && !html.contains(&format!("<{name}>")),
                "{name}: {html}"
            );
        }
        for words in ["No monitor has measured a frame.", "No process ended early.", "There was no command.", "1.2 MB"]
        {
            assert!(html.contains(words), "{words}: {html}");
        }
    }

    #[test]
    fn the_verdict_weighs_a_contact_and_a_missing_process() {
        let verdict = |summary: &ShowSummary| report(summary).verdict;
        let stopped = ended(Ending::Signal { signal: "Ctrl-C" });
        assert_eq!(verdict(&stopped).weight, Weight::Good);
        assert_eq!(
            verdict(&ended(Ending::Guard { held_at_s: 1.0, is_margin_kept: true, border: None })).weight,
            Weight::Attention
        );

        let contact = Some(ContactReport { time_s: 7.25, benches: [0, 8], named: None });
        let touched = verdict(&ShowSummary { contact: contact.clone(), ..stopped.clone() });
        assert_eq!(touched.weight, Weight::Danger);
        assert!(touched.words.ends_with(" Benches 0 and 8 touched at 7.250000 s."), "{}", touched.words);
        let ending = Ending::Contact(contact.clone().expect("a contact"));
        let touched = verdict(&ShowSummary { contact, ..ended(ending) });
        assert_eq!(touched.words.matches("touched").count(), 1, "{}", touched.words);

        let end = |restarted: bool| RestartReport {
            role: "record".to_owned(),
            reason: "exit status: 4".to_owned(),
            show_time_s: None,
            at: String::new(),
            restarted,
        };
        let restarted = verdict(&ShowSummary { restart_log: vec![end(true)], ..stopped.clone() });
        assert_eq!(restarted.weight, Weight::Good);
        let missing = verdict(&ShowSummary { restart_log: vec![end(true), end(false)], ..stopped });
        assert_eq!(missing.weight, Weight::Attention);
        assert!(missing.words.ends_with(" It played in part without record."), "{}", missing.words);
    }
}
