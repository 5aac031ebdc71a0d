//! How it goes, as a page shows it in numbers.

use bench_dragon_ipc::{Status, Stops, TimeHistogram};
use serde::Serialize;

use crate::display::observe::{
    ClearanceChart, Controls, GuardSituation, Lamp, Link, Outlook, Scene, Traffic, TravelClock, lamps,
};
use crate::output::histogram::Percentiles;

/// The name of a number that only a newer server knows.
const UNKNOWN: &str = "unknown";

/// The state of everything but the dragon.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename = "status")]
pub struct StatusMessage {
    /// Whether there is a source.
    link: LinkReport,
    /// The frames that arrive.
    traffic: TrafficReport,
    /// The server's account of itself.
    server: Option<ServerReport>,
    /// What lies ahead.
    outlook: Outlook,
    /// What the guard does.
    guard: GuardSituation,
    /// How each part of the show does.
    lamps: Vec<Lamp>,
    /// Why each command would be refused.
    refusals: Controls,
    /// When the head comes to a travel.
    clock: Option<ClockReport>,
    /// The least clearance so far.
    least: Option<LeastReport>,
    /// The clearance so far.
    chart: Option<ChartReport>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct LinkReport {
    state: &'static str,
    age_s: Option<f64>,
    reason: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct TrafficReport {
    rate_hz: f64,
    frames: u64,
    lost: u64,
    restarts: u64,
    latency_us: Percentiles,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
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

/// The head is at this travel at this show time, and walks on at this speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct ClockReport {
    travel_m: f64,
    time_s: f64,
    speed_mps: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct LeastReport {
    clearance_m: f64,
    time_s: f64,
}

/// The stretches of the chart that have changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct ChartReport {
    start_s: f64,
    step_s: f64,
    bins: usize,
    changed: Vec<(usize, f64)>,
}

impl StatusMessage {
    /// What a scene says at an instant, in nanoseconds of `CLOCK_MONOTONIC`, its chart as far as it has changed since a revision.
    pub fn of(scene: &Scene, chart_revision: u64, now_ns: u64) -> Self {
        Self {
            link: LinkReport::of(scene.link_at(now_ns)),
            traffic: TrafficReport::of(&scene.traffic),
            server: scene.status.as_deref().map(ServerReport::of),
            outlook: scene.outlook,
            guard: scene.guard,
            lamps: lamps(scene, now_ns),
            refusals: Controls::of(scene),
            clock: scene.clock.map(|TravelClock { travel_m, time_s, speed_mps }| ClockReport {
                travel_m,
                time_s,
                speed_mps,
            }),
            least: scene.least.map(|(clearance_m, time_s)| LeastReport { clearance_m, time_s }),
            chart: scene.chart.as_deref().map(|chart| ChartReport::of(chart, chart_revision)),
        }
    }
}

impl LinkReport {
    fn of(link: Link) -> Self {
        let (state, age_s) = (link.name(), link.age_ns().map(|age_ns| age_ns as f64 * 1e-9));
        let reason = if let Link::Failed { reason } = link { Some(reason) } else { None };
        Self { state, age_s, reason }
    }
}

impl TrafficReport {
    fn of(traffic: &Traffic) -> Self {
        let Traffic { frames, lost, restarts, rate_hz, .. } = *traffic;
        Self { rate_hz, frames, lost, restarts, latency_us: (&*traffic.recent_latency).into() }
    }
}

impl ServerReport {
    fn of(status: &Status) -> Self {
        let percentiles = |histogram: &TimeHistogram| Percentiles::from(histogram);
        Self {
            tick: status.tick,
            rate_hz: status.rate_hz,
            overruns: status.overruns,
            behind_s: status.behind_ns as f64 * 1e-9,
            lateness_us: percentiles(&status.lateness),
            tick_us: percentiles(&status.tick_time),
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
    fn a_scene_of_nothing_says_that_nothing_is_known() {
        let text = serde_json::to_value(StatusMessage::of(&Scene::default(), 0, 0)).expect("JSON");
        assert_eq!(text["type"], "status");
        assert_eq!(text["link"]["state"], "waiting");
        assert_eq!(text["outlook"]["kind"], "unknown");
        assert!(["server", "least", "chart"].iter().all(|key| text[key].is_null()), "{text}");
    }

    #[test]
    fn a_page_is_told_that_the_observer_stands_still() {
        let scene = Scene { link: Link::Live, ..Scene::of_nothing(5_000_000_000) };
        let link_at =
            |now_ns| serde_json::to_value(StatusMessage::of(&scene, 0, now_ns)).expect("JSON")["link"].clone();
        assert_eq!(link_at(5_900_000_000)["state"], "live");
        let stale = link_at(6_100_000_000);
        assert_eq!((&stale["state"], &stale["reason"]), (&"failed".into(), &"the view's observer stands still".into()));
    }
}
