//! The state of a running show, and the summary of one that has ended.

use std::collections::BTreeMap;
use std::path::PathBuf;

use bench_dragon_ipc::{FrameHeader, ShowState};
use jiff::Zoned;
use serde::{Deserialize, Serialize};

use super::{CommandWords, ContactReport, GuardReport};
use crate::display::observe::{
    Arrival, Controls, GuardSituation, Lamp, LampLevel, ShowForecast, Snapshot, SourcePresence, lamps,
};
use crate::output::histogram::Percentiles;

/// The state of a show as one object of JSON, as `ctl status` prints it. An unknown value is null. Metres, seconds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StatusReport {
    /// Whether frames come and no lamp is red.
    pub well: bool,
    /// `live`, `waiting` (no frame yet, or no server), `silent`, `ended`, `gone` or `failed`.
    pub link: &'static str,
    /// What the show is doing: `running`, `stopping`, `paused`, `held`, `finished` or `ended`.
    pub state: Option<&'static str>,
    /// Time on the wall, RFC 3339 with the offset of this machine's time zone.
    pub wall_time: String,
    /// The run's number.
    pub run_id: Option<u64>,
    /// Last tick seen.
    pub tick: Option<u64>,
    /// Show time.
    pub time_s: Option<f64>,
    /// Show seconds a second on the wall.
    pub time_scale: Option<f64>,
    /// Speed of the head in metres a show second.
    pub speed_mps: Option<f64>,
    /// Travel of the head.
    pub travel_m: Option<f64>,
    /// The nearest pair of benches.
    pub nearest: Option<NearestReport>,
    /// What lies ahead.
    pub ahead: ShowForecast,
    /// How it stands with the guard.
    pub guard: GuardSituation,
    /// Each part of the show.
    pub lamps: Vec<Lamp>,
    /// Why each command would be refused; null where it would be accepted.
    pub refusals: Controls,
    /// The newest command.
    pub last_command: Option<CommandWords>,
}

/// Two benches and their clearance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NearestReport {
    /// Negative where they overlap.
    pub clearance_m: f64,
    /// The lower index first.
    pub benches: [usize; 2],
}

impl StatusReport {
    /// The report of a snapshot at an instant of `CLOCK_MONOTONIC`, in nanoseconds, and at this time on the wall.
    pub fn new(snapshot: &Snapshot, now_ns: u64, wall_time: &Zoned) -> Self {
        let (link, lamps) = (snapshot.presence_at(now_ns), lamps(snapshot, now_ns));
        let header = snapshot.header();
        let nearest = snapshot.nearest;
        Self {
            well: link == SourcePresence::Live && lamps.iter().all(|lamp| lamp.level != LampLevel::Danger),
            link: link.name(),
            state: snapshot.state().map(ShowState::name),
            wall_time: wall_time.strftime("%Y-%m-%dT%H:%M:%S%:z").to_string(),
            run_id: header.map(|header| header.run_id),
            tick: header.map(|header| header.tick),
            time_s: header.map(FrameHeader::sim_time_s),
            time_scale: header.map(|header| header.time_scale),
            speed_mps: header.map(|header| header.head_speed_mps),
            travel_m: header.map(|header| header.head_travel_m),
            nearest: nearest.map(|pair| NearestReport { clearance_m: pair.clearance_m, benches: pair.benches }),
            ahead: snapshot.forecast,
            guard: snapshot.guard,
            lamps,
            refusals: Controls::of(snapshot),
            last_command: snapshot.commands.log.latest().next_back().map(|command| CommandWords::from(&command.event)),
        }
    }

    /// The same in lines for people: the show, the clearance, what lies ahead, the newest command, and a line for each lamp.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![self.show_line()];
        if let Some(NearestReport { clearance_m, benches: [one, another] }) = self.nearest {
            let clearance_mm = clearance_m * 1e3;
            lines.push(format!("clearance {clearance_mm:.3} mm, benches {one} and {another}"));
        }
        lines.extend(self.ahead_words().map(|ahead| format!("ahead: {ahead}")));
        lines.extend(self.last_command.as_ref().map(|words| format!("last command: {} {}", words.clock, words.text)));
        let lamp = |lamp: &Lamp| format!("  {:<8} {:<9} {}", lamp.level.name(), lamp.name, lamp.text);
        lines.extend(self.lamps.iter().map(lamp));
        lines
    }

    fn show_line(&self) -> String {
        let clock = self.wall_time.get(11..19).unwrap_or(&self.wall_time);
        let (Some(time_s), Some(time_scale), Some(speed_mps)) = (self.time_s, self.time_scale, self.speed_mps) else {
            return format!("no frames ({}), {clock} on the wall", self.link);
        };
        let state = self.state.unwrap_or("in an unknown state");
        let link = if self.link == SourcePresence::Live.name() { "" } else { self.link };
        let scale = if time_scale == 1.0 { String::new() } else { format!(" at {time_scale} times real time") };
        let link = if link.is_empty() { String::new() } else { format!(" ({link})") };
        format!("{state}{link}, show time {time_s:.3} s{scale}, head at {speed_mps:.3} m/s, {clock} on the wall")
    }

    fn ahead_words(&self) -> Option<String> {
        match self.guard {
            GuardSituation::AtEnd { for_good: true } => {
                return Some("the guard has stopped the head for good: only a seek moves it on".to_owned());
            }
            GuardSituation::AtEnd { for_good: false } => return Some("the guard has stopped the head".to_owned()),
            _ => {}
        }
        let when = |at: Arrival| self.when(at);
        Some(match self.ahead {
            ShowForecast::Unknown => return None,
            ShowForecast::Free { to, is_end: true } => format!("no contact to the end, show time {:.3} s", to.time_s),
            ShowForecast::Free { to, is_end: false } => {
                format!("no contact to show time {:.3} s; the search goes on", to.time_s)
            }
            ShowForecast::Contact { at, benches: [one, another] } => {
                format!("benches {one} and {another} touch {}", when(at))
            }
            ShowForecast::GuardStop { at, benches: Some([one, another]) } => {
                format!("the guard stops the head {}, before benches {one} and {another}", when(at))
            }
            ShowForecast::GuardStop { at, benches: None } if at.wall_s == 0.0 => {
                "no guard runs: the head stands until one does".to_owned()
            }
            ShowForecast::GuardStop { at, benches: None } => {
                format!("no guard runs: the head stands at {:.3} m of travel {}", at.travel_m, when(at))
            }
            ShowForecast::Rest { at } => format!("the head stands at {:.3} m of travel {}", at.travel_m, when(at)),
        })
    }

    /// By the clock on the wall, and in show time.
    fn when(&self, at: Arrival) -> String {
        let walks = [ShowState::Running.name(), ShowState::Stopping.name()];
        let of_walk = if self.state.is_some_and(|state| walks.contains(&state)) { "" } else { " of walking" };
        format!("in {:.1} s{of_walk} (show time {:.3} s)", at.wall_s, at.time_s)
    }
}

/// `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShowSummary {
    /// Number of the last run.
    pub run_id: u64,
    /// Who got how many.
    pub frames: FrameCounts,
    /// First contact, or null.
    pub contact: Option<ContactReport>,
    /// Where the guard held the head for good; null where it did not.
    pub guard: Option<GuardReport>,
    /// From each release to the start of its tick, in microseconds, over all servers of the show.
    pub lateness_us: Percentiles,
    /// From the instant a frame was due to the instant the monitor had read it, in microseconds, over all monitors of the show.
    pub latency_us: Percentiles,
    /// Releases that the server skipped.
    pub overruns: u64,
    /// How far the show was behind the clock at the end, in seconds of wall time.
    pub behind_s: f64,
    /// The furthest that it was behind.
    pub most_behind_s: f64,
    /// Processes that were started again.
    pub restarts: Restarts,
    /// Each process that ended before the show did, oldest first.
    #[serde(default)]
    pub restart_log: Vec<RestartReport>,
    /// The recording; where the recorder was started again, the first one.
    pub recording: PathBuf,
    /// All recordings, oldest first.
    pub recordings: Vec<PathBuf>,
}

/// Frames over the whole show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameCounts {
    /// Published by the server.
    pub published: u64,
    /// Read by the monitor.
    pub monitored: u64,
    /// Written by the recorder.
    pub recorded: u64,
    /// Published and not read by the monitor.
    pub missed_by_monitor: u64,
    /// Published and not written by the recorder.
    pub missed_by_recorder: u64,
}

/// A process that ended before the show did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartReport {
    /// Its name in [`Restarts`].
    pub role: String,
    /// Why it ended: its exit status, the signal, or that it gave no sign of life.
    pub reason: String,
    /// Show time of the last frame before that was noticed; null before the first frame.
    pub show_time_s: Option<f64>,
    /// Wall time at which that was noticed, as RFC 3339 has it, in UTC.
    pub at: String,
    /// Whether it was started again; false where it had ended too often.
    pub restarted: bool,
}

/// How often each process was started again.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restarts {
    /// The server.
    pub serve: u32,
    /// The monitor.
    pub monitor: u32,
    /// The recorder.
    pub record: u32,
    /// The page; absent in what shows without one have said.
    #[serde(default)]
    pub view: u32,
    /// The commands of `[[show.also]]`, each under its own name.
    #[serde(flatten)]
    pub also: BTreeMap<String, u32>,
}

#[cfg(test)]
mod tests {
    use jiff::Timestamp;
    use jiff::tz::TimeZone;

    use super::*;

    fn report(snapshot: &Snapshot) -> StatusReport {
        StatusReport::new(snapshot, snapshot.seen_ns, &Timestamp::UNIX_EPOCH.to_zoned(TimeZone::UTC))
    }

    fn snapshot(state: ShowState) -> Snapshot {
        let header = FrameHeader {
            sim_time_ns: 12_345_000_000,
            head_speed_mps: 1.0,
            time_scale: 5.0,
            state: state.to_wire(),
            ..FrameHeader::default()
        };
        let at = Arrival { travel_m: 412.5, time_s: 412.5, wall_s: 80.0 };
        Snapshot { forecast: ShowForecast::Contact { at, benches: [0, 8] }, ..Snapshot::live(header) }
    }

    #[test]
    fn a_show_is_reported_in_wall_time_with_show_time_beside_it() {
        let running = report(&snapshot(ShowState::Running));
        assert!(running.well);
        let lines = running.lines();
        let first = "running, show time 12.345 s at 5 times real time, head at 1.000 m/s, 00:00:00 on the wall";
        assert_eq!(lines[..2], [first, "ahead: benches 0 and 8 touch in 80.0 s (show time 412.500 s)"]);
        let paused = report(&snapshot(ShowState::Paused)).lines();
        assert_eq!(paused[1], "ahead: benches 0 and 8 touch in 80.0 s of walking (show time 412.500 s)");
    }

    #[test]
    fn without_a_server_nothing_is_well() {
        let nobody = report(&Snapshot::default());
        assert!(!nobody.well);
        let lines = nobody.lines();
        assert_eq!(lines[0], "no frames (waiting), 00:00:00 on the wall");
        assert!(lines.contains(&"  danger   server    no server".to_owned()), "{lines:#?}");
        let json = serde_json::to_value(&nobody).expect("JSON");
        assert_eq!(
            (&json["well"], &json["state"], &json["lamps"][0]["level"]),
            (&false.into(), &().into(), &"danger".into())
        );
    }
}
