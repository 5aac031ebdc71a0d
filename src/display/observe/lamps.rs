//! The lamps: the state of each part of a show, as a level and a short text.

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_ipc::{SourceKind, Status, TimecodeState};
use serde::Serialize;

use super::contact::Contact;
use super::described_run::DescribedRun;
use super::guard_situation::GuardSituation;
use super::reader_lamps::{MONITOR, OPTIONAL, Readers, guard_silence, is_guard_unknown};
use super::recent_overruns::RecentOverruns;
use super::snapshot::Snapshot;
use super::snapshot::SourcePresence;

/// More than one missed period in this many, within the last minute, is a warning, if more than [`FEW_MISSED`] were missed.
const PERIODS_A_MISS: u64 = 1_000;
const FEW_MISSED: u64 = 10;

/// How urgent a lamp is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LampLevel {
    /// The part is absent and not required, or its state is still unknown.
    Off,
    /// The part works.
    Good,
    /// The part needs attention.
    Warning,
    /// The part needs action: red.
    Danger,
}

impl LampLevel {
    /// Lower-case name, as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Good => "good",
            Self::Warning => "warning",
            Self::Danger => "danger",
        }
    }
}

/// The state of one part of the show.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Lamp {
    /// `server`, `source`, `clearance`, `monitor`, `guard`, `recorder`, `psn`, `osc`, `zenoh`, `foxglove`, `timecode-out`, `timecode` or
    /// `readers`.
    pub name: &'static str,
    /// How urgent the state is.
    pub level: LampLevel,
    /// The state in a few words.
    pub text: String,
}

impl Lamp {
    pub(super) fn new(name: &'static str, level: LampLevel, text: impl Into<String>) -> Self {
        Self { name, level, text: text.into() }
    }
}

/// Returns the lamps of a snapshot at an instant of `CLOCK_MONOTONIC`, in nanoseconds: always all thirteen, in the same order.
pub fn lamps(snapshot: &Snapshot, now_ns: u64) -> Vec<Lamp> {
    let presence = snapshot.presence_at(now_ns);
    let readers = Readers { snapshot, now_ns, is_live: presence == SourcePresence::Live };
    vec![
        server(snapshot, &presence, now_ns),
        source(snapshot, &presence),
        clearance(snapshot, now_ns, readers.is_live),
        readers.lamp("monitor", MONITOR, (LampLevel::Warning, "missing")),
        guard(snapshot, &presence, now_ns),
        readers.recorder(),
        readers.lamp("psn", "bridge-psn", missing_bridge(snapshot, "psn")),
        readers.lamp("osc", "bridge-osc", missing_bridge(snapshot, "osc")),
        readers.lamp("zenoh", "bridge-zenoh", missing_bridge(snapshot, "zenoh")),
        readers.lamp("foxglove", "bridge-foxglove", missing_bridge(snapshot, "foxglove")),
        readers.lamp("timecode-out", "bridge-timecode", missing_bridge(snapshot, "timecode")),
        timecode(snapshot, &presence),
        readers.losing(),
    ]
}

/// The lamp of a bridge that does not run: red if the supervised show has a command for it.
fn missing_bridge(snapshot: &Snapshot, name: &str) -> (LampLevel, &'static str) {
    let is_configured = |run: &DescribedRun| {
        run.config.also().iter().any(|command| command.split_whitespace().take(2).eq(["bridge", name]))
    };
    let is_wanted = snapshot.is_supervised && snapshot.run.as_deref().is_some_and(is_configured);
    if is_wanted { (LampLevel::Danger, "configured, but does not run") } else { OPTIONAL }
}

fn server(snapshot: &Snapshot, presence: &SourcePresence, now_ns: u64) -> Lamp {
    let is_silent = snapshot.is_silent_from_the_start(now_ns);
    let age_s = presence.age_s().unwrap_or_default();
    let (level, text) = match presence {
        SourcePresence::Live => return live_server(snapshot),
        SourcePresence::Waiting if is_silent => (LampLevel::Danger, "silent".to_owned()),
        SourcePresence::Waiting if snapshot.has_source => (LampLevel::Warning, "no frame yet".to_owned()),
        SourcePresence::Waiting if snapshot.members.has_lost_server() => (LampLevel::Danger, "lost".to_owned()),
        SourcePresence::Waiting => (LampLevel::Danger, "no server".to_owned()),
        SourcePresence::Silent { .. } => (LampLevel::Danger, format!("silent for {age_s:.1} s")),
        SourcePresence::Gone { .. } => (LampLevel::Danger, format!("lost {age_s:.1} s ago")),
        SourcePresence::Ended { .. } => (LampLevel::Off, "ended".to_owned()),
        SourcePresence::Failed { reason } => (LampLevel::Danger, reason.clone()),
    };
    Lamp::new("server", level, text)
}

fn live_server(snapshot: &Snapshot) -> Lamp {
    let (mut level, mut text) = (LampLevel::Good, String::new());
    if let Some(status) = snapshot.status.as_deref() {
        let Status { rate_hz, overruns, behind_ns, .. } = *status;
        text = if rate_hz > 0 { format!("{rate_hz} Hz") } else { "rate unknown".to_owned() };
        if behind_ns > 0 {
            level = LampLevel::Warning;
            text = format!("{text}, {:.2} s behind", behind_ns as f64 * 1e-9);
        }
        if overruns > 0 {
            text = format!("{text}, {overruns} overrun{}", if overruns == 1 { "" } else { "s" });
            let RecentOverruns { missed, periods } = snapshot.recent_overruns;
            if missed > (periods / PERIODS_A_MISS).max(FEW_MISSED) {
                level = LampLevel::Warning;
                text = format!("{text}, {missed} in the last minute");
            }
        }
    }
    // One that began after the restart has counted none.
    match snapshot.statistics.crashes.max(u64::from(snapshot.is_restarted)) {
        0 => {}
        1 => (level, text) = (LampLevel::Warning, text + ", restarted once"),
        times => (level, text) = (LampLevel::Warning, format!("{text}, restarted {times} times")),
    }
    Lamp::new("server", level, if text.is_empty() { "frames arrive".to_owned() } else { text })
}

/// The text of a lamp whose state is unknown, because no frames arrive; `None` while they do.
fn unknown(presence: &SourcePresence) -> Option<&'static str> {
    match presence {
        SourcePresence::Live => None,
        SourcePresence::Waiting => Some("unknown yet"),
        SourcePresence::Ended { .. } => Some("ended"),
        SourcePresence::Silent { .. } | SourcePresence::Gone { .. } | SourcePresence::Failed { .. } => {
            Some("unknown without frames")
        }
    }
}

/// Whether boards touch, or come near. A contact stays red without frames.
fn clearance(snapshot: &Snapshot, now_ns: u64, is_live: bool) -> Lamp {
    let lamp = |level, text: String| Lamp::new("clearance", level, text);
    if let Some(contact) = Contact::of(snapshot, now_ns) {
        return lamp(LampLevel::Danger, contact.words(snapshot));
    }
    let near_m = snapshot.run.as_ref().map_or(0.0, |run| run.config.tables().monitor.near_m);
    match snapshot.nearest.filter(|_| is_live) {
        None => lamp(LampLevel::Off, "unknown".to_owned()),
        Some(PairClearance { clearance_m, benches, .. }) if clearance_m <= near_m => {
            lamp(LampLevel::Warning, format!("{} are near", snapshot.pair_words(benches)))
        }
        Some(_) => lamp(LampLevel::Good, "no near pair".to_owned()),
    }
}

fn source(snapshot: &Snapshot, presence: &SourcePresence) -> Lamp {
    if let Some(text) = unknown(presence) {
        return Lamp::new("source", LampLevel::Off, text);
    }
    let kind = snapshot.status.as_deref().and_then(Status::source_kind);
    let (level, text) = match kind {
        None => (LampLevel::Off, "unknown yet"),
        Some(SourceKind::Server) => (LampLevel::Good, "live"),
        Some(SourceKind::Replay) => (LampLevel::Warning, "a replay of a recording"),
        Some(SourceKind::Remote) => (LampLevel::Good, "another host"),
    };
    Lamp::new("source", level, text)
}

fn guard(snapshot: &Snapshot, presence: &SourcePresence, now_ns: u64) -> Lamp {
    if let Some(text) = unknown(presence) {
        return Lamp::new("guard", LampLevel::Off, text);
    }
    let (level, text) = match snapshot.guard {
        GuardSituation::None => return Lamp::new("guard", LampLevel::Off, "not guarded"),
        GuardSituation::Working | GuardSituation::Waiting if guard_silence(snapshot, now_ns).is_some() => {
            (LampLevel::Danger, "does not answer, ")
        }
        GuardSituation::Working if is_guard_unknown(snapshot, now_ns) => (LampLevel::Off, "unknown yet, "),
        GuardSituation::Working => (LampLevel::Good, ""),
        GuardSituation::Waiting => (LampLevel::Warning, "the head waits for a grant, "),
        GuardSituation::AtEnd { for_good: true } => (LampLevel::Warning, "stops the head permanently, "),
        GuardSituation::AtEnd { for_good: false } => (LampLevel::Warning, "stops the head, "),
        GuardSituation::Missing => (LampLevel::Danger, "missing, "),
    };
    let margin =
        snapshot.run.as_ref().map(|run| format!("margin {} mm", millimetres(run.config.tables().monitor.margin_m)));
    Lamp::new("guard", level, snapshot.spoken(text) + margin.as_deref().unwrap_or("margin unknown"))
}

fn timecode(snapshot: &Snapshot, presence: &SourcePresence) -> Lamp {
    let lamp = |level, text: &str| Lamp::new("timecode", level, text);
    if let Some(text) = unknown(presence) {
        return lamp(LampLevel::Off, text);
    }
    let Some(status) = snapshot.status.as_deref() else { return lamp(LampLevel::Off, "unknown yet") };
    let (level, text) = match status.timecode_state() {
        None | Some(TimecodeState::None) => return lamp(LampLevel::Off, "not followed"),
        Some(TimecodeState::Waiting) => (LampLevel::Warning, "none received yet"),
        Some(TimecodeState::Locked) => (LampLevel::Good, "locked"),
        Some(TimecodeState::Standing) => (LampLevel::Good, "stands still"),
        Some(TimecodeState::Lost) => (LampLevel::Danger, "lost"),
    };
    let protocol = status.timecode_protocol().map_or("unknown", |kind| kind.name());
    lamp(level, &format!("{protocol}, {text}"))
}

/// Converts a length to millimetres, rounded to a micrometre.
fn millimetres(length_m: f64) -> f64 {
    (length_m * 1e6).round() / 1e3
}

#[cfg(test)]
pub(super) mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::{FrameHeader, ReaderReport, TimecodeKind};
    use glam::DVec2;

    use super::*;
    use crate::config::Config;
    use crate::display::observe::{DescribedRun, ReaderLog};

    pub(in super::super) const NOW_NS: u64 = 20_000_000_000;

    pub(in super::super) fn snapshot(status: &Status, reports: &[ReaderReport]) -> Snapshot {
        let header = FrameHeader { published_ns: NOW_NS, ..FrameHeader::default() };
        let mut readers = ReaderLog::default();
        for report in reports {
            readers.push(*report);
        }
        Snapshot {
            seen_ns: NOW_NS,
            has_source: true,
            status: Some(Arc::new(*status)),
            readers: Arc::new(readers),
            reading_since_ns: Some(0),
            ..Snapshot::live(header)
        }
    }

    pub(in super::super) fn report(name: &str, age_s: u64) -> ReaderReport {
        let mut report = ReaderReport { sent_ns: NOW_NS - age_s * 1_000_000_000, ..ReaderReport::default() };
        report.reader = [name.len() as u64, age_s];
        report.set_name(name);
        report
    }

    #[track_caller]
    pub(in super::super) fn check(snapshot: &Snapshot, name: &str, level: LampLevel, text: &str) {
        let lamp = lamps(snapshot, NOW_NS).into_iter().find(|lamp| lamp.name == name).expect("a lamp");
        assert_eq!((lamp.level, lamp.text.as_str()), (level, text), "{name}");
    }

    #[test]
    fn a_missing_guard_is_red_until_the_run_ends() {
        let unguarded = Snapshot { guard: GuardSituation::Missing, ..snapshot(&Status::default(), &[]) };
        check(&unguarded, "guard", LampLevel::Danger, "missing, margin unknown");
        let ended = Snapshot { presence: SourcePresence::Ended { age_ns: 1 }, ..unguarded };
        check(&ended, "guard", LampLevel::Off, "ended");
    }

    #[test]
    fn only_a_server_that_keeps_its_schedule_is_good() {
        let status = Status { rate_hz: 1000, tick: 100_000, ..Status::default() };
        for (overruns, [missed, periods], behind_ns, level, text) in [
            (0, [0, 60_000], 0, LampLevel::Good, "1000 Hz"),
            (1, [1, 10], 0, LampLevel::Good, "1000 Hz, 1 overrun"),
            (500, [60, 60_000], 0, LampLevel::Good, "1000 Hz, 500 overruns"),
            (500, [61, 60_000], 0, LampLevel::Warning, "1000 Hz, 500 overruns, 61 in the last minute"),
            (0, [0, 60_000], 1_500_000_000, LampLevel::Warning, "1000 Hz, 1.50 s behind"),
        ] {
            let snapshot = snapshot(&Status { overruns, behind_ns, ..status }, &[]);
            let recent_overruns = RecentOverruns { missed, periods };
            check(&Snapshot { recent_overruns, ..snapshot }, "server", level, text);
        }
        let mut restarted = snapshot(&status, &[]);
        restarted.statistics.crashes = 1;
        check(&restarted, "server", LampLevel::Warning, "1000 Hz, restarted once");
        let mut begun_later = snapshot(&status, &[]);
        begun_later.is_restarted = true;
        check(&begun_later, "server", LampLevel::Warning, "1000 Hz, restarted once");
        for (presence, level, text) in [
            (SourcePresence::Ended { age_ns: 1 }, LampLevel::Off, "ended"),
            (SourcePresence::Gone { age_ns: 1_200_000_000 }, LampLevel::Danger, "lost 1.2 s ago"),
        ] {
            check(&Snapshot { presence, ..snapshot(&status, &[]) }, "server", level, text);
        }
        check(&Snapshot { seen_ns: NOW_NS, ..Snapshot::default() }, "server", LampLevel::Danger, "no server");
    }

    #[test]
    fn timecode_replay_and_guard_have_their_texts() {
        let status = |timecode: TimecodeState| Status {
            timecode: timecode.to_wire(),
            timecode_kind: TimecodeKind::ArtNet.to_wire(),
            source: SourceKind::Replay.to_wire(),
            ..Status::default()
        };
        let lost = snapshot(&status(TimecodeState::Lost), &[]);
        check(&lost, "timecode", LampLevel::Danger, "Art-Net, lost");
        check(&lost, "source", LampLevel::Warning, "a replay of a recording");
        check(&snapshot(&status(TimecodeState::None), &[]), "timecode", LampLevel::Off, "not followed");
        let run = DescribedRun::new(0, Config::load(None, |_| ()).expect("the paper's"));
        let guarded = Snapshot { guard: GuardSituation::Missing, run: Some(Arc::new(run)), ..lost };
        check(&guarded, "guard", LampLevel::Danger, "missing, margin 0.5 mm");
    }

    #[test]
    fn a_contact_is_red_and_a_near_pair_is_a_warning() {
        let run = DescribedRun::new(0, Config::load(None, |_| ()).expect("the paper's"));
        let mut snapshot = Snapshot { run: Some(Arc::new(run)), ..snapshot(&Status::default(), &[]) };
        check(&snapshot, "clearance", LampLevel::Off, "unknown");
        for (clearance_m, level, text) in [
            (0.021, LampLevel::Good, "no near pair"),
            (0.019, LampLevel::Warning, "benches 0 and 8 are near"),
            (-0.084, LampLevel::Danger, "benches 0 and 8 overlap by 84.0 mm"),
        ] {
            snapshot.nearest = Some(PairClearance { benches: [0, 8], clearance_m, point: DVec2::ZERO });
            check(&snapshot, "clearance", level, text);
        }
        snapshot.presence = SourcePresence::Gone { age_ns: NOW_NS };
        check(&snapshot, "clearance", LampLevel::Danger, "benches 0 and 8 overlap by 84.0 mm");
    }

    #[test]
    fn without_frames_source_guard_and_timecode_are_unknown() {
        let status = Status { timecode: TimecodeState::Locked.to_wire(), ..Status::default() };
        let live = Snapshot { guard: GuardSituation::Working, ..snapshot(&status, &[]) };
        check(&live, "source", LampLevel::Good, "live");
        for (presence, text) in [
            (SourcePresence::Gone { age_ns: 1 }, "unknown without frames"),
            (SourcePresence::Silent { age_ns: 1 }, "unknown without frames"),
            (SourcePresence::Ended { age_ns: 1 }, "ended"),
        ] {
            for name in ["source", "guard", "timecode"] {
                check(&Snapshot { presence: presence.clone(), ..live.clone() }, name, LampLevel::Off, text);
            }
        }
    }
}
