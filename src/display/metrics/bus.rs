//! Whether frames come, what this process has read of them, and the alerts.

use prometheus::proto::MetricFamily;

use super::buckets::distribution;
use super::family::{counter, counters, gauge, gauges, histogram};
use crate::display::observe::{Link, Scene, lamps};

/// The metrics of the bus.
pub(super) fn families(scene: &Scene, now_ns: u64) -> Vec<MetricFamily> {
    let Scene { frame, traffic, alerts, .. } = scene;
    let age_s = frame.as_ref().map(|still| now_ns.saturating_sub(still.header.published_ns) as f64 / 1e9);
    let run = frame.as_ref().map(|still| still.header.run_id.to_string());
    vec![
        gauges(
            "run_info",
            "The version of this program, and the run that it shows, where there is one. Always 1.",
            [(vec![("version", env!("CARGO_PKG_VERSION")), ("run_id", run.as_deref().unwrap_or_default())], 1.0)],
        ),
        gauge(
            "up",
            "1 where frames come, 0 where there is no source, it has ended, or says nothing, or this process looks no more.",
            f64::from(u8::from(scene.link_at(now_ns) == Link::Live)),
        ),
        gauges(
            "lamp_level",
            "How each part of the show does: 0 off or unknown, 1 good, 2 a warning, 3 danger.",
            lamps(scene, now_ns).into_iter().map(|lamp| (vec![("lamp", lamp.name)], f64::from(lamp.level as u8))),
        ),
        gauge("last_frame_age_seconds", "How long ago the last frame was sent.", age_s),
        counter("observed_frames_total", "Frames that this process has read.", traffic.frames),
        counter(
            "observed_lost_frames_total",
            "Frames that were published and that this process never got.",
            traffic.lost,
        ),
        histogram(
            "frame_latency_seconds",
            "From the instant at which a frame was due to the one at which this process read it. A second behind; the sum \
             is taken from the middles of narrow buckets.",
            Some(distribution(&traffic.latency)),
        ),
        counter(
            "source_restarts_total",
            "How often the source of the frames was started again, since this process began.",
            traffic.restarts,
        ),
        counters(
            "alerts_total",
            "Alerts of the monitors by kind, since this process began.",
            alerts.counts().map(|(kind, count)| (vec![("kind", kind.name())], count)),
        ),
    ]
}
