//! The list of alerts, newest first, and the filter of its kinds.

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{Alert, AlertKind, Severity};
use ratatui::text::{Line, Span};

use super::look::{Look, Tone};
use crate::display::observe::Snapshot;

/// A title and the newest alerts that pass the filter, at most `count` lines.
pub(super) fn lines(snapshot: &Snapshot, look: Look, filter: AlertFilter, count: usize) -> Vec<Line<'static>> {
    let total = snapshot.alerts.log.total;
    let count_words = match total {
        0 => "no alerts".to_owned(),
        1 => "1 alert".to_owned(),
        _ => format!("{total} alerts"),
    };
    let title = count_words + &filter.words();
    let (mut lines, mut is_past) = (vec![Line::styled(title, look.theme.faint())], false);
    let listed = snapshot.alerts.log.latest().rev().filter(|numbered| filter.takes(&numbered.event));
    for numbered in listed.take(count) {
        if !is_past && is_of_another_run(&numbered.event, snapshot) {
            is_past = true;
            lines.push(Line::styled("earlier runs", look.theme.faint()));
        }
        lines.push(line(&numbered.event, snapshot, look));
    }
    lines.truncate(count);
    lines
}

/// Only the newest alert that passes the filter.
pub(super) fn newest(snapshot: &Snapshot, look: Look, filter: AlertFilter) -> Option<Line<'static>> {
    let alert = snapshot.alerts.log.latest().rev().find(|numbered| filter.takes(&numbered.event))?.event;
    let mut line = line(&alert, snapshot, look);
    if is_of_another_run(&alert, snapshot) {
        line.push_span(Span::styled("  earlier run", look.theme.faint()));
    }
    Some(line)
}

/// Whether an alert belongs to another run than the shown frame.
fn is_of_another_run(alert: &Alert, snapshot: &Snapshot) -> bool {
    snapshot.header().is_some_and(|header| header.run_id != alert.run_id)
}

fn line(alert: &Alert, snapshot: &Snapshot, look: Look) -> Line<'static> {
    let kind = alert.alert_kind();
    let name = kind.map_or("unknown", AlertKind::name);
    let tone = match kind.map_or(Severity::Caution, AlertKind::severity) {
        Severity::Danger => Tone::Danger,
        Severity::Caution => Tone::Caution,
        Severity::Calm => Tone::Calm,
    };
    let benches = match (alert.pair(), alert.bench()) {
        (Some(pair), _) => format!(" {}", pair_in_short(snapshot, pair)),
        (None, Some(bench)) => format!(" {}", bench_in_short(snapshot, bench)),
        (None, None) => String::new(),
    };
    let is_past = is_of_another_run(alert, snapshot);
    // An alert of an earlier run is no longer urgent.
    let style = if is_past { look.theme.faint() } else { look.theme.text(tone) };
    let line = Line::from(vec![
        Span::raw(format!("{:>9} ", Fixed::<3>(alert.show_time_ns as f64 / 1e9))),
        Span::styled(format!("{name:<9}"), style),
        Span::raw(benches),
    ]);
    if is_past { line.style(look.theme.faint()) } else { line }
}

/// Two benches in few letters: `0-8`, or `gold 3-silver 0`.
pub(super) fn pair_in_short(snapshot: &Snapshot, pair: [u32; 2]) -> String {
    pair.map(|bench| bench_in_short(snapshot, bench)).join("-")
}

fn bench_in_short(snapshot: &Snapshot, bench: u32) -> String {
    snapshot.config().map_or_else(|| bench.to_string(), |config| config.bench_name(bench as usize))
}

/// The filter: all alerts, all but near pairs, or one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum AlertFilter {
    #[default]
    All,
    NotNear,
    Only(AlertKind),
}

impl AlertFilter {
    /// The next filter; after the last one, all alerts. The kinds follow by their urgency.
    pub(super) fn next(self) -> Self {
        let kinds = AlertKind::by_severity().map(Self::Only);
        let mut after =
            [Self::All, Self::NotNear].into_iter().chain(kinds).skip_while(|filter| *filter != self).skip(1);
        after.next().unwrap_or_default()
    }

    pub(super) fn takes(self, alert: &Alert) -> bool {
        match self {
            Self::All => true,
            Self::NotNear => alert.alert_kind() != Some(AlertKind::Near),
            Self::Only(kind) => alert.alert_kind() == Some(kind),
        }
    }

    /// The suffix of the title that describes the filter; empty for all alerts.
    pub(super) fn words(self) -> String {
        match self {
            Self::All => String::new(),
            Self::NotNear => ", without near".to_owned(),
            Self::Only(kind) => format!(", {kind} only"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::ShowState;

    use super::*;
    use crate::display::watch::sample::{drawn, rows, screen_after, snapshot, text_after};
    use crate::safety::monitor::run_alert;

    #[test]
    fn alerts_are_filtered_by_kind() {
        let snapshot = snapshot(ShowState::Running, 300.0);
        let near = |keys| text_after(keys, &snapshot).contains("near      0-11");
        assert_eq!(["", "k", "kk", "kkkkkk", "kkkkkkkkkkkkk"].map(near), [true, false, false, true, true]);
        let without = text_after("k", &snapshot);
        assert!(without.contains("2 alerts, without near") && without.contains("restarted"), "{without}");
    }

    #[test]
    fn alerts_of_earlier_runs_are_marked() {
        let mut snapshot = snapshot(ShowState::Running, 300.0);
        let mut copy = (**snapshot.frame.as_ref().expect("a frame")).clone();
        copy.header.run_id += 1;
        let restarted = run_alert(&copy.header, AlertKind::Restarted);
        snapshot.frame = Some(Arc::new(copy));
        let strip = rows(&drawn(&snapshot, &screen_after(Look::default(), "", &snapshot), 40, 12)).join("\n");
        assert!(strip.contains("near      0-11  earlier run"), "{strip}");
        Arc::make_mut(&mut snapshot.alerts).push(restarted);
        let text = text_after("", &snapshot);
        let at = |word: &str| text.find(word).unwrap_or_else(|| panic!("{word} is missing in\n{text}"));
        let order = ["3 alerts", "restarted", "earlier runs", "near  "].map(at);
        assert!(order.is_sorted(), "{text}");
    }
}
