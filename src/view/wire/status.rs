//! How it goes, as a page shows it in numbers.

use bench_dragon_ipc::{Status, TimeHistogram};
use serde::Serialize;

use crate::histogram::Percentiles;
use crate::observe::{ClearanceChart, Link, Outlook, Scene, Traffic};

/// The state of everything but the dragon.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename = "status")]
pub struct StatusMessage<'a> {
    /// Whether there is a source.
    link: LinkReport<'a>,
    /// The frames that arrive.
    traffic: TrafficReport,
    /// The server's account of itself.
    server: Option<ServerReport>,
    /// What lies ahead.
    outlook: Outlook,
    /// The least clearance so far.
    least: Option<LeastReport>,
    /// The clearance so far.
    chart: Option<ChartReport>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct LinkReport<'a> {
    state: &'static str,
    age_s: Option<f64>,
    reason: Option<&'a str>,
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
    rate_hz: u32,
    overruns: u64,
    lateness_us: Percentiles,
    tick_us: Percentiles,
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

impl<'a> StatusMessage<'a> {
    /// What a scene says, its chart as far as it has changed since a revision.
    pub fn of(scene: &'a Scene, chart_revision: u64) -> Self {
        Self {
            link: LinkReport::of(&scene.link),
            traffic: TrafficReport::of(&scene.traffic),
            server: scene.status.as_deref().map(ServerReport::of),
            outlook: scene.outlook,
            least: scene.least.map(|(clearance_m, time_s)| LeastReport { clearance_m, time_s }),
            chart: scene.chart.as_deref().map(|chart| ChartReport::of(chart, chart_revision)),
        }
    }
}

impl<'a> LinkReport<'a> {
    fn of(link: &'a Link) -> Self {
        let reason = if let Link::Failed { reason } = link { Some(reason.as_str()) } else { None };
        Self { state: link.name(), age_s: link.age_ns().map(|age_ns| age_ns as f64 * 1e-9), reason }
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
            rate_hz: status.rate_hz,
            overruns: status.overruns,
            lateness_us: percentiles(&status.lateness),
            tick_us: percentiles(&status.tick_time),
        }
    }
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
        let text = serde_json::to_value(StatusMessage::of(&Scene::default(), 0)).expect("JSON");
        assert_eq!(text["type"], "status");
        assert_eq!(text["link"]["state"], "waiting");
        assert_eq!(text["outlook"]["kind"], "unknown");
        assert!(["server", "least", "chart"].iter().all(|key| text[key].is_null()), "{text}");
    }
}
