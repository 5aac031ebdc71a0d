//! What the readers of the bus say of themselves, added up by their names.

use prometheus::proto::MetricFamily;

use super::family::{Label, counters, gauges};
use crate::observe::{ReaderCount, Scene};

/// The metrics of the readers.
pub(super) fn families(scene: &Scene) -> Vec<MetricFamily> {
    let newest_ns = scene.frame.as_ref().map_or(0, |still| still.header.published_ns);
    let samples =
        |value: fn(&ReaderCount) -> u64| scene.readers.counts().map(move |(name, count)| (label(name), value(count)));
    let age_s = |count: &ReaderCount| newest_ns.saturating_sub(count.sent_ns) as f64 / 1e9;
    vec![
        counters(
            "reader_frames_total",
            "Frames that the readers of this name have read.",
            samples(|count| count.frames),
        ),
        counters(
            "reader_lost_frames_total",
            "Frames that were published and that a reader of this name never got.",
            samples(|count| count.lost),
        ),
        counters(
            "reader_restarts_total",
            "Readers of this name that came after the first one, since this process began.",
            samples(|count| count.readers.saturating_sub(1)),
        ),
        gauges(
            "reader_report_age_seconds",
            "How much older the last report of a reader of this name is than the last frame. A reader that keeps up reports \
             once a second.",
            scene.readers.counts().map(|(name, count)| (label(name), age_s(count))),
        ),
        counters(
            "recorder_written_bytes_total",
            "Bytes that the recorders of this name have written.",
            samples(|count| count.bytes_written).filter(|(_, bytes)| *bytes > 0),
        ),
    ]
}

fn label(name: &str) -> Vec<Label<'_>> {
    vec![("reader", name)]
}
