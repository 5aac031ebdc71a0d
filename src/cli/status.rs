//! `ctl status`: prints the state of a running show, for people or as one JSON object.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::source::ShowLock;
use bench_dragon_ipc::{Domain, DragonMotion, DragonState, FrameHeader, ShowState};
use jiff::Zoned;
use serde::Serialize;

use crate::cli::flags::Format;
use crate::cli::print::{print_json, print_line};
use crate::config::{NamedBenches, NamedDragon};
use crate::display::observe::{
    Arrival, Controls, GuardSituation, Lamp, LampLevel, Level, Members, Observer, ShowForecast, Snapshot,
    SourcePresence, Standing, lamps,
};
use crate::output::command_words::CommandWords;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// Snapshots per second.
const SNAPSHOTS_HZ: u32 = 20;
/// Time for which the subcommand reads the bus, in nanoseconds. Each reader reports in this time; a monitor that does not is
/// missing.
const LOOK_NS: u64 = 2_050_000_000;
/// Longest wait for a bus, in nanoseconds.
const NO_SERVER_NS: u64 = 500_000_000;
/// Longest duration of the subcommand, in nanoseconds.
const LONGEST_NS: u64 = 4_000_000_000;

/// Prints the status. The exit status is 0 if frames arrive and no lamp is red, else 1.
pub(super) fn run(domain: &Domain, format: Format) -> anyhow::Result<ExitCode> {
    let (stop, began_ns) = (StopFlag::on_signals()?, monotonic_ns());
    let instance = domain.instance().to_string();
    let mut newest = Snapshot { seen_ns: began_ns, instance, ..Snapshot::default() };
    let members = Members::of(domain);
    // Joining the bus of a killed server would remove its remains, so that the next look would not find them.
    if !members.has_lost_server() {
        Observer::new(domain.clone(), "ctl-status", SNAPSHOTS_HZ).run(stop.as_atomic(), |snapshot| {
            if has_seen_enough(&snapshot, members.has_source, began_ns) {
                stop.as_atomic().store(true, Ordering::Relaxed);
            }
            newest = snapshot;
        });
    }
    newest.members = Arc::new(members.still_there(domain));
    newest.is_supervised |= ShowLock::holder(domain).is_some();
    newest.has_lost_show |= !newest.members.has_source && ShowLock::is_abandoned(domain);
    let report = StatusReport::new(&newest, &Zoned::now());
    match format {
        Format::Json => print_json(&report)?,
        Format::Text => report.lines().into_iter().try_for_each(print_line)?,
    }
    Ok(if report.well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Whether to look no longer. On a busy machine the first snapshots come late, and do not know yet of a source that was found before.
fn has_seen_enough(snapshot: &Snapshot, has_found_source: bool, began_ns: u64) -> bool {
    let waited_ns = snapshot.seen_ns.saturating_sub(began_ns);
    let has_source = has_found_source || snapshot.has_source;
    let has_nobody = snapshot.presence == SourcePresence::Waiting && !has_source && waited_ns >= NO_SERVER_NS;
    let has_read =
        snapshot.reading_since_ns.is_some_and(|since_ns| snapshot.seen_ns.saturating_sub(since_ns) >= LOOK_NS);
    has_nobody || waited_ns >= LONGEST_NS || has_read && snapshot.frame.is_some() && snapshot.status.is_some()
}

/// The state of a show, as the JSON object that `ctl status` prints. An unknown value is null. Units are metres and seconds.
#[derive(Serialize)]
struct StatusReport {
    /// Whether frames arrive and no lamp is red.
    well: bool,
    /// `live`, `waiting` (no frame yet, or no server), `silent`, `ended`, `gone` or `failed`.
    link: &'static str,
    /// State of the show: `ready`, `running`, `stopping`, `paused`, `held`, `waiting`, `finished` or `ended`.
    state: Option<&'static str>,
    /// How the show stands: how urgent it is, in a word, its cause, and what to do.
    standing: Standing,
    /// Wall-clock time, RFC 3339 with the offset of this machine's time zone.
    wall_time: String,
    run_id: Option<u64>,
    tick: Option<u64>,
    time_s: Option<f64>,
    /// Show seconds per wall-clock second.
    time_scale: Option<f64>,
    /// Speed of the head in metres per show second.
    speed_mps: Option<f64>,
    travel_m: Option<f64>,
    /// The dragons, if there are several; the two values before are then those of the leading head.
    #[serde(skip_serializing_if = "Option::is_none")]
    dragons: Option<Vec<DragonReport>>,
    nearest: Option<NearestReport>,
    ahead: AheadReport,
    guard: GuardSituation,
    lamps: Vec<Lamp>,
    /// The reason for which each command would be refused; null if it would be accepted.
    refusals: Controls,
    last_command: Option<CommandWords>,
    #[serde(skip)]
    ahead_words: Option<String>,
}

/// Two benches and their clearance.
#[derive(Serialize)]
struct NearestReport {
    /// Clearance in metres, negative if the benches overlap.
    clearance_m: f64,
    benches: [usize; 2],
    /// The dragons of the benches, if there are several.
    #[serde(flatten)]
    named: Option<NamedBenches>,
}

/// The next event, with the dragons of its benches if there are several.
#[derive(Serialize)]
struct AheadReport {
    #[serde(flatten)]
    event: ShowForecast,
    #[serde(flatten)]
    named: Option<NamedBenches>,
}

/// A dragon of several.
#[derive(Serialize)]
struct DragonReport {
    name: String,
    /// `standing`, `walking` or `ended`.
    state: Option<&'static str>,
    travel_m: f64,
    speed_mps: f64,
}

impl DragonReport {
    /// The dragons of a snapshot; `None` without names.
    fn all(snapshot: &Snapshot) -> Option<Vec<Self>> {
        let named = snapshot.config()?.named()?.dragons();
        let report = |(named, motion): (&NamedDragon, &DragonMotion)| Self {
            name: named.name.clone(),
            state: motion.dragon_state().map(DragonState::name),
            travel_m: motion.travel_m,
            speed_mps: motion.speed_mps,
        };
        Some(named.iter().zip(snapshot.header()?.dragons()).map(report).collect())
    }
}

impl StatusReport {
    /// The report of a snapshot at the instant at which it was seen, however long this process has waited for a processor since then.
    fn new(snapshot: &Snapshot, wall_time: &Zoned) -> Self {
        let now_ns = snapshot.seen_ns;
        let (link, lamps) = (snapshot.presence_at(now_ns), lamps(snapshot, now_ns));
        let header = snapshot.header();
        let nearest = snapshot.nearest;
        Self {
            well: link == SourcePresence::Live && lamps.iter().all(|lamp| lamp.level != LampLevel::Danger),
            link: link.name(),
            state: snapshot.state().map(ShowState::name),
            standing: Standing::of(snapshot, now_ns),
            wall_time: wall_time.strftime("%Y-%m-%dT%H:%M:%S%:z").to_string(),
            run_id: header.map(|header| header.run_id),
            tick: header.map(|header| header.tick),
            time_s: header.map(FrameHeader::show_time_s),
            time_scale: header.map(|header| header.time_scale),
            speed_mps: header.map(|header| header.head_speed_mps),
            travel_m: header.map(|header| header.head_travel_m),
            dragons: DragonReport::all(snapshot),
            nearest: nearest.map(|pair| NearestReport {
                clearance_m: pair.clearance_m,
                benches: pair.benches,
                named: snapshot.named_benches(Some(pair.benches)),
            }),
            ahead: AheadReport { event: snapshot.forecast, named: snapshot.named_benches(snapshot.forecast.benches()) },
            ahead_words: ahead_words(snapshot),
            guard: snapshot.guard,
            lamps,
            refusals: Controls::of(snapshot),
            last_command: snapshot.commands.log.latest().next_back().map(|command| CommandWords::from(&command.event)),
        }
    }

    /// The report in lines for people: the show, how it stands, the clearance, the forecast, the newest command, and one line per lamp.
    fn lines(&self) -> Vec<String> {
        let mut lines = vec![self.show_line()];
        lines.extend(self.standing_line());
        if let Some(NearestReport { clearance_m, benches, named }) = &self.nearest {
            let pair = NamedBenches::pair_words(named.as_ref(), *benches);
            lines.push(format!("clearance {} mm, {pair}", Fixed::<3>(clearance_m * 1e3)));
        }
        lines.extend(self.dragons.iter().flatten().map(DragonReport::line));
        lines.extend(self.ahead_words.iter().map(|ahead| format!("ahead: {ahead}")));
        lines.extend(self.last_command.as_ref().map(|words| format!("last command: {} {}", words.clock, words.text)));
        let lamp = |lamp: &Lamp| format!("  {:<8} {:<9} {}", lamp.level.name(), lamp.name, lamp.text);
        lines.extend(self.lamps.iter().map(lamp));
        lines
    }

    fn show_line(&self) -> String {
        let clock = self.wall_time.get(11..19).unwrap_or(&self.wall_time);
        let (Some(time_s), Some(time_scale), Some(speed_mps)) = (self.time_s, self.time_scale, self.speed_mps) else {
            return format!("no frames ({}), wall clock {clock}", self.link);
        };
        let state = self.state.unwrap_or("in an unknown state");
        let link = if self.link == SourcePresence::Live.name() { "" } else { self.link };
        let head = self.dragons.iter().flatten().next().map_or("head", |dragon| &dragon.name);
        let scale = if time_scale == 1.0 { String::new() } else { format!(" at {time_scale} times real time") };
        let link = if link.is_empty() { String::new() } else { format!(" ({link})") };
        format!(
            "{state}{link}, show time {} s{scale}, {head} at {speed_mps:.3} m/s, wall clock {clock}",
            Fixed::<3>(time_s)
        )
    }

    /// How the show stands; `None` for a show that runs well.
    fn standing_line(&self) -> Option<String> {
        let Standing { level, cause, remedy, .. } = &self.standing;
        let remedy = remedy.as_deref().map_or(String::new(), |remedy| format!(" {remedy}"));
        (*level != Level::Good).then(|| format!("{}: {cause}{remedy}", level.name()))
    }
}

impl DragonReport {
    fn line(&self) -> String {
        let Self { name, state, travel_m, speed_mps } = self;
        let state = state.unwrap_or("in an unknown state");
        format!("  {name}: {state}, {speed_mps:.3} m/s, {} m of travel", Fixed::<3>(*travel_m))
    }
}

/// What lies ahead in words; `None` if it is not known.
fn ahead_words(snapshot: &Snapshot) -> Option<String> {
    match snapshot.guard {
        GuardSituation::AtEnd { for_good: true } => {
            return Some(snapshot.spoken("the guard has stopped the head permanently: only a seek moves it"));
        }
        GuardSituation::AtEnd { for_good: false } => return Some(snapshot.spoken("the guard has stopped the head")),
        _ => {}
    }
    let when = |at: Arrival| when(snapshot, at);
    let place = |at: Arrival| snapshot.place_words::<3>(at.travel_m);
    let words = match snapshot.forecast {
        ShowForecast::Unknown => return None,
        ShowForecast::Free { to, is_end: true } => {
            format!("no contact up to the end, show time {} s", Fixed::<3>(to.time_s))
        }
        ShowForecast::Free { to, is_end: false } => {
            format!("no contact up to show time {} s; the search goes on", Fixed::<3>(to.time_s))
        }
        ShowForecast::Contact { at, benches } => format!("{} touch {}", snapshot.pair_words(benches), when(at)),
        ShowForecast::GuardStop { at, benches: Some(benches) } => {
            format!("the guard stops the head {}, before {}", when(at), snapshot.pair_words(benches))
        }
        ShowForecast::GuardStop { at, benches: None } if at.wall_s == 0.0 => {
            "no guard runs: the head stands still until one starts".to_owned()
        }
        ShowForecast::GuardStop { at, benches: None } => {
            format!("no guard runs: the head stops at {} {}", place(at), when(at))
        }
        ShowForecast::Rest { at } => format!("the head stops at {} {}", place(at), when(at)),
    };
    Some(snapshot.spoken(&words))
}

/// The time until an arrival by the wall clock, and its show time.
fn when(snapshot: &Snapshot, at: Arrival) -> String {
    let walks = snapshot.state().is_some_and(ShowState::walks);
    let of_walk = if walks { "" } else { " of walking" };
    format!("in {:.1} s{of_walk} (show time {} s)", at.wall_s, Fixed::<3>(at.time_s))
}

#[cfg(test)]
mod tests {
    use jiff::Timestamp;
    use jiff::tz::TimeZone;

    use super::*;

    fn report(snapshot: &Snapshot) -> StatusReport {
        StatusReport::new(snapshot, &Timestamp::UNIX_EPOCH.to_zoned(TimeZone::UTC))
    }

    fn snapshot(state: ShowState) -> Snapshot {
        let header = FrameHeader {
            show_time_ns: 12_345_000_000,
            head_speed_mps: 1.0,
            time_scale: 5.0,
            state: state.to_wire(),
            ..FrameHeader::default()
        };
        let at = Arrival { travel_m: 412.5, time_s: 412.5, wall_s: 80.0 };
        Snapshot { forecast: ShowForecast::Contact { at, benches: [0, 8] }, ..Snapshot::live(header) }
    }

    #[test]
    fn the_report_has_wall_time_and_show_time() {
        let running = report(&snapshot(ShowState::Running));
        assert!(running.well);
        let lines = running.lines();
        let first = "running, show time 12.345 s at 5 times real time, head at 1.000 m/s, wall clock 00:00:00";
        assert_eq!(lines[..2], [first, "ahead: benches 0 and 8 touch in 80.0 s (show time 412.500 s)"]);
        let paused = report(&snapshot(ShowState::Paused)).lines();
        assert_eq!(paused[1], "caution: An operator has paused the show. `resume` continues it.");
        assert_eq!(paused[2], "ahead: benches 0 and 8 touch in 80.0 s of walking (show time 412.500 s)");
    }

    #[test]
    fn without_a_server_the_show_is_not_well() {
        let report = report(&Snapshot::default());
        assert!(!report.well);
        let lines = report.lines();
        assert_eq!(lines[0], "no frames (waiting), wall clock 00:00:00");
        assert!(lines[1].starts_with("caution: There is no server. Start the show"), "{lines:#?}");
        assert!(lines.contains(&"  danger   server    no server".to_owned()), "{lines:#?}");
        let json = serde_json::to_value(&report).expect("JSON");
        assert_eq!(
            (&json["well"], &json["state"], &json["lamps"][0]["level"]),
            (&false.into(), &().into(), &"danger".into())
        );
    }
}
