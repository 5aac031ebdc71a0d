//! The metrics of a show, in the text format of Prometheus.
//!
//! Every request computes the metrics from the newest [`Snapshot`]. Names begin with `bench_dragon_` and end with their unit;
//! names of counts end with `_total`. Values of the server begin anew with each run, which Prometheus treats as the restart of
//! a counter; values of this process begin with the process. An unknown value has no sample. A new metric is an entry in
//! `families`.

mod families;
mod samples;

use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use axum::routing::get;
use tokio::sync::watch;

use self::families::exposition;
use self::samples::TEXT_FORMAT;
use super::observe::Snapshot;
use super::web::{refuse, text};
use crate::system::clock::monotonic_ns;

/// Returns the router of a site with the newest snapshot's metrics at `/metrics`. The page `/` names that address.
pub fn router(snapshots: watch::Receiver<Arc<Snapshot>>) -> Router {
    Router::new()
        .route("/", get(async || text(StatusCode::OK, "text/plain; charset=utf-8", "The metrics are at /metrics\n")))
        .route("/metrics", get(report))
        .fallback(async || refuse(StatusCode::NOT_FOUND, "there is no such page: the metrics are at /metrics"))
        .method_not_allowed_fallback(async || {
            refuse(StatusCode::METHOD_NOT_ALLOWED, "this method is not allowed: use GET")
        })
        .with_state(snapshots)
}

/// Returns the metrics of a snapshot at this instant.
pub fn reply(snapshot: &Snapshot) -> Response {
    text(StatusCode::OK, TEXT_FORMAT, exposition(snapshot, monotonic_ns()))
}

async fn report(State(snapshots): State<watch::Receiver<Arc<Snapshot>>>) -> Response {
    let snapshot = Arc::clone(&snapshots.borrow());
    reply(&snapshot)
}

#[cfg(test)]
mod tests {
    use bench_dragon_geometry::clearance::PairClearance;
    use bench_dragon_ipc::{AlertKind, FrameHeader, ReaderReport, ShowState, Status};
    use glam::DVec2;

    use super::*;
    use crate::display::observe::{
        AlertLog, Arrival, FrameStatistics, GuardSituation, LeastClearance, ReaderLog, ShowForecast,
    };
    use crate::safety::monitor::run_alert;

    fn header() -> FrameHeader {
        FrameHeader {
            run_id: 9_007_199_254_740_991,
            tick: 41,
            show_time_ns: 410_500_000_000,
            published_ns: 5_000_000_000,
            time_scale: 20.0,
            state: ShowState::Held.to_wire(),
            ..FrameHeader::default()
        }
    }

    fn snapshot() -> Snapshot {
        let mut alerts = AlertLog::default();
        alerts.push(run_alert(&header(), AlertKind::Near));
        let mut report =
            ReaderReport { frames: 40, lost: 2, bytes_written: 77, sent_ns: 4_250_000_000, ..Default::default() };
        report.set_name("record \"main\"\\");
        let mut readers = ReaderLog::default();
        readers.push(report);
        let mut status = Status {
            overruns: 3,
            behind_ns: 1_500_000_000,
            rate_hz: 1000,
            granted_to_m: Status::NONE,
            ..Status::default()
        };
        status.lateness.record(60_000);
        Snapshot {
            seen_ns: 5_250_000_000,
            nearest: Some(PairClearance { benches: [0, 8], clearance_m: 0.0125, point: DVec2::ZERO }),
            least: Some(LeastClearance { clearance_m: 0.000_865, time_s: 409.832 }),
            forecast: ShowForecast::Contact {
                at: Arrival { travel_m: 412.5, time_s: 412.5, wall_s: 0.1 },
                benches: [0, 8],
            },
            status: Some(Arc::new(status)),
            statistics: FrameStatistics { frames: 42, restarts: 1, ..FrameStatistics::default() },
            guard: GuardSituation::Missing,
            alerts: Arc::new(alerts),
            readers: Arc::new(readers),
            ..Snapshot::live(header())
        }
    }

    #[test]
    fn a_snapshot_is_reported_in_base_units() {
        let text = exposition(&snapshot(), 5_250_000_000);
        for line in [
            "bench_dragon_run_info{version=\"0.1.0\",run_id=\"9007199254740991\"} 1",
            "bench_dragon_up 1",
            "bench_dragon_standing_level 2",
            "bench_dragon_lamp_level{lamp=\"clearance\"} 1",
            "bench_dragon_last_frame_age_seconds 0.25",
            "bench_dragon_observed_frames_total 42",
            "bench_dragon_source_restarts_total 1",
            "bench_dragon_alerts_total{kind=\"near\"} 1",
            "bench_dragon_alerts_total{kind=\"contact\"} 0",
            "bench_dragon_show_state{state=\"held\"} 1",
            "bench_dragon_show_state{state=\"running\"} 0",
            "bench_dragon_show_time_seconds 410.5",
            "bench_dragon_clearance_meters 0.0125",
            "bench_dragon_least_clearance_meters 0.000865",
            "bench_dragon_forecast_contact_time_seconds 412.5",
            "bench_dragon_forecast_contact_remaining_seconds 2",
            "bench_dragon_forecast_contact_wall_seconds 0.1",
            "bench_dragon_guard_situation{situation=\"missing\"} 1",
            "bench_dragon_guard_situation{situation=\"working\"} 0",
            "bench_dragon_lamp_level{lamp=\"guard\"} 3",
            "bench_dragon_lamp_level{lamp=\"psn\"} 0",
            "bench_dragon_ticks_total 42",
            "bench_dragon_overruns_total 3",
            "bench_dragon_behind_seconds 1.5",
            "bench_dragon_tick_lateness_seconds_bucket{le=\"0.000032767\"} 0",
            "bench_dragon_tick_lateness_seconds_bucket{le=\"0.000065535\"} 1",
            "bench_dragon_tick_lateness_seconds_bucket{le=\"+Inf\"} 1",
            "bench_dragon_tick_lateness_seconds_count 1",
            "bench_dragon_reader_frames_total{reader=\"record \\\"main\\\"\\\\\"} 40",
            "bench_dragon_readers_seen_total{reader=\"record \\\"main\\\"\\\\\"} 1",
            "bench_dragon_reader_report_age_seconds{reader=\"record \\\"main\\\"\\\\\"} 0.75",
            "bench_dragon_recorder_written_bytes_total{reader=\"record \\\"main\\\"\\\\\"} 77",
        ] {
            assert!(text.lines().any(|reported| reported == line), "{line} is not in\n{text}");
        }
    }

    #[test]
    fn an_unknown_value_is_not_reported() {
        let text = exposition(&Snapshot::default(), 5_250_000_000);
        let reported: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
        assert!(reported.contains(&"bench_dragon_up 0"), "{text}");
        for name in
            ["show_", "clearance", "forecast", "ticks", "overruns", "behind", "tick_", "reader", "last_frame", "guard"]
        {
            let name = format!("bench_dragon_{name}");
            assert!(!reported.iter().any(|line| line.starts_with(&name)), "{name} is in\n{text}");
        }
    }

    #[test]
    fn an_old_snapshot_is_not_up() {
        let up_at = |now_ns| exposition(&snapshot(), now_ns).contains("\nbench_dragon_up 1\n");
        assert!(up_at(6_200_000_000));
        assert!(!up_at(6_300_000_000), "the snapshot is too old");
    }

    #[test]
    fn a_reader_that_has_ended_in_order_has_no_age() {
        let mut readers = ReaderLog::default();
        let mut report = ReaderReport { frames: 40, sent_ns: 1_000_000_000, ..Default::default() };
        report.set_name("hz");
        readers.push(report);
        let reported =
            |readers: &ReaderLog| exposition(&Snapshot { readers: Arc::new(readers.clone()), ..snapshot() }, 0);
        assert!(reported(&readers).contains("\nbench_dragon_reader_report_age_seconds{reader=\"hz\"} 4\n"));
        readers.push(ReaderReport { ended: 1, ..report });
        assert!(!reported(&readers).contains("bench_dragon_reader_report_age_seconds"), "{}", reported(&readers));
        assert!(reported(&readers).contains("\nbench_dragon_reader_frames_total{reader=\"hz\"} 40\n"));
    }

    #[test]
    fn every_metric_has_a_help_text_and_a_unique_name() {
        let text = exposition(&snapshot(), 0);
        let kinds: Vec<(&str, &str)> =
            text.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split_once(' ')).collect();
        for (name, kind) in &kinds {
            assert!(text.contains(&format!("# HELP {name} ")), "{name}");
            assert_eq!(name.ends_with("_total"), *kind == "counter", "{name} is a {kind}");
        }
        let mut names: Vec<&str> = kinds.iter().map(|(name, _)| *name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), kinds.len(), "each name is unique");
    }
}
