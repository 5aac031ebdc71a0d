//! The metrics: of the bus, the show, the server and the readers.

use bench_dragon_ipc::{FrameHeader, ShowState};
use prometheus::proto::MetricFamily;

use super::samples::{Label, counter, counters, gauge, gauges, histogram, one_of};
use crate::display::observe::{GuardSituation, ReaderCount, ShowForecast, Snapshot, SourcePresence, lamps};

/// All metrics of a snapshot at an instant, in nanoseconds of `CLOCK_MONOTONIC`.
pub(super) fn families(snapshot: &Snapshot, now_ns: u64) -> Vec<MetricFamily> {
    let header = snapshot.header();
    let of_bus = bus(snapshot, header, now_ns);
    let of_show = [motion(header), clearance(snapshot), forecast(snapshot, header), guard(snapshot)].concat();
    [of_bus, of_show, server(snapshot, header), readers(snapshot, header)].concat()
}

/// Whether frames come, what this process has read of them, and the alerts.
fn bus(snapshot: &Snapshot, header: Option<&FrameHeader>, now_ns: u64) -> Vec<MetricFamily> {
    let Snapshot { statistics, alerts, .. } = snapshot;
    let age_s = header.map(|header| now_ns.saturating_sub(header.published_ns) as f64 / 1e9);
    let run = header.map(|header| header.run_id.to_string());
    vec![
        gauges(
            "run_info",
            "The version of this program, and the run that it shows, where there is one. Always 1.",
            [(vec![("version", env!("CARGO_PKG_VERSION")), ("run_id", run.as_deref().unwrap_or_default())], 1.0)],
        ),
        gauge(
            "up",
            "1 where frames come, 0 where there is no source, it has ended, or says nothing, or this process looks no more.",
            f64::from(u8::from(snapshot.presence_at(now_ns) == SourcePresence::Live)),
        ),
        gauges(
            "lamp_level",
            "How each part of the show does: 0 off or unknown, 1 good, 2 a warning, 3 danger.",
            lamps(snapshot, now_ns).into_iter().map(|lamp| (vec![("lamp", lamp.name)], f64::from(lamp.level as u8))),
        ),
        gauge("last_frame_age_seconds", "How long ago the last frame was sent.", age_s),
        counter("observed_frames_total", "Frames that this process has read.", statistics.frames),
        counter(
            "observed_lost_frames_total",
            "Frames that were published and that this process never got.",
            statistics.lost,
        ),
        histogram(
            "frame_latency_seconds",
            "From the instant at which a frame was due to the one at which this process read it. A second behind; the sum \
             is taken from the middles of narrow buckets.",
            Some(&statistics.latency),
        ),
        counter(
            "source_restarts_total",
            "How often the source of the frames was started again, since this process began.",
            statistics.restarts,
        ),
        counters(
            "alerts_total",
            "Alerts of the monitors by kind, since this process began.",
            alerts.counts().map(|(kind, count)| (vec![("kind", kind.name())], count)),
        ),
    ]
}

/// Where the show is.
fn motion(header: Option<&FrameHeader>) -> Vec<MetricFamily> {
    let of = |value: fn(&FrameHeader) -> f64| header.map(value);
    let states = header.into_iter().flat_map(|_| ShowState::ALL.map(ShowState::name));
    let state = header.and_then(FrameHeader::show_state).map_or("", ShowState::name);
    vec![
        one_of("show_state", "1 for the state that the show is in, 0 for the others.", "state", states, state),
        gauge("show_time_seconds", "Show time of the last frame.", of(FrameHeader::sim_time_s)),
        gauge("time_scale_ratio", "Show seconds a second of wall time.", of(|header| header.time_scale)),
        gauge(
            "head_speed_meters_per_second",
            "Speed of the head in metres a show second; 0 where it stands.",
            of(|header| header.head_speed_mps),
        ),
        gauge(
            "head_travel_meters",
            "Arc length that the head has walked since show time 0.",
            of(|header| header.head_travel_m),
        ),
        gauge("benches", "Benches of the dragon.", of(|header| header.bench_count.into())),
    ]
}

/// The guard's situation, where a guard is waited for.
fn guard(snapshot: &Snapshot) -> Vec<MetricFamily> {
    let all = ["waiting", "working", "at_end", "missing"];
    let names = all.into_iter().filter(|_| snapshot.guard != GuardSituation::None);
    vec![one_of(
        "guard_situation",
        "1 for what the guard of a guarded show does, 0 for the others; missing where none runs.",
        "situation",
        names,
        snapshot.guard.name(),
    )]
}

/// How near the benches are, and have been.
fn clearance(snapshot: &Snapshot) -> Vec<MetricFamily> {
    vec![
        gauge(
            "clearance_meters",
            "Clearance of the nearest pair of benches, neighbours left out; negative where they overlap.",
            snapshot.nearest.map(|pair| pair.clearance_m),
        ),
        gauge(
            "least_clearance_meters",
            "Least clearance that this process has seen in this show, also before a restart of its server. It looks some times a second; alerts are the monitor's, \
             which misses nothing.",
            snapshot.least.map(|least| least.clearance_m),
        ),
    ]
}

/// What lies ahead.
fn forecast(snapshot: &Snapshot, header: Option<&FrameHeader>) -> Vec<MetricFamily> {
    let contact_s = snapshot.forecast.contact_s();
    let remaining_s = contact_s.zip(header).map(|(contact_s, header)| contact_s - header.sim_time_s());
    let wall_s = snapshot.forecast.arrival().map(|at| at.wall_s);
    let free_s = match snapshot.forecast {
        ShowForecast::Free { to, .. } => Some(to.time_s),
        ShowForecast::Unknown
        | ShowForecast::Contact { .. }
        | ShowForecast::GuardStop { .. }
        | ShowForecast::Rest { .. } => None,
    };
    vec![
        gauge(
            "forecast_contact_time_seconds",
            "Show time of the next contact, at the present speed, or where the head stands, at the one that it last walked at; \
             none where no contact lies ahead, or none is known yet.",
            contact_s,
        ),
        gauge("forecast_contact_remaining_seconds", "Show seconds until the next contact.", remaining_s),
        gauge(
            "forecast_contact_wall_seconds",
            "Seconds of wall time until the next contact; where the head stands, from when it walks on.",
            wall_s.filter(|_| contact_s.is_some()),
        ),
        gauge(
            "forecast_guard_stop_wall_seconds",
            "Seconds of wall time until the guard stops the head; where the head stands, from when it walks on.",
            wall_s.filter(|_| matches!(snapshot.forecast, ShowForecast::GuardStop { .. })),
        ),
        gauge(
            "forecast_free_time_seconds",
            "Show time up to which it is proved that no benches touch, where no contact is known ahead.",
            free_s,
        ),
    ]
}

/// How the server keeps its schedule. Its counts begin anew with each run.
fn server(snapshot: &Snapshot, header: Option<&FrameHeader>) -> Vec<MetricFamily> {
    let status = snapshot.status.as_deref();
    vec![
        counter("ticks_total", "Ticks published in this run.", header.map(|header| header.tick + 1)),
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
            status.map(|status| &status.lateness),
        ),
        histogram(
            "tick_duration_seconds",
            "From the start of a tick until the loop was ready for the next one, of all ticks of this run. The sum is taken \
             from the middles of narrow buckets.",
            status.map(|status| &status.tick_time),
        ),
        gauge(
            "guard_granted_travel_meters",
            "Travel up to which a guard lets the head walk; none for a server that is not guarded.",
            status.map(|status| status.granted_to_m).filter(|travel_m| !travel_m.is_nan()),
        ),
    ]
}

/// What the readers of the bus report of themselves, added up by their names.
fn readers(snapshot: &Snapshot, header: Option<&FrameHeader>) -> Vec<MetricFamily> {
    let newest_ns = header.map_or(0, |header| header.published_ns);
    let samples = |value: fn(&ReaderCount) -> u64| {
        snapshot.readers.counts().map(move |(name, count)| (label(name), value(count)))
    };
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
            snapshot.readers.silent_since().map(|(name, sent_ns)| (label(name), age_s(sent_ns))),
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
