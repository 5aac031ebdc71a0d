//! The remedies for a server that is lost or hangs. They continue the show where it stood, and never start another one.

use bench_dragon_ipc::{GuardState, Instance, Status};

use super::reader_lamps::SUPERVISOR;
use super::snapshot::Snapshot;

/// Time in seconds within which `show` restarts a lost server. Later, it has given up.
const RESTARTED_S: f64 = 30.0;
/// Greatest difference in metres between the travel of a frame and that of its show time at the configured speed.
const SAME_TRAVEL_M: f64 = 1e-3;

/// The remedy for a server that is gone, whose last frame is this old.
pub(super) fn remedy_of_lost_server(snapshot: &Snapshot, age_s: f64) -> String {
    if has_show(snapshot) && age_s <= RESTARTED_S {
        return "`show` starts it again, held where the dragon stood: then release.".to_owned();
    }
    let restart = restart(snapshot);
    if snapshot.header().is_none() {
        return format!("`{restart}` starts it again, held. SECONDS and METRES are where the dragon stands.");
    }
    format!("`{restart}` starts it again where the dragon stood, held.")
}

/// The remedy for a server that exists, but publishes nothing.
pub(super) fn remedy_of_hanging_server(snapshot: &Snapshot) -> String {
    if has_show(snapshot) {
        return "`show` starts it again after five seconds, held where the dragon stood: then release.".to_owned();
    }
    let pid = snapshot.status.as_ref().map(|status| status.pid).or(snapshot.members.source);
    let pid = pid.map_or("PID".to_owned(), |pid| pid.to_string());
    format!("Continue it, `kill -CONT {pid}`; or kill it, and `{}` starts it again, held.", restart(snapshot))
}

/// Whether a `show` supervises the server.
pub(super) fn has_show(snapshot: &Snapshot) -> bool {
    let reports = snapshot.readers.awaited().any(|report| report.name() == SUPERVISOR);
    reports && !snapshot.has_lost_show || snapshot.is_supervised
}

/// The command that starts a server where the last frame stood. The configuration's file is not known.
fn restart(snapshot: &Snapshot) -> String {
    let mut words = vec!["bench-dragon serve --config FILE --held".to_owned()];
    if let Some(header) = snapshot.header() {
        let time_s = (header.show_time_s() * 1e3).round() / 1e3;
        words.push(format!("--start-at={time_s}"));
        let speed_mps = snapshot.run.as_ref().map(|run| run.config.tables().head.speed_mps);
        let is_elsewhere =
            speed_mps.is_none_or(|speed_mps| (header.course_m - speed_mps * time_s).abs() > SAME_TRAVEL_M);
        if is_elsewhere {
            words.push(format!("--start-travel={}", (header.course_m * 1e3).round() / 1e3));
        }
    } else {
        words.push("--start-at=SECONDS --start-travel=METRES".to_owned());
    }
    let guard = snapshot.status.as_deref().and_then(Status::guard_state);
    if guard.is_some_and(|guard| guard != GuardState::None) {
        words.push("--guarded".to_owned());
    }
    if snapshot.instance != Instance::default().as_str() {
        words.push(format!("--instance {}", snapshot.instance));
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::{FrameHeader, ReaderReport};

    use super::*;
    use crate::config::Config;
    use crate::display::observe::{DescribedRun, ReaderLog};

    fn at(show_time_ns: i64, course_m: f64, guard: GuardState) -> Snapshot {
        let run = DescribedRun::new(0, Config::load(None, |_| ()).expect("the paper's"));
        let status = Status { guard: guard.to_wire(), pid: 12, ..Status::default() };
        Snapshot {
            instance: "dragon".to_owned(),
            run: Some(Arc::new(run)),
            status: Some(Arc::new(status)),
            ..Snapshot::live(FrameHeader { show_time_ns, course_m, ..FrameHeader::default() })
        }
    }

    #[test]
    fn a_lone_server_is_started_again_where_it_stood_and_held() {
        let of = |snapshot: &Snapshot| remedy_of_lost_server(snapshot, 1.0);
        let lone = at(123_456_700_000, 123.456_7, GuardState::None);
        let expected = "`bench-dragon serve --config FILE --held --start-at=123.457` starts it again where the dragon stood, held.";
        assert_eq!(of(&lone), expected);
        let slowed = Snapshot { instance: "main".to_owned(), ..at(123_456_700_000, 100.0, GuardState::Running) };
        assert!(
            of(&slowed).ends_with("--start-at=123.457 --start-travel=100 --guarded --instance main` starts it again where the dragon stood, held."),
            "{}",
            of(&slowed)
        );
        let hanging = remedy_of_hanging_server(&lone);
        assert!(hanging.starts_with("Continue it, `kill -CONT 12`; or kill it, and `bench"), "{hanging}");
    }

    #[test]
    fn a_show_restarts_its_server_unless_it_has_given_up() {
        let mut readers = ReaderLog::default();
        let mut report = ReaderReport { frames: 1, ..ReaderReport::default() };
        report.set_name(SUPERVISOR);
        readers.push(report);
        let shown = Snapshot { readers: Arc::new(readers), ..at(0, 0.0, GuardState::None) };
        for remedy in [remedy_of_lost_server(&shown, RESTARTED_S), remedy_of_hanging_server(&shown)] {
            assert!(remedy.starts_with("`show` starts it again") && remedy.ends_with("then release."), "{remedy}");
        }
        assert!(remedy_of_lost_server(&shown, RESTARTED_S + 1.0).contains("bench-dragon serve --config FILE --held"));
    }
}
