//! The metrics of the bus, the show, the server and the readers.

use bench_dragon_ipc::{DragonMotion, FrameHeader, ShowState};

use super::samples::{Label, counter, counters, gauge, gauges, histogram, one_of};
use crate::config::{Config, FormationDocument};
use crate::display::observe::{GuardSituation, ReaderCount, ShowForecast, Snapshot, SourcePresence, Standing, lamps};

/// Builds the text of several metrics. Each has its help as a doc comment, then its type, its name and its samples.
macro_rules! families {
    ($($(#[doc = $help:literal])+ $kind:ident $name:ident = $samples:expr;)*) => {
        [$($kind(stringify!($name), concat!($($help),+).trim_start(), $samples)),*].concat()
    };
}

/// Returns all metrics of a snapshot at an instant, in nanoseconds of `CLOCK_MONOTONIC`, as text.
pub(super) fn exposition(snapshot: &Snapshot, now_ns: u64) -> String {
    let header = snapshot.header();
    let of_show = [motion(snapshot, header), clearance(snapshot), forecast(snapshot, header), guard(snapshot)].concat();
    [bus(snapshot, header, now_ns), of_show, server(snapshot, header), readers(snapshot, header)].concat()
}

/// Metrics of the bus: presence, lamps, frames that this process has read, and alerts.
fn bus(snapshot: &Snapshot, header: Option<&FrameHeader>, now_ns: u64) -> String {
    let Snapshot { statistics, alerts, .. } = snapshot;
    let age_s = header.map(|header| now_ns.saturating_sub(header.published_ns) as f64 / 1e9);
    let run = header.map(|header| header.run_id.to_string()).unwrap_or_default();
    let is_up = snapshot.presence_at(now_ns) == SourcePresence::Live;
    let levels =
        lamps(snapshot, now_ns).into_iter().map(|lamp| (vec![("lamp", lamp.name)], f64::from(lamp.level as u8)));
    families! {
        /// Version of this program, and the run that it shows, if any. Always 1.
        gauges run_info = [(vec![("version", env!("CARGO_PKG_VERSION")), ("run_id", &run)], 1.0)];
        /// 1 while frames arrive; 0 if there is no source, it has ended, it is silent, or this process no longer reads the bus.
        gauge up = f64::from(u8::from(is_up));
        /// State of each part of the show: 0 off or unknown, 1 good, 2 warning, 3 danger.
        gauges lamp_level = levels;
        /// How the show stands: 0 calm, 1 good, 2 caution, 3 danger.
        gauge standing_level = f64::from(Standing::of(snapshot, now_ns).level as u8);
        /// Age of the last frame.
        gauge last_frame_age_seconds = age_s;
        /// Frames that this process has read.
        counter observed_frames_total = statistics.frames;
        /// Published frames that this process has not received.
        counter observed_lost_frames_total = statistics.lost;
        /// Time from the instant at which a frame was due to the instant at which this process read it. Up to one second old.
        /// The sum uses the middles of narrow buckets.
        histogram frame_latency_seconds = Some(&statistics.latency);
        /// Restarts of the source since this process began.
        counter source_restarts_total = statistics.restarts;
        /// Alerts of the monitors, by kind, since this process began.
        counters alerts_total = alerts.counts().map(|(kind, count)| (vec![("kind", kind.name())], count));
    }
}

/// Metrics of the show's state and motion.
fn motion(snapshot: &Snapshot, header: Option<&FrameHeader>) -> String {
    let names = snapshot.config().and_then(Config::named).map(FormationDocument::dragons);
    let heads = |one: fn(&FrameHeader) -> f64, each: fn(&DragonMotion) -> f64| match (header, names) {
        (None, _) => Vec::new(),
        (Some(header), Some(named)) => {
            let motions = named.iter().zip(header.dragons());
            motions.map(|(named, motion)| (vec![("dragon", &*named.name)], each(motion))).collect()
        }
        // The dragons of a formation have no names until its description has arrived.
        (Some(header), None) if header.is_plan != 0 => Vec::new(),
        (Some(header), None) => vec![(vec![], one(header))],
    };
    let of = |value: fn(&FrameHeader) -> f64| header.map(value);
    let states = header.into_iter().flat_map(|_| ShowState::ALL.map(ShowState::name));
    let state = header.and_then(FrameHeader::show_state).map_or("", ShowState::name);
    families! {
        /// 1 for the current state of the show, 0 for the others.
        gauges show_state = one_of("state", states, state);
        /// Show time of the last frame.
        gauge show_time_seconds = of(FrameHeader::show_time_s);
        /// Show seconds per second of wall time.
        gauge time_scale_ratio = of(|header| header.time_scale);
        /// Speed of the head in metres per show second; 0 while it stands. With several dragons, of each one's head.
        gauges head_speed_meters_per_second = heads(|header| header.head_speed_mps, |dragon| dragon.speed_mps);
        /// Arc length that the head has walked since show time 0. With several dragons, of each one's head.
        gauges head_travel_meters = heads(|header| header.head_travel_m, |dragon| dragon.travel_m);
        /// Benches of all dragons.
        gauge benches = of(|header| header.bench_count.into());
    }
}

/// The situation of the guard, in a guarded show.
fn guard(snapshot: &Snapshot) -> String {
    let all = ["waiting", "working", "at_end", "missing"];
    let names = all.into_iter().filter(|_| snapshot.guard != GuardSituation::None);
    families! {
        /// In a guarded show: 1 for the current situation of the guard, 0 for the others. Missing means that no guard runs.
        gauges guard_situation = one_of("situation", names, snapshot.guard.name());
    }
}

/// Metrics of the clearance, now and so far.
fn clearance(snapshot: &Snapshot) -> String {
    families! {
        /// Clearance of the nearest pair of benches, without neighbours; negative if they overlap.
        gauge clearance_meters = snapshot.nearest.map(|pair| pair.clearance_m);
        /// Least clearance that this process has measured in this show; a restart at the same place continues the show. It
        /// measures some frames per second only; the monitor misses no contact and reports alerts.
        gauge least_clearance_meters = snapshot.least.map(|least| least.clearance_m);
    }
}

/// Metrics of the forecast.
fn forecast(snapshot: &Snapshot, header: Option<&FrameHeader>) -> String {
    let forecast = &snapshot.forecast;
    let contact_s = forecast.contact_s();
    let wall_s = forecast.arrival().map(|at| at.wall_s);
    let free_to = forecast.arrival().filter(|_| matches!(forecast, ShowForecast::Free { .. }));
    families! {
        /// Show time of the next contact, at the present speed; while the head stands, at the speed at which it last walked. No
        /// sample if no contact is known ahead.
        gauge forecast_contact_time_seconds = contact_s;
        /// Show seconds until the next contact.
        gauge forecast_contact_remaining_seconds = contact_s.zip(header).map(|(at_s, header)| at_s - header.show_time_s());
        /// Seconds of wall time until the next contact; while the head stands, from the instant at which it walks on.
        gauge forecast_contact_wall_seconds = wall_s.filter(|_| contact_s.is_some());
        /// Show time of the earliest contact that the play of the hinges allows. No sample without play, or if none is known ahead.
        gauge forecast_possible_contact_time_seconds = snapshot.possible_contact.map(|at| at.time_s);
        /// Seconds of wall time until the guard stops the head; while the head stands, from the instant at which it walks on.
        gauge forecast_guard_stop_wall_seconds = wall_s.filter(|_| matches!(forecast, ShowForecast::GuardStop { .. }));
        /// Show time up to which the absence of contacts is proved, if no contact is known ahead.
        gauge forecast_free_time_seconds = free_to.map(|to| to.time_s);
    }
}

/// Metrics of the server's schedule. The counts begin at 0 with each run.
fn server(snapshot: &Snapshot, header: Option<&FrameHeader>) -> String {
    let status = snapshot.status.as_deref();
    let granted_to_m = status.map(|status| status.granted_to_m).filter(|travel_m| !travel_m.is_nan());
    families! {
        /// Ticks published in this run.
        counter ticks_total = header.map(|header| header.tick + 1);
        /// Periods that were missed in this run.
        counter overruns_total = status.map(|status| status.overruns);
        /// Lag of the show behind the clock, in wall time: the part of standstills that the show still has to make up.
        gauge behind_seconds = status.map(|status| status.behind_ns as f64 * 1e-9);
        /// Configured ticks per second of wall time.
        gauge tick_rate_hertz = status.map(|status| status.rate_hz.into());
        /// Time from the instant at which a tick was due to its start, for all ticks of this run. The sum uses the middles of
        /// narrow buckets.
        histogram tick_lateness_seconds = status.map(|status| &status.lateness);
        /// Time from the start of a tick until the loop was ready for the next one, for all ticks of this run. The sum uses the
        /// middles of narrow buckets.
        histogram tick_duration_seconds = status.map(|status| &status.tick_time);
        /// Travel up to which the guard has granted the head to walk; of several dragons, plan time times the planned speed of
        /// the leading one. No sample if the server is not guarded.
        gauge guard_granted_travel_meters = granted_to_m;
    }
}

/// Metrics from the reports of the bus's readers, summed by name.
fn readers(snapshot: &Snapshot, header: Option<&FrameHeader>) -> String {
    let newest_ns = header.map_or(0, |header| header.published_ns);
    let samples = |value: fn(&ReaderCount) -> u64| {
        snapshot.readers.counts().map(move |(name, count)| (label(name), value(count)))
    };
    let age_s = |sent_ns| newest_ns.saturating_sub(sent_ns) as f64 / 1e9;
    families! {
        /// Frames that the readers of this name have read.
        counters reader_frames_total = samples(|count| count.frames);
        /// Published frames that the readers of this name have not received.
        counters reader_lost_frames_total = samples(|count| count.lost);
        /// Readers of this name that have reported since this process began, one after another or side by side.
        counters readers_seen_total = samples(|count| count.readers);
        /// How much older a reader's last report is than the last frame. For several readers of one name: that of the reader
        /// that has been silent the longest. Readers that have ended in order have none. A reader that keeps up reports once a
        /// second.
        gauges reader_report_age_seconds = snapshot.readers.silent_since().map(|(name, ns)| (label(name), age_s(ns)));
        /// Bytes that the recorders of this name have written.
        counters recorder_written_bytes_total = samples(|count| count.bytes_written).filter(|(_, bytes)| *bytes > 0);
    }
}

fn label(name: &str) -> Vec<Label<'_>> {
    vec![("reader", name)]
}
