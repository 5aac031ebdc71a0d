//! What the readers of the bus say of themselves, added up by their names.

use prometheus::proto::MetricFamily;

use super::family::{Label, counters, gauges};
use crate::display::observe::{ReaderCount, Scene};

/// The metrics of the readers.
pub(super) fn families(scene: &Scene) -> Vec<MetricFamily> {
    let newest_ns = scene.frame.as_ref().map_or(0, |still| still.header.published_ns);
    let samples =
        |value: fn(&ReaderCount) -> u64| scene.readers.counts().map(move |(name, count)| (label(name), value(count)));
    let age_s = |sent_ns| newest_ns.saturating_sub(sent_ns) as f64 / 1e9;
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
            "readers_seen_total",
            "Readers of this name that were heard of since this process began, one after the other or side by side.",
            samples(|count| count.readers),
        ),
        gauges(
            "reader_report_age_seconds",
            "How much older the last report of a reader of this name is than the last frame; of several, of the one that has \
             been silent for longest. None of those that have ended in order. A reader that keeps up reports once a second.",
            scene.readers.silent_since().map(|(name, sent_ns)| (label(name), age_s(sent_ns))),
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
