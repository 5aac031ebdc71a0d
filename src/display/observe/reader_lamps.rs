//! The lamps of the readers, as their own reports describe them: monitor, recorder and bridges.

use std::collections::BTreeMap;

use bench_dragon_ipc::ReaderReport;

use super::lamps::{Lamp, LampLevel};
use super::snapshot::Snapshot;

/// Names of the monitor, the recorder and a `show` among the readers.
pub(super) const MONITOR: &str = "monitor";
const RECORDER: &str = "record";
pub(super) const SUPERVISOR: &str = "show";
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

/// The lamp of an optional reader that does not run.
pub(super) const OPTIONAL: (LampLevel, &str) = (LampLevel::Off, "not started");

/// The readers, as their own reports describe them.
pub(super) struct Readers<'a> {
    pub(super) snapshot: &'a Snapshot,
    pub(super) now_ns: u64,
    pub(super) is_live: bool,
}

impl Readers<'_> {
    pub(super) fn recorder(&self) -> Lamp {
        if let Some(text) = self.full_disk() {
            return Lamp::new("recorder", LampLevel::Danger, text);
        }
        let lamp = self.lamp("recorder", RECORDER, OPTIONAL);
        let Some(room_s) = room_left(self.snapshot).filter(|_| lamp.level == LampLevel::Good) else { return lamp };
        let level = match room_s {
            _ if room_s < DISK_DANGER_S => LampLevel::Danger,
            _ if room_s < DISK_WARNING_S => LampLevel::Warning,
            _ => LampLevel::Good,
        };
        Lamp { level, text: format!("{} of disk left", long_span(room_s)), ..lamp }
    }

    /// The state of a recorder whose disk is full, in a few words; `None` if no disk is full.
    fn full_disk(&self) -> Option<String> {
        if !has_full_disk(self.snapshot) {
            return None;
        }
        let ended = self.snapshot.readers.newest(RECORDER).filter(|report| report.has_full_disk());
        Some(match ended.zip(self.snapshot.header()) {
            Some((report, header)) => {
                let age_ns = header.published_ns.saturating_sub(report.sent_ns);
                format!("disk full, not recorded for {}", long_span(age_ns as f64 * 1e-9))
            }
            None => "disk full, not recorded".to_owned(),
        })
    }

    pub(super) fn losing(&self) -> Lamp {
        let mut lost: BTreeMap<&str, u64> = BTreeMap::new();
        for report in self.snapshot.readers.awaited().filter(|report| report.lost > 0) {
            *lost.entry(report.name()).or_default() += report.lost;
        }
        if lost.is_empty() {
            let is_known = self.snapshot.readers.awaited().next().is_some();
            let text = if is_known { "no lost frames" } else { "unknown yet" };
            let is_good = is_known && self.is_live;
            return Lamp::new("readers", if is_good { LampLevel::Good } else { LampLevel::Off }, text);
        }
        let lost: Vec<String> = lost.into_iter().map(|(name, lost)| format!("{} lost {lost}", shown(name))).collect();
        Lamp::new("readers", LampLevel::Warning, lost.join(", "))
    }

    /// Returns the lamp of the readers of a name: of the reader that has been silent for the longest. The lamp is `missing` if
    /// no reader of this name has reported, or all of them have ended.
    pub(super) fn lamp(&self, name: &'static str, reader: &str, missing: (LampLevel, &'static str)) -> Lamp {
        let Some(sent_ns) = self.of_name(reader).map(|report| report.sent_ns).min() else {
            let since_ns = self.snapshot.reading_since_ns;
            let is_early = since_ns.is_none_or(|since_ns| self.now_ns.saturating_sub(since_ns) < FIRST_REPORTS_NS);
            // Readers report only while frames arrive.
            let (level, text) = if is_early || !self.is_live { (LampLevel::Off, "unknown yet") } else { missing };
            let unheard = self.snapshot.members.unheard(reader);
            let has_ended = self.snapshot.readers.newest(reader).is_some();
            if let Some(unheard) = unheard.filter(|_| !is_early && self.is_live && !has_ended) {
                return Lamp::new(name, LampLevel::Danger, unheard);
            }
            return Lamp::new(name, level, text);
        };
        let published_ns = self.snapshot.header().map_or(0, |header| header.published_ns);
        match published_ns.saturating_sub(sent_ns) {
            0..=HANGS_NS if !self.is_live => Lamp::new(name, LampLevel::Off, "unknown without frames"),
            0..=HANGS_NS => Lamp::new(name, LampLevel::Good, "runs"),
            age_ns => Lamp::new(name, LampLevel::Danger, format!("silent for {:.0} s", age_ns as f64 * 1e-9)),
        }
    }

    fn of_name(&self, reader: &str) -> impl Iterator<Item = &ReaderReport> {
        self.snapshot.readers.awaited().filter(move |report| report.name() == reader)
    }
}

/// Whether the show is not recorded because a disk is full. The recorder says so in its last report. A `show` whose recorder
/// has ended says so in each of its own reports, until there is room.
pub(super) fn has_full_disk(snapshot: &Snapshot) -> bool {
    let readers = &snapshot.readers;
    let records = readers.awaited().any(|report| report.name() == RECORDER);
    let has_ended = readers.newest(RECORDER).is_some_and(ReaderReport::has_full_disk);
    let waits = readers.awaited().any(|report| report.name() == SUPERVISOR && report.has_full_disk());
    !records && (has_ended || waits)
}

/// Time until the disk of a recorder is full, in seconds; `None` if no recorder reports one.
fn room_left(snapshot: &Snapshot) -> Option<f64> {
    let recorders = snapshot.readers.awaited().filter(|report| report.name() == RECORDER);
    recorders.filter_map(ReaderReport::room).reduce(f64::min)
}

/// Time until the disk of a recorder is full, in seconds, if that is so short that its lamp is red.
pub(super) fn short_room(snapshot: &Snapshot) -> Option<f64> {
    room_left(snapshot).filter(|&room_s| room_s < DISK_DANGER_S)
}

/// Whether the guard has not reported yet: it has just joined, or the observer has just opened the bus. A guard that hangs looks the
/// same.
pub(super) fn is_guard_unknown(snapshot: &Snapshot, now_ns: u64) -> bool {
    let is_guard =
        |report: &ReaderReport| report.name() == MONITOR && snapshot.guard_pid.is_none_or(|guard| guard == report.pid);
    let is_early = |since_ns: u64| now_ns.saturating_sub(since_ns) < FIRST_REPORTS_NS;
    let is_expected = snapshot.guard_pid.is_some() || snapshot.reading_since_ns.is_some_and(is_early);
    is_expected && !snapshot.readers.awaited().any(is_guard)
}

/// How long the guard has been silent, in a few words, if that is so long that it hangs. The guard is part of a monitor. If the
/// guard's process is not known, every monitor has to be silent.
pub(super) fn guard_silence(snapshot: &Snapshot, now_ns: u64) -> Option<String> {
    let is_guard = |pid| snapshot.guard_pid.is_none_or(|guard| guard == pid);
    let is_of_guard = |report: &&ReaderReport| report.name() == MONITOR && is_guard(report.pid);
    let Some(sent_ns) = snapshot.readers.awaited().filter(is_of_guard).map(|report| report.sent_ns).max() else {
        let read_ns = snapshot.reading_since_ns.map_or(0, |since_ns| now_ns.saturating_sub(since_ns));
        let has_ended = snapshot.readers.newest(MONITOR).is_some_and(|newest| is_guard(newest.pid));
        // It joined later than the observer, or was there before.
        let is_late = snapshot.guard_pid.is_some() && now_ns.saturating_sub(snapshot.guarded_since_ns) > HANGS_NS;
        let was_there =
            snapshot.members.living(MONITOR).any(|pid| pid.is_none_or(is_guard)) && read_ns >= FIRST_REPORTS_NS;
        return ((is_late || was_there) && !has_ended).then(|| "it does not report".to_owned());
    };
    let age_ns = snapshot.header()?.published_ns.saturating_sub(sent_ns);
    (age_ns > HANGS_NS).then(|| format!("it has been silent for {:.0} s", age_ns as f64 * 1e-9))
}

/// Returns a reader's name with its control characters replaced, since a terminal would execute them.
fn shown(name: &str) -> String {
    name.chars().map(|character| if character.is_control() { '?' } else { character }).collect()
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
    use bench_dragon_ipc::Status;

    use super::super::lamps::tests::{NOW_NS, check, report, snapshot};
    use super::*;
    use crate::display::observe::SourcePresence;

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
        let runs = snapshot(
            &Status::default(),
            &[report("monitor", 3), report("bridge-psn", 0), report("bridge-timecode", 1)],
        );
        check(&runs, "monitor", LampLevel::Good, "runs");
        check(&runs, "psn", LampLevel::Good, "runs");
        check(&runs, "timecode-out", LampLevel::Good, "runs");
        check(&runs, "timecode", LampLevel::Off, "not followed");
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
    fn a_duration_has_at_most_two_units() {
        let spans = [0.4, 59.0, 60.0, 3_599.0, 3_600.0].map(long_span);
        assert_eq!(spans, ["0 s", "59 s", "1 min", "59 min", "1 h 00 min"]);
    }

    #[test]
    fn a_full_disk_is_red_until_something_is_recorded_again() {
        let full = ReaderReport { ended: ReaderReport::DISK_FULL, room_s: 0.0, ..report("record", 18) };
        let text = "disk full, not recorded for 18 s";
        check(&snapshot(&Status::default(), &[full]), "recorder", LampLevel::Danger, text);
        let again = snapshot(&Status::default(), &[full, report("record", 1)]);
        check(&again, "recorder", LampLevel::Good, "runs");
        let in_order = ReaderReport { ended: 1, ..report("record", 0) };
        let later = snapshot(&Status::default(), &[full, in_order]);
        check(&later, "recorder", LampLevel::Off, "not started");
        // A later observer has not received the recorder's last report.
        let waits = ReaderReport { room_s: 0.0, ..report("show", 1) };
        check(&snapshot(&Status::default(), &[waits]), "recorder", LampLevel::Danger, "disk full, not recorded");
        check(&snapshot(&Status::default(), &[report("show", 1)]), "recorder", LampLevel::Off, "not started");
    }

    #[test]
    fn without_frames_no_reader_is_good() {
        let mut lost = snapshot(&Status::default(), &[report("monitor", 1), report("record", 1)]);
        lost.presence = SourcePresence::Gone { age_ns: NOW_NS };
        for name in ["monitor", "recorder"] {
            check(&lost, name, LampLevel::Off, "unknown without frames");
        }
        check(&lost, "readers", LampLevel::Off, "no lost frames");
    }

    #[test]
    fn a_guard_that_joined_later_and_never_reports_is_silent() {
        let joined =
            Snapshot { guard_pid: Some(7), guarded_since_ns: NOW_NS - HANGS_NS, ..snapshot(&Status::default(), &[]) };
        assert_eq!(guard_silence(&joined, NOW_NS), None);
        assert!(is_guard_unknown(&joined, NOW_NS), "its lamp is not good before its first report");
        let silent = Snapshot { guarded_since_ns: joined.guarded_since_ns - 1, ..joined };
        assert_eq!(guard_silence(&silent, NOW_NS).as_deref(), Some("it does not report"));
        let other =
            Snapshot { readers: snapshot(&Status::default(), &[report("monitor", 1)]).readers, ..silent.clone() };
        assert_eq!(guard_silence(&other, NOW_NS).as_deref(), Some("it does not report"));
        let unguarded = Snapshot { guard_pid: None, ..silent };
        assert_eq!(guard_silence(&unguarded, NOW_NS), None);
    }

    #[test]
    fn a_recorder_that_was_stopped_or_killed_before_the_first_look_is_red() {
        use std::sync::Arc;

        use bench_dragon_ipc::NodeEntry;

        use crate::display::observe::Members;

        let record = || vec![NodeEntry { name: "record".to_owned(), pid: Some(7) }];
        let of = |members, reports: &[ReaderReport]| Snapshot {
            members: Arc::new(members),
            ..snapshot(&Status::default(), reports)
        };
        let stopped = Members { living: record(), ..Members::default() };
        check(&of(stopped.clone(), &[]), "recorder", LampLevel::Danger, "does not report (pid 7)");
        check(&of(stopped, &[report("record", 1)]), "recorder", LampLevel::Good, "runs");
        let killed = Members { dead: record(), ..Members::default() };
        check(&of(killed, &[]), "recorder", LampLevel::Danger, "was killed");
    }
}
