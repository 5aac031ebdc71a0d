//! The figures beside the plan: clearances, the forecast, and the rates and times of frames.

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::ShowState;
use ratatui::text::{Line, Span};

use super::look::{Glyphs, Look, Tone, strong};
use crate::display::observe::{Arrival, CueList, CueState, GuardSituation, ShowForecast, Snapshot};

/// Six lines: the clearance and its pair, the least clearance so far, and the forecast.
pub(super) fn lines(snapshot: &Snapshot, look: Look) -> Vec<Line<'static>> {
    let [clearance, benches] = nearest(snapshot, look);
    let [least, least_when] = least(snapshot, look);
    let [ahead, ahead_when] = ahead(snapshot, look);
    vec![clearance, benches, least, least_when, ahead, ahead_when]
}

/// Three lines: the clearance and its pair, and the forecast.
pub(super) fn short_lines(snapshot: &Snapshot, look: Look) -> Vec<Line<'static>> {
    let [clearance, benches] = nearest(snapshot, look);
    let [ahead, _] = ahead(snapshot, look);
    vec![clearance, benches, ahead]
}

/// A line with a name and a figure, and a line with a detail.
fn figure(name: &str, value: String, tone: Option<Tone>, detail: &str, look: Look) -> [Line<'static>; 2] {
    let style = tone.map_or(strong(), |tone| look.theme.text(tone));
    let line = Line::from(vec![Span::styled(format!("{name:<10}"), look.theme.faint()), Span::styled(value, style)]);
    let detail = if detail.is_empty() { Line::default() } else { Line::from(format!("{:<10}{detail}", "")) };
    [line, detail]
}

/// How urgent a clearance is.
pub(super) fn tone(clearance_m: f64, near_m: f64) -> Option<Tone> {
    match clearance_m {
        _ if clearance_m <= 0.0 => Some(Tone::Danger),
        _ if clearance_m <= near_m => Some(Tone::Caution),
        _ => None,
    }
}

/// The clearance at and below which a pair is near, in metres.
pub(super) fn near_m(snapshot: &Snapshot) -> f64 {
    snapshot.run.as_ref().map_or(0.0, |run| run.config.tables().monitor.near_m)
}

fn nearest(snapshot: &Snapshot, look: Look) -> [Line<'static>; 2] {
    let known =
        snapshot.nearest.map(|PairClearance { clearance_m, benches, .. }| (clearance_m, snapshot.pair_words(benches)));
    clearance("clearance", known, snapshot, look)
}

fn least(snapshot: &Snapshot, look: Look) -> [Line<'static>; 2] {
    let known = snapshot.least.map(|least| (least.clearance_m, format!("at {} s", Fixed::<3>(least.time_s))));
    clearance("least", known, snapshot, look)
}

fn clearance(name: &str, known: Option<(f64, String)>, snapshot: &Snapshot, look: Look) -> [Line<'static>; 2] {
    let Some((clearance_m, detail)) = known else { return figure(name, "unknown".to_owned(), None, "", look) };
    // To the micrometre.
    figure(name, format!("{} mm", Fixed::<3>(clearance_m * 1e3)), tone(clearance_m, near_m(snapshot)), &detail, look)
}

/// The forecast. If the guard has stopped the head, this takes precedence.
fn ahead(snapshot: &Snapshot, look: Look) -> [Line<'static>; 2] {
    let counted = |at: Arrival| countdown(snapshot, at);
    // The names of dragons leave no room for the time.
    let touching = |at: Arrival, [one, another]: [usize; 2]| match snapshot.named_benches(Some([one, another])) {
        Some(_) => snapshot.pair_words([one, another]),
        None => format!("{one}-{another} at {} s", Fixed::<3>(at.time_s)),
    };
    let standing = |at: Arrival| {
        if snapshot.is_formation() {
            format!("at {} s", Fixed::<1>(at.time_s))
        } else {
            format!("at {} m, {} s", Fixed::<2>(at.travel_m), Fixed::<1>(at.time_s))
        }
    };
    let (good, caution, danger) = (Some(Tone::Good), Some(Tone::Caution), Some(Tone::Danger));
    let has_ended = matches!(snapshot.state(), Some(ShowState::Finished | ShowState::Ended));
    let (name, value, tone, detail) = match (snapshot.guard, snapshot.forecast) {
        (GuardSituation::AtEnd { for_good }, _) => {
            let detail = if for_good { "only a seek moves it" } else { "until timecode moves" };
            ("guard", snapshot.spoken("has stopped the head"), caution, detail.to_owned())
        }
        (_, ShowForecast::Unknown) => {
            let value = if has_ended { "the run has ended" } else { "unknown" };
            ("contact", value.to_owned(), None, String::new())
        }
        (_, ShowForecast::Free { to, is_end: true }) => {
            ("contact", "none ahead".to_owned(), good, format!("to the end, {} s", Fixed::<2>(to.time_s)))
        }
        (_, ShowForecast::Free { to, is_end: false }) => {
            ("contact", "none found yet".to_owned(), None, format!("searched to {} s", Fixed::<2>(to.time_s)))
        }
        (_, ShowForecast::Contact { at, benches }) => ("contact", counted(at), caution, touching(at, benches)),
        (_, ShowForecast::GuardStop { at, benches: Some(benches) }) => {
            ("guard", format!("stops {}", counted(at)), caution, touching(at, benches))
        }
        (_, ShowForecast::GuardStop { at, benches: None }) if at.wall_s == 0.0 => {
            ("guard", "missing".to_owned(), danger, "run monitor --guard".to_owned())
        }
        (_, ShowForecast::GuardStop { at, benches: None }) => {
            ("no guard", format!("stop {}", counted(at)), danger, standing(at))
        }
        (_, ShowForecast::Rest { at }) => ("stop", format!("in {:.1} s", at.wall_s), caution, standing(at)),
    };
    let detail = match snapshot.possible_contact.filter(|_| name == "contact") {
        Some(at) if detail.is_empty() => format!("possible from {} s", Fixed::<3>(at.time_s)),
        Some(at) => format!("{detail}, possible from {} s", Fixed::<3>(at.time_s)),
        None => detail,
    };
    figure(name, value, tone, &detail, look)
}

/// Two lines about the next cue, with its countdown and its note; none for a plan without cues, or after the last one.
pub(super) fn cue_lines(snapshot: &Snapshot, look: Look) -> Vec<Line<'static>> {
    let Some(list) = CueList::of(snapshot) else { return Vec::new() };
    let Some(cue) = list.next_cue() else { return Vec::new() };
    let walks = snapshot.state().is_some_and(ShowState::walks);
    let (value, tone) = match (cue.state, list.next_in_s) {
        (CueState::Waiting, _) => (format!("GO for {}", cue.name), Some(Tone::Caution)),
        (_, Some(wait_s)) if walks => (format!("{} in {wait_s:.1} s", cue.name), None),
        _ => (cue.name.clone(), None),
    };
    figure("cue", value, tone, cue.note.as_deref().unwrap_or_default(), look).into()
}

/// Seconds of wall time until an arrival; for a standing head, seconds of walking.
fn countdown(snapshot: &Snapshot, at: Arrival) -> String {
    let walks = snapshot.state().is_some_and(ShowState::walks);
    if walks { format!("in {:.1} s", at.wall_s) } else { format!("after {:.1} s walking", at.wall_s) }
}

/// Six lines about the received frames and the server's schedule.
pub(super) fn timing_lines(snapshot: &Snapshot, look: Look) -> Vec<Line<'static>> {
    let statistics = &snapshot.statistics;
    let (overruns, behind_ns) = snapshot.status.as_ref().map(|status| (status.overruns, status.behind_ns)).unzip();
    let count = |count: Option<u64>| count.map(|count| (count.to_string(), count > 0));
    let behind = behind_ns.map(|behind_ns| (span(behind_ns, look.glyphs).replace(' ', ""), behind_ns > 0));
    let latency = [0.5, 0.99, 1.0].map(|share| statistics.recent_latency.quantile_ns(share));
    let lateness = snapshot.status.as_ref().map(|it| [it.lateness_p50_ns, it.lateness_p99_ns, it.lateness_max_ns]);
    vec![
        Line::from(vec![
            Span::styled(format!("{:<10}", "frames"), look.theme.faint()),
            Span::styled(format!("{:.1} Hz", statistics.rate_hz), strong()),
        ]),
        troubles([("lost", count(Some(statistics.lost))), ("restarts", count(Some(statistics.restarts)))], look),
        troubles([("overruns", count(overruns)), ("behind", behind)], look),
        Line::styled(format!("{:10}{:>6} {:>6} {:>6}", "", "p50", "p99", "max"), look.theme.faint()),
        row("latency", (statistics.recent_latency.count() > 0).then_some(latency), look),
        row("lateness", lateness, look),
    ]
}

/// A line of figures that should be 0. Each has a flag that is true if it is not.
fn troubles(troubles: [(&'static str, Option<(String, bool)>); 2], look: Look) -> Line<'static> {
    let mut spans = Vec::new();
    for (name, trouble) in troubles {
        let Some((figure, is_bad)) = trouble else { continue };
        let style = if is_bad { look.theme.text(Tone::Caution) } else { strong() };
        spans.push(Span::styled(format!("{name:<10}"), look.theme.faint()));
        spans.push(Span::styled(format!("{figure:<6}"), style));
    }
    Line::from(spans)
}

fn row(name: &'static str, times_ns: Option<[u64; 3]>, look: Look) -> Line<'static> {
    let mut spans = vec![Span::styled(format!("{name:<10}"), look.theme.faint())];
    for time_ns in times_ns.into_iter().flatten() {
        spans.push(Span::raw(format!("{:>6} ", span(time_ns, look.glyphs).replace(' ', ""))));
    }
    Line::from(spans)
}

/// A duration in two or three digits.
pub(super) fn span(time_ns: u64, glyphs: Glyphs) -> String {
    let time_us = time_ns as f64 * 1e-3;
    let micro = glyphs.signs().micro;
    match time_ns {
        0..9_950 => format!("{time_us:.1} {micro}s"),
        9_950..999_500 => format!("{time_us:.0} {micro}s"),
        999_500..9_950_000 => format!("{:.1} ms", time_us * 1e-3),
        9_950_000..999_500_000 => format!("{:.0} ms", time_us * 1e-3),
        _ => format!("{:.1} s", time_us * 1e-6),
    }
}

/// Formats a number without trailing zeros.
pub(super) fn short(value: f64) -> String {
    let text = Fixed::<2>(value).to_string();
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_has_the_unit_with_the_fewest_digits() {
        let times = [0, 3_240, 9_949, 9_950, 120_000, 999_499, 999_500, 12_000_000, 999_499_999, 2_500_000_000];
        let words = times.map(|time_ns| span(time_ns, Glyphs::Ascii));
        let expected =
            ["0.0 us", "3.2 us", "9.9 us", "10 us", "120 us", "999 us", "1.0 ms", "12 ms", "999 ms", "2.5 s"];
        assert_eq!(words, expected);
    }

    #[test]
    fn a_short_number_has_no_trailing_zeros() {
        assert_eq!([1.0, 20.0, 0.5, 1.25, 100.0].map(short), ["1", "20", "0.5", "1.25", "100"]);
    }
}
