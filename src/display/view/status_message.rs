//! The status message: everything but the dragon, five times a second.

use bench_dragon_ipc::{Status, Stops};
use serde::Serialize;

use crate::display::observe::{
    ClearanceChart, Controls, FrameStatistics, GuardSituation, Lamp, LeastClearance, ShowForecast, Snapshot,
    SourcePresence, TravelClock, lamps,
};
use crate::output::histogram::Percentiles;

/// The name of a number that only a newer server knows.
const UNKNOWN: &str = "unknown";

/// The state of everything but the dragon.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "status")]
pub(super) struct StatusMessage {
    /// Whether there is a source.
    link: LinkReport,
    /// The frames that arrive.
    traffic: TrafficReport,
    /// The server's account of itself.
    server: Option<ServerReport>,
    /// What lies ahead.
    outlook: ShowForecast,
    /// What the guard does.
    guard: GuardSituation,
    /// How each part of the show does.
    lamps: Vec<Lamp>,
    /// Why each command would be refused.
    refusals: Controls,
    /// When the head comes to a travel.
    clock: Option<TravelClock>,
    /// The least clearance so far.
    least: Option<LeastClearance>,
    /// The clearance so far.
    chart: Option<ChartReport>,
}

#[derive(Debug, Serialize)]
struct LinkReport {
    state: &'static str,
    age_s: Option<f64>,
    reason: Option<String>,
}

#[derive(Debug, Serialize)]
struct TrafficReport {
    rate_hz: f64,
    frames: u64,
    lost: u64,
    restarts: u64,
    latency_us: Percentiles,
}

#[derive(Debug, Serialize)]
struct ServerReport {
    /// The tick that the rest is of.
    tick: u64,
    rate_hz: u32,
    overruns: u64,
    /// How far the show is behind the clock, in seconds of wall time.
    behind_s: f64,
    lateness_us: Percentiles,
    tick_us: Percentiles,
    /// `server`, `replay` or `remote`.
    source: &'static str,
    /// `none`, `waiting`, `locked`, `standing` or `lost`.
    timecode: &'static str,
    /// What keeps the head from walking, or has it brake.
    stops: Vec<&'static str>,
}

/// The stretches of the chart that have changed.
#[derive(Debug, Serialize)]
struct ChartReport {
    start_s: f64,
    step_s: f64,
    bins: usize,
    changed: Vec<(usize, f64)>,
}

impl StatusMessage {
    /// What a snapshot says at an instant, in nanoseconds of `CLOCK_MONOTONIC`, its chart as far as it has changed since a revision.
    pub(super) fn of(snapshot: &Snapshot, chart_revision: u64, now_ns: u64) -> Self {
        Self {
            link: LinkReport::of(snapshot.presence_at(now_ns)),
            traffic: TrafficReport::of(&snapshot.statistics),
            server: snapshot.status.as_deref().map(ServerReport::of),
            outlook: snapshot.forecast,
            guard: snapshot.guard,
            lamps: lamps(snapshot, now_ns),
            refusals: Controls::of(snapshot),
            clock: snapshot.clock,
            least: snapshot.least,
            chart: snapshot.chart.as_deref().map(|chart| ChartReport::of(chart, chart_revision)),
        }
    }
}

impl LinkReport {
    fn of(presence: SourcePresence) -> Self {
        let (state, age_s) = (presence.name(), presence.age_s());
        let reason = if let SourcePresence::Failed { reason } = presence { Some(reason) } else { None };
        Self { state, age_s, reason }
    }
}

impl TrafficReport {
    fn of(statistics: &FrameStatistics) -> Self {
        let FrameStatistics { frames, lost, restarts, rate_hz, .. } = *statistics;
        Self { rate_hz, frames, lost, restarts, latency_us: (&*statistics.recent_latency).into() }
    }
}

impl ServerReport {
    fn of(status: &Status) -> Self {
        Self {
            tick: status.tick,
            rate_hz: status.rate_hz,
            overruns: status.overruns,
            behind_s: status.behind_ns as f64 * 1e-9,
            lateness_us: Percentiles::from(&status.lateness),
            tick_us: Percentiles::from(&status.tick_time),
            source: status.source_kind().map_or(UNKNOWN, |kind| kind.name()),
            timecode: status.timecode_state().map_or(UNKNOWN, |state| state.name()),
            stops: names(status.stops()),
        }
    }
}

/// The stops that hold, by their names.
fn names(stops: Stops) -> Vec<&'static str> {
    let Stops { paused, held, guard_limit, timecode, ending, run_end } = stops;
    let named = [
        (paused, "paused"),
        (held, "held"),
        (guard_limit, "guard_limit"),
        (timecode, "timecode"),
        (ending, "ending"),
        (run_end, "run_end"),
    ];
    named.into_iter().filter_map(|(holds, name)| holds.then_some(name)).collect()
}

impl ChartReport {
    fn of(chart: &ClearanceChart, revision: u64) -> Self {
        Self {
            start_s: chart.start_s(),
            step_s: chart.step_s(),
            bins: chart.least_m().len(),
            changed: chart.since(revision).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_snapshot_of_nothing_says_that_nothing_is_known() {
        let text = serde_json::to_value(StatusMessage::of(&Snapshot::default(), 0, 0)).expect("JSON");
        assert_eq!(text["type"], "status");
        assert_eq!(text["link"]["state"], "waiting");
        assert_eq!(text["outlook"]["kind"], "unknown");
        assert!(["server", "least", "chart"].iter().all(|key| text[key].is_null()), "{text}");
    }

    #[test]
    fn a_page_shows_that_the_observer_stands_still() {
        let snapshot = Snapshot { presence: SourcePresence::Live, ..Snapshot::empty(5_000_000_000) };
        let presence_at =
            |now_ns| serde_json::to_value(StatusMessage::of(&snapshot, 0, now_ns)).expect("JSON")["link"].clone();
        assert_eq!(presence_at(5_900_000_000)["state"], "live");
        let stale = presence_at(6_100_000_000);
        assert_eq!((&stale["state"], &stale["reason"]), (&"failed".into(), &"the view's observer stands still".into()));
    }
}
