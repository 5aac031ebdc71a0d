//! The facts of a report: lateness, machine, versions and configuration.

use super::ReportSource;
use crate::cli::show::summary::ShowSummary;
use crate::output::histogram::Percentiles;
use crate::output::report::{Block, Fact, Table};
use crate::system::machine::Machine;

/// Most lines of the configuration, and most characters of a line.
const MOST_LINES: usize = 300;
const MOST_CHARACTERS: usize = 300;

impl ReportSource<'_> {
    pub(super) fn lateness(&self) -> Vec<Block> {
        let ShowSummary { lateness_us, latency_us, overruns, behind_s, most_behind_s, .. } = self.summary;
        let row = |name: &str, Percentiles { p50, p99, p999, max }: Percentiles| {
            let times = [p50, p99, p999, max].map(|micros| format!("{micros:.1}"));
            std::iter::once(name.to_owned()).chain(times).collect()
        };
        let numbers = vec!["median", "99 %", "99.9 %", "greatest"];
        let table = Table {
            columns: [vec!["in microseconds"], numbers.clone()].concat(),
            numbers,
            rows: vec![
                row("lateness: how late the server began a frame", *lateness_us),
                row("latency: from due until read by the monitor", *latency_us),
            ],
            ..Table::default()
        };
        let behind = format!("{most_behind_s:.3} s behind the clock at most, {behind_s:.3} s at the end");
        let overruns = Fact::new("Overruns", overruns.to_string()).more("frames that the server was too late to send");
        vec![Block::Table(table), Block::Facts(vec![overruns, Fact::new("Pace", behind)])]
    }

    pub(super) fn machine(&self) -> Vec<Fact> {
        let Machine { host, kernel, processors, processor, clock_source } = self.machine;
        let unknown = || "not reported".to_owned();
        let number = processors.map_or_else(unknown, |number| number.to_string());
        vec![
            Fact::new("Host", host),
            Fact::new("Kernel", kernel),
            Fact::new("Processors", number).more(processor.clone().unwrap_or_default()),
            Fact::new("Clock source", clock_source.clone().unwrap_or_else(unknown)),
            Fact::new("Instance", self.instance),
            Fact::new("Folder", self.folder.display().to_string()),
        ]
    }

    pub(super) fn configuration(&self) -> Vec<Block> {
        let file =
            self.config_file.map_or("the paper's dragon, without a file".to_owned(), |file| file.display().to_string());
        let text = self.config.to_toml();
        let (lines, is_whole) = shortened(&text);
        let rest = if is_whole { "" } else { " It is shortened here." };
        let words = format!("From {file}, with the flags of the command line. The whole is config.toml.{rest}");
        vec![Block::Words(words), Block::Text(lines)]
    }
}

pub(super) fn versions() -> Vec<Fact> {
    vec![
        Fact::new("bench-dragon", env!("CARGO_PKG_VERSION")),
        Fact::new("iceoryx2", bench_dragon_ipc::ICEORYX2_VERSION),
    ]
}

/// The first lines of a text, without the ends of very long lines, and whether this is all of it.
fn shortened(text: &str) -> (String, bool) {
    let short = |line: &str| match line.char_indices().nth(MOST_CHARACTERS) {
        Some((end, _)) => format!("{} …", &line[..end]),
        None => line.to_owned(),
    };
    let lines: Vec<String> = text.lines().take(MOST_LINES).map(short).collect();
    let is_whole = lines.iter().map(String::as_str).eq(text.lines());
    (lines.join("\n"), is_whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_of_very_many_or_very_long_lines_is_shortened() {
        assert_eq!(shortened("a = 1\nb = 2\n"), ("a = 1\nb = 2".to_owned(), true));
        let (text, is_whole) = shortened(&"k = \"\u{e9}\"\n".repeat(2 * MOST_LINES));
        assert_eq!((text.lines().count(), is_whole), (MOST_LINES, false));
        let (text, is_whole) = shortened(&"\u{e9}".repeat(2 * MOST_CHARACTERS));
        assert_eq!((text.chars().count(), is_whole), (MOST_CHARACTERS + 2, false));
    }
}
