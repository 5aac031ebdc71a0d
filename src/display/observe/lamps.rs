//! The lamps: the state of each part of a show, as a level and a short text.

use std::collections::BTreeMap;

use bench_dragon_ipc::{ReaderReport, SourceKind, Status, TimecodeState};
use serde::Serialize;

use super::guard_situation::GuardSituation;
use super::snapshot::Snapshot;
use super::snapshot::SourcePresence;

/// Age of a reader's last report, relative to the last frame, above which the reader hangs or was killed. A reader reports
/// about once a second.
const HANGS_NS: u64 = 3_000_000_000;
/// Time after the observer has opened the bus in which no reader counts as missing, since its first report may not have
/// arrived.
const FIRST_REPORTS_NS: u64 = 2_000_000_000;
/// Time until the disk is full, in seconds, below which the recorder's lamp is a warning.
const DISK_WARNING_S: f64 = 600.0;
/// Time until the disk is full, in seconds, below which the recorder's lamp is red.
const DISK_DANGER_S: f64 = 60.0;
/// More than one missed release in this many is a warning, if more than [`FEW_MISSED`] were missed.
const RELEASES_A_MISS: u64 = 1_000;
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
    /// `server`, `source`, `monitor`, `guard`, `recorder`, `psn`, `osc`, `zenoh`, `timecode` or `readers`.
    pub name: &'static str,
    /// How urgent the state is.
    pub level: LampLevel,
    /// The state in a few words.
    pub text: String,
}

impl Lamp {
    fn new(name: &'static str, level: LampLevel, text: impl Into<String>) -> Self {
        Self { name, level, text: text.into() }
    }
}

/// Returns the lamps of a snapshot at an instant of `CLOCK_MONOTONIC`, in nanoseconds: always all ten, in the same order.
pub fn lamps(snapshot: &Snapshot, now_ns: u64) -> Vec<Lamp> {
    let presence = snapshot.presence_at(now_ns);
    let readers = Readers { snapshot, now_ns, is_live: presence == SourcePresence::Live };
    vec![
        server(snapshot, &presence),
        source(snapshot),
        readers.lamp("monitor", "monitor", (LampLevel::Warning, "missing")),
        guard(snapshot, &presence),
        readers.recorder(),
        readers.lamp("psn", "bridge-psn", OPTIONAL),
        readers.lamp("osc", "bridge-osc", OPTIONAL),
        readers.lamp("zenoh", "bridge-zenoh", OPTIONAL),
        timecode(snapshot),
        readers.losing(),
    ]
}

fn server(snapshot: &Snapshot, presence: &SourcePresence) -> Lamp {
    let age_s = presence.age_s().unwrap_or_default();
    let (level, text) = match presence {
        SourcePresence::Live => return live_server(snapshot),
        SourcePresence::Waiting if snapshot.has_source => (LampLevel::Warning, "no frame yet".to_owned()),
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
            let releases = status.tick.saturating_add(overruns);
            if overruns > (releases / RELEASES_A_MISS).max(FEW_MISSED) {
                level = LampLevel::Warning;
            }
        }
    }
    match snapshot.statistics.crashes {
        0 => {}
        1 => (level, text) = (LampLevel::Warning, text + ", restarted once"),
        times => (level, text) = (LampLevel::Warning, format!("{text}, restarted {times} times")),
    }
    Lamp::new("server", level, if text.is_empty() { "frames arrive".to_owned() } else { text })
}

fn source(snapshot: &Snapshot) -> Lamp {
    let kind = snapshot.status.as_deref().and_then(Status::source_kind);
    let (level, text) = match kind {
        None => (LampLevel::Off, "unknown yet"),
        Some(SourceKind::Server) => (LampLevel::Good, "live"),
        Some(SourceKind::Replay) => (LampLevel::Warning, "a replay of a recording"),
        Some(SourceKind::Remote) => (LampLevel::Good, "another host"),
    };
    Lamp::new("source", level, text)
}

fn guard(snapshot: &Snapshot, presence: &SourcePresence) -> Lamp {
    let (level, text) = match snapshot.guard {
        _ if matches!(presence, SourcePresence::Ended { .. }) => return Lamp::new("guard", LampLevel::Off, "ended"),
        GuardSituation::None => return Lamp::new("guard", LampLevel::Off, "not guarded"),
        GuardSituation::Working => (LampLevel::Good, ""),
        GuardSituation::Waiting => (LampLevel::Warning, "the head waits for a grant, "),
        GuardSituation::AtEnd { for_good: true } => (LampLevel::Warning, "stops the head permanently, "),
        GuardSituation::AtEnd { for_good: false } => (LampLevel::Warning, "stops the head, "),
        GuardSituation::Missing => (LampLevel::Danger, "missing, "),
    };
    let margin =
        snapshot.run.as_ref().map(|run| format!("margin {} mm", millimetres(run.config.tables().monitor.margin_m)));
    Lamp::new("guard", level, text.to_owned() + margin.as_deref().unwrap_or("margin unknown"))
}

fn timecode(snapshot: &Snapshot) -> Lamp {
    let lamp = |level, text: &str| Lamp::new("timecode", level, text);
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

/// The lamp of an optional reader that does not run.
const OPTIONAL: (LampLevel, &str) = (LampLevel::Off, "not started");

/// The readers, as their own reports describe them.
struct Readers<'a> {
    snapshot: &'a Snapshot,
    now_ns: u64,
    is_live: bool,
}

impl Readers<'_> {
    fn recorder(&self) -> Lamp {
        let reader = "record";
        let lamp = self.lamp("recorder", reader, OPTIONAL);
        let room_s = self.of_name(reader).filter_map(ReaderReport::room).reduce(f64::min);
        let Some(room_s) = room_s.filter(|_| lamp.level == LampLevel::Good) else { return lamp };
        let level = match room_s {
            _ if room_s < DISK_DANGER_S => LampLevel::Danger,
            _ if room_s < DISK_WARNING_S => LampLevel::Warning,
            _ => LampLevel::Good,
        };
        Lamp { level, text: format!("{} of disk left", long_span(room_s)), ..lamp }
    }

    fn losing(&self) -> Lamp {
        let mut lost: BTreeMap<&str, u64> = BTreeMap::new();
        for report in self.snapshot.readers.awaited().filter(|report| report.lost > 0) {
            *lost.entry(report.name()).or_default() += report.lost;
        }
        if lost.is_empty() {
            let is_known = self.snapshot.readers.awaited().next().is_some();
            let text = if is_known { "no lost frames" } else { "unknown yet" };
            return Lamp::new("readers", if is_known { LampLevel::Good } else { LampLevel::Off }, text);
        }
        let lost: Vec<String> = lost.into_iter().map(|(name, lost)| format!("{} lost {lost}", shown(name))).collect();
        Lamp::new("readers", LampLevel::Warning, lost.join(", "))
    }

    /// Returns the lamp of the readers of a name: of the reader that has been silent for the longest. The lamp is `missing` if
    /// no reader of this name has reported, or all of them have ended.
    fn lamp(&self, name: &'static str, reader: &str, missing: (LampLevel, &'static str)) -> Lamp {
        let Some(sent_ns) = self.of_name(reader).map(|report| report.sent_ns).min() else {
            let since_ns = self.snapshot.reading_since_ns;
            let is_early = since_ns.is_none_or(|since_ns| self.now_ns.saturating_sub(since_ns) < FIRST_REPORTS_NS);
            // Readers report only while frames arrive.
            let (level, text) = if is_early || !self.is_live { (LampLevel::Off, "unknown yet") } else { missing };
            return Lamp::new(name, level, text);
        };
        let published_ns = self.snapshot.header().map_or(0, |header| header.published_ns);
        match published_ns.saturating_sub(sent_ns) {
            0..=HANGS_NS => Lamp::new(name, LampLevel::Good, "runs"),
            age_ns => Lamp::new(name, LampLevel::Danger, format!("silent for {:.0} s", age_ns as f64 * 1e-9)),
        }
    }

    fn of_name(&self, reader: &str) -> impl Iterator<Item = &ReaderReport> {
        self.snapshot.readers.awaited().filter(move |report| report.name() == reader)
    }
}

/// Returns a reader's name with its control characters replaced, since a terminal would execute them.
fn shown(name: &str) -> String {
    name.chars().map(|character| if character.is_control() { '?' } else { character }).collect()
}

/// Converts a length to millimetres, rounded to a micrometre.
fn millimetres(length_m: f64) -> f64 {
    (length_m * 1e6).round() / 1e3
}

/// Formats a duration: seconds below one minute, minutes below one hour, else hours and minutes.
fn long_span(seconds: f64) -> String {
    let minutes = (seconds / 60.0) as u64;
    match minutes {
        0 => format!("{seconds:.0} s"),
        1..60 => format!("{minutes} min"),
        _ => format!("{} h {:02} min", minutes / 60, minutes % 60),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::{FrameHeader, TimecodeKind};

    use super::*;
    use crate::config::Config;
    use crate::display::observe::{DescribedRun, ReaderLog};

    const NOW_NS: u64 = 20_000_000_000;

    fn snapshot(status: &Status, reports: &[ReaderReport]) -> Snapshot {
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

    fn report(name: &str, age_s: u64) -> ReaderReport {
        let mut report = ReaderReport { sent_ns: NOW_NS - age_s * 1_000_000_000, ..ReaderReport::default() };
        report.reader = [name.len() as u64, age_s];
        report.set_name(name);
        report
    }

    #[track_caller]
    fn check(snapshot: &Snapshot, name: &str, level: LampLevel, text: &str) {
        let lamp = lamps(snapshot, NOW_NS).into_iter().find(|lamp| lamp.name == name).expect("a lamp");
        assert_eq!((lamp.level, lamp.text.as_str()), (level, text), "{name}");
    }

    #[test]
    fn a_missing_monitor_is_a_warning_after_the_time_for_first_reports() {
        let no_readers = snapshot(&Status::default(), &[]);
        check(&no_readers, "monitor", LampLevel::Warning, "missing");
        let early = Snapshot { reading_since_ns: Some(NOW_NS - 1_999_999_999), ..no_readers.clone() };
        check(&early, "monitor", LampLevel::Off, "unknown yet");
        check(&no_readers, "psn", LampLevel::Off, "not started");
        let ended = snapshot(&Status::default(), &[ReaderReport { ended: 1, ..report("monitor", 1) }]);
        check(&ended, "monitor", LampLevel::Warning, "missing");
    }

    #[test]
    fn a_reader_that_no_longer_reports_is_red() {
        let runs = snapshot(&Status::default(), &[report("monitor", 3), report("bridge-psn", 0)]);
        check(&runs, "monitor", LampLevel::Good, "runs");
        check(&runs, "psn", LampLevel::Good, "runs");
        let hangs = snapshot(&Status::default(), &[report("monitor", 4)]);
        check(&hangs, "monitor", LampLevel::Danger, "silent for 4 s");
    }

    #[test]
    fn the_recorder_lamp_shows_the_time_until_the_disk_is_full() {
        for (room_s, level, text) in [
            (ReaderReport::NO_ROOM, LampLevel::Good, "runs"),
            (11_100.0, LampLevel::Good, "3 h 05 min of disk left"),
            (599.0, LampLevel::Warning, "9 min of disk left"),
            (59.0, LampLevel::Danger, "59 s of disk left"),
        ] {
            let snapshot = snapshot(&Status::default(), &[ReaderReport { room_s, ..report("record", 1) }]);
            check(&snapshot, "recorder", level, text);
        }
    }

    #[test]
    fn the_readers_lamp_names_readers_that_lose_frames_with_their_counts() {
        let lost = |lost, report: ReaderReport| ReaderReport { lost, ..report };
        let snapshot = snapshot(
            &Status::default(),
            &[
                lost(3, report("hz", 1)),
                ReaderReport { reader: [9, 9], ..lost(4, report("hz", 1)) },
                lost(0, report("echo", 1)),
                lost(2, report("d\u{1b}sk", 1)),
            ],
        );
        check(&snapshot, "readers", LampLevel::Warning, "d?sk lost 2, hz lost 7");
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
        for (tick, overruns, behind_ns, level, text) in [
            (100_000, 0, 0, LampLevel::Good, "1000 Hz"),
            (10, 1, 0, LampLevel::Good, "1000 Hz, 1 overrun"),
            (100_000, 100, 0, LampLevel::Good, "1000 Hz, 100 overruns"),
            (100_000, 101, 0, LampLevel::Warning, "1000 Hz, 101 overruns"),
            (100_000, 0, 1_500_000_000, LampLevel::Warning, "1000 Hz, 1.50 s behind"),
        ] {
            check(&snapshot(&Status { tick, overruns, behind_ns, ..status }, &[]), "server", level, text);
        }
        let mut restarted = snapshot(&status, &[]);
        restarted.statistics.crashes = 1;
        check(&restarted, "server", LampLevel::Warning, "1000 Hz, restarted once");
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
    fn a_duration_has_at_most_two_units() {
        let spans = [0.4, 59.0, 60.0, 3_599.0, 3_600.0].map(long_span);
        assert_eq!(spans, ["0 s", "59 s", "1 min", "59 min", "1 h 00 min"]);
    }
}
