//! How the server keeps its schedule.

use prometheus::proto::MetricFamily;

use super::buckets::distribution;
use super::family::{counter, gauge, histogram};
use crate::display::observe::Scene;

/// The metrics of the server. Its counts begin anew with each run.
pub(super) fn families(scene: &Scene) -> Vec<MetricFamily> {
    let status = scene.status.as_deref();
    vec![
        counter("ticks_total", "Ticks published in this run.", scene.frame.as_ref().map(|still| still.header.tick + 1)),
        counter("overruns_total", "Releases that were missed in this run.", status.map(|status| status.overruns)),
        gauge(
            "behind_seconds",
            "How far the show is behind the clock, in wall time: what is left of standstills, which the show makes up for.",
            status.map(|status| status.behind_ns as f64 * 1e-9),
        ),
        gauge(
            "tick_rate_hertz",
            "Ticks a second of wall time that the source means to publish.",
            status.map(|status| status.rate_hz.into()),
        ),
        histogram(
            "tick_lateness_seconds",
            "From the instant at which a tick was due to its start, of all ticks of this run. The sum is taken from the \
             middles of narrow buckets.",
            status.map(|status| distribution(&status.lateness)),
        ),
        histogram(
            "tick_duration_seconds",
            "From the start of a tick until the loop was ready for the next one, of all ticks of this run. The sum is taken \
             from the middles of narrow buckets.",
            status.map(|status| distribution(&status.tick_time)),
        ),
        gauge(
            "guard_granted_travel_meters",
            "Travel up to which a guard lets the head walk; none for a server that is not guarded.",
            status.map(|status| status.granted_to_m).filter(|travel_m| !travel_m.is_nan()),
        ),
    ]
}
