//! Results of the contestants, as figures and as tables.

use std::time::Duration;

use bench_dragon::output::histogram::{LatencyHistogram, Percentiles};
use bench_dragon::output::table::{Cell, Column, Table, text};

use crate::outcome::Outcome;
use crate::setting::Setting;
use crate::shared::{Figures, median};
use crate::transport::BARE;

/// Results of all turns of one contestant in one setting.
pub(crate) struct Scores {
    setting: Setting,
    sent: Latency,
    due: Latency,
    frames: u64,
    lost: u64,
}

/// Latencies that count from one instant.
#[derive(Default)]
struct Latency {
    all: LatencyHistogram,
    /// The median of each turn.
    medians_ns: Vec<f64>,
}

impl Scores {
    pub(crate) fn new(setting: Setting) -> Self {
        Self { setting, sent: Latency::default(), due: Latency::default(), frames: 0, lost: 0 }
    }

    pub(crate) fn setting(&self) -> Setting {
        self.setting
    }

    /// Adds the readers' results of one turn.
    pub(crate) fn add_turn(&mut self, outcomes: Vec<Outcome>) {
        self.lost += outcomes.iter().map(|outcome| outcome.lost).sum::<u64>();
        let (sent, due): (Vec<_>, Vec<_>) =
            outcomes.into_iter().map(|outcome| (outcome.sent_ns, outcome.due_ns)).unzip();
        let (sent, due) = (sent.concat(), due.concat());
        self.frames += sent.len() as u64;
        self.sent.add_turn(&sent);
        self.due.add_turn(&due);
    }
}

impl Latency {
    fn add_turn(&mut self, values_ns: &[u64]) {
        let mut sorted: Vec<f64> = values_ns.iter().map(|&value_ns| value_ns as f64).collect();
        sorted.sort_by(f64::total_cmp);
        assert!(!sorted.is_empty(), "frames arrive in every turn");
        self.medians_ns.push(median(&sorted));
        for &value_ns in values_ns {
            self.all.record(value_ns);
        }
    }

    /// Returns the median ratio. Each ratio divides the medians of two turns with the same number.
    fn ratio_to(&self, other: &Self) -> f64 {
        let mut ratios: Vec<f64> =
            self.medians_ns.iter().zip(&other.medians_ns).map(|(own, other)| own / other).collect();
        ratios.sort_by(f64::total_cmp);
        median(&ratios)
    }
}

/// Prints and writes the figures of all settings, then prints them as tables.
pub(crate) fn report(bench: &'static str, contests: &[Vec<Scores>], took: Duration) {
    let mut figures = Figures::of(bench);
    figures.set("seconds_in_all", took.as_secs_f64());
    for scores in contests.iter().flatten() {
        let Setting { transport, mode, readers } = scores.setting;
        let key = format!("{}_{}_{readers}", transport.name, mode.name());
        for (instant, latency) in [("sent", &scores.sent), ("due", &scores.due)] {
            for (percentile, micros) in named(latency.all.percentiles()) {
                figures.set(&format!("{key}_{instant}_{percentile}_us"), micros);
            }
        }
        figures.set(&format!("{key}_frames"), scores.frames);
        figures.set(&format!("{key}_lost"), scores.lost);
    }
    for contest in contests {
        compare(contest, &mut figures);
    }
    figures.write();
    for contest in contests {
        println!("\n{}", text(&[table(contest)]));
    }
}

/// Sets the ratios: ours to the bare transport, and all others to ours.
fn compare(contest: &[Scores], figures: &mut Figures) {
    let [ours, others @ ..] = contest else { panic!("ours is the first contestant") };
    for other in others {
        let (above, below) = if other.setting.transport.name == BARE.name { (ours, other) } else { (other, ours) };
        let Setting { mode, readers, .. } = ours.setting;
        let names = format!("{}_vs_{}", above.setting.transport.name, below.setting.transport.name);
        let key = |instant: &str| format!("{names}_{}_{readers}_{instant}_p50", mode.name());
        figures.set(&key("sent"), above.sent.ratio_to(&below.sent));
        figures.set(&key("due"), above.due.ratio_to(&below.due));
    }
}

fn table(contest: &[Scores]) -> Table {
    let Setting { mode, readers, .. } = contest[0].setting;
    let instants = ["sent", "due"];
    let mut columns = vec![Column::text("")];
    for instant in instants {
        columns.extend(["p50", "p99", "p99.9", "max"].map(|title| Column::number(format!("{instant} {title}"), 1)));
    }
    columns.push(Column::whole("lost"));
    let name = format!("{}, {readers} readers: \u{b5}s from sent and from due until every handle is read", mode.name());
    let mut table = Table::new(name, columns);
    for scores in contest {
        let mut row = vec![Cell::from(scores.setting.transport.title)];
        for latency in [&scores.sent, &scores.due] {
            row.extend(named(latency.all.percentiles()).map(|(_, micros)| Cell::from(micros)));
        }
        row.push(Cell::Whole(scores.lost));
        table.push(row);
    }
    table
}

fn named(percentiles: Percentiles) -> [(&'static str, f64); 4] {
    let Percentiles { p50, p99, p999, max } = percentiles;
    [("p50", p50), ("p99", p99), ("p999", p999), ("max", max)]
}
