//! How the show stands: one word, how urgent it is, its cause, and what to do. Every display and `ctl status` show the same.

use bench_dragon_ipc::{CommandEvent, EventKind, GuardState, ShowState, SourceKind, Status, Stop, TimecodeState};
use serde::Serialize;

use super::contact::Contact;
use super::guard_situation::GuardSituation;
use super::lamps::{LampLevel, lamps};
use super::lost_server::{has_show, remedy_of_hanging_server, remedy_of_lost_server};
use super::reader_lamps::{guard_silence, has_full_disk, short_room};
use super::show_forecast::ShowForecast;
use super::snapshot::{Snapshot, SourcePresence};

/// How urgent the standing of a show is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// The show stands as it should: it waits, or is over.
    #[default]
    Calm,
    /// The show runs.
    Good,
    /// An operator should know the cause.
    Caution,
    /// A safety stop, or a failure: red.
    Danger,
}

impl Level {
    /// Lower-case name, as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calm => "calm",
            Self::Good => "good",
            Self::Caution => "caution",
            Self::Danger => "danger",
        }
    }
}

/// How the show stands.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Standing {
    /// How urgent it is.
    pub level: Level,
    /// The state of the show, or of the connection to it, in capital letters.
    pub word: &'static str,
    /// The cause, in whole sentences.
    pub cause: String,
    /// The remedy, in whole sentences; `None`, null as JSON, if nothing is to be done.
    pub remedy: Option<String>,
}

impl Standing {
    /// The standing of a snapshot at an instant of `CLOCK_MONOTONIC`, in nanoseconds.
    pub fn of(snapshot: &Snapshot, now_ns: u64) -> Self {
        let standing = match Self::of_link(snapshot, &snapshot.presence_at(now_ns), now_ns) {
            Some(standing) => return standing.spoken(snapshot),
            None => Self::of_state(snapshot),
        };
        standing.with_dangers(snapshot, now_ns).with_red_lamps(snapshot, now_ns).spoken(snapshot)
    }

    /// The same in the words for the snapshot's number of dragons.
    fn spoken(self, snapshot: &Snapshot) -> Self {
        let remedy = self.remedy.map(|remedy| snapshot.spoken(&remedy));
        Self { cause: snapshot.spoken(&self.cause), remedy, ..self }
    }

    fn new(level: Level, word: &'static str, cause: impl Into<String>) -> Self {
        Self { level, word, cause: cause.into(), remedy: None }
    }

    fn remedied(self, remedy: impl Into<String>) -> Self {
        Self { remedy: Some(remedy.into()), ..self }
    }

    /// The standing of a show whose frames do not arrive; `None` if they do.
    fn of_link(snapshot: &Snapshot, presence: &SourcePresence, now_ns: u64) -> Option<Self> {
        let age_s = presence.age_s().unwrap_or_default();
        Some(match presence {
            SourcePresence::Live => return None,
            SourcePresence::Waiting | SourcePresence::Gone { .. } | SourcePresence::Ended { .. }
                if snapshot.has_lost_show =>
            {
                let cause = "The process `show` was killed, so the server has ended.";
                Self::new(Level::Danger, "SHOW LOST", cause).remedied(remedy_of_lost_server(snapshot, age_s))
            }
            SourcePresence::Waiting if snapshot.is_silent_from_the_start(now_ns) => {
                let cause = "The server's process exists, but sends nothing.";
                Self::new(Level::Danger, "SILENT", cause).remedied(remedy_of_hanging_server(snapshot))
            }
            SourcePresence::Waiting if snapshot.has_source => {
                Self::new(Level::Caution, "STARTING", "The server has published no frame yet.")
            }
            SourcePresence::Waiting if snapshot.members.has_lost_server() => {
                let cause = "The server was killed, and its last frame is not known.";
                Self::new(Level::Danger, "SERVER LOST", cause).remedied(remedy_of_lost_server(snapshot, age_s))
            }
            SourcePresence::Waiting if has_show(snapshot) => {
                Self::new(Level::Caution, "NO SERVER", "There is no server: the show starts it.")
                    .remedied("Wait: it tries again within 30 s.")
            }
            SourcePresence::Waiting => {
                let start = "Start the show with `bench-dragon show --config FILE --held`: it then stands still.";
                Self::new(Level::Caution, "NO SERVER", "There is no server.").remedied(start)
            }
            SourcePresence::Silent { .. } => {
                let cause = format!("The server's process exists, but has sent nothing for {age_s:.1} s.");
                Self::new(Level::Danger, "SILENT", cause).remedied(remedy_of_hanging_server(snapshot))
            }
            SourcePresence::Gone { .. } => {
                let cause = format!("The server is gone. The last frame is {age_s:.1} s old.");
                Self::new(Level::Danger, "SERVER LOST", cause).remedied(remedy_of_lost_server(snapshot, age_s))
            }
            SourcePresence::Failed { reason } => Self::new(Level::Danger, "NO BUS", format!("{reason}.")),
            SourcePresence::Ended { .. } => Self::new(Level::Calm, "ENDED", "The server has ended in order."),
        })
    }

    /// The standing of a live show by its state.
    fn of_state(snapshot: &Snapshot) -> Self {
        match snapshot.state() {
            Some(ShowState::Running) => Self::new(Level::Good, "RUNNING", "The dragon walks."),
            Some(ShowState::Stopping) => Self::new(Level::Caution, "STOPPING", stopping(snapshot)),
            Some(ShowState::Paused) if is_replayed(snapshot) => {
                Self::new(Level::Caution, "PAUSED", replayed_pause(snapshot))
            }
            Some(ShowState::Paused) => paused(snapshot.status.as_deref()),
            Some(ShowState::Ready) if is_replayed(snapshot) => {
                Self::new(Level::Calm, "READY", "The recorded show waited at its start here.")
            }
            Some(ShowState::Held) if is_replayed(snapshot) => {
                Self::new(Level::Caution, "HELD", "The recorded show was held here.")
            }
            Some(ShowState::Ready) if snapshot.guard == GuardSituation::Missing => {
                Self::new(Level::Danger, "READY", "The dragon waits at its start, and no guard runs.")
                    .remedied("Start `bench-dragon monitor --guard` before the release.")
            }
            Some(ShowState::Ready) => {
                Self::new(Level::Calm, "READY", "The dragon waits at its start.").remedied("A release starts it.")
            }
            Some(ShowState::Waiting) => waiting(snapshot),
            Some(ShowState::Held) => held(snapshot),
            Some(ShowState::Finished) => {
                Self::new(Level::Calm, "FINISHED", "The show is over.").remedied("A seek starts it again.")
            }
            Some(ShowState::Ended) => Self::new(Level::Calm, "ENDED", "The server has ended in order."),
            None => Self::new(Level::Caution, "UNKNOWN", "This program does not know the state of the show.")
                .remedied("Run the same version of bench-dragon on both sides."),
        }
    }

    /// Adds a contact, a guard that hangs and a full disk, which are dangers in any state. The word stays the show's state.
    fn with_dangers(mut self, snapshot: &Snapshot, now_ns: u64) -> Self {
        let walks = snapshot.state().is_some_and(ShowState::walks);
        let contact = Contact::of(snapshot, now_ns).map(|contact| {
            let part = "Look at the benches, and part them before the dragon walks on.";
            let remedy = if walks { format!("Hold the show. {part}") } else { part.to_owned() };
            (format!("CONTACT: {}.", contact.words(snapshot)), remedy)
        });
        let full_disk = has_full_disk(snapshot)
            .then(|| ("The disk is full: the show is not recorded.".to_owned(), FREE_SPACE.to_owned()));
        let hung_guard = hung_guard(snapshot, now_ns);
        if hung_guard.is_some() && self.level == Level::Calm {
            // Nothing is to be awaited from a guard that hangs.
            self.remedy = None;
            "The dragon stands.".clone_into(&mut self.cause);
        }
        let dangers: Vec<(String, String)> = contact.into_iter().chain(hung_guard).chain(full_disk).collect();
        let Some((_, remedy)) = dangers.first() else { return self };
        // The remedy of a safety stop comes after that of a contact.
        self.remedy = match self.remedy.filter(|_| self.level == Level::Danger) {
            Some(own) => Some(format!("{remedy} {own}")),
            None => Some(remedy.clone()),
        };
        let causes = dangers.into_iter().map(|(cause, _)| cause).chain([self.cause]);
        self.cause = causes.collect::<Vec<_>>().join(" ");
        Self { level: Level::Danger, ..self }
    }

    /// Adds the lamps that are red for a cause which is no danger to people, such as a killed recorder.
    fn with_red_lamps(mut self, snapshot: &Snapshot, now_ns: u64) -> Self {
        if self.level == Level::Danger {
            return self;
        }
        for lamp in lamps(snapshot, now_ns).into_iter().filter(|lamp| lamp.level == LampLevel::Danger) {
            self.level = Level::Caution;
            self.cause = format!("{} The lamp {} is red: {}.", self.cause, lamp.name, lamp.text);
        }
        if self.level == Level::Caution && short_room(snapshot).is_some() {
            self.remedy.get_or_insert_with(|| FREE_SPACE.to_owned());
        }
        self
    }
}

const FREE_SPACE: &str = "Free some disk space.";

/// The cause and the remedy if the guard's process exists, but no longer reports, and the head has travel ahead.
fn hung_guard(snapshot: &Snapshot, now_ns: u64) -> Option<(String, String)> {
    let is_needed = matches!(snapshot.guard, GuardSituation::Waiting | GuardSituation::Working);
    let is_over = matches!(snapshot.state(), None | Some(ShowState::Finished | ShowState::Ended));
    let silence = guard_silence(snapshot, now_ns).filter(|_| is_needed && !is_over)?;
    let cause = format!("The guard does not answer: {silence}.");
    Some((cause, "End `bench-dragon monitor --guard`, and start it again.".to_owned()))
}

/// A show that waits at a cue.
fn waiting(snapshot: &Snapshot) -> Standing {
    let cue = snapshot.cue_here().map_or_else(|| "a cue".to_owned(), |cue| format!("the cue “{}”", cue.name));
    let cause = format!("The show waits at {cue}.");
    match snapshot.guard {
        _ if is_replayed(snapshot) => {
            Standing::new(Level::Calm, "WAITING FOR GO", format!("The recorded show waited at {cue}."))
        }
        GuardSituation::Missing => Standing::new(Level::Danger, "WAITING FOR GO", format!("{cause} No guard runs."))
            .remedied("Start `bench-dragon monitor --guard` before GO."),
        _ => Standing::new(Level::Calm, "WAITING FOR GO", cause).remedied("GO lets it walk on."),
    }
}

fn stopping(snapshot: &Snapshot) -> String {
    let stops = snapshot.status.as_deref().map(Status::stops).unwrap_or_default();
    let why = match stops {
        _ if stops.has(Stop::Ending) => "The server was asked to end. ",
        _ if stops.has(Stop::Held) => "Hold. ",
        _ if stops.has(Stop::Paused) => "Pause. ",
        _ if stops.has(Stop::Timecode) => "The timecode stands still. ",
        _ => "",
    };
    match snapshot.forecast {
        ShowForecast::Rest { at } => {
            format!("{why}The head stops in {:.1} s, at {}.", at.wall_s, snapshot.place_words::<2>(at.travel_m))
        }
        _ => format!("{why}The head brakes."),
    }
}

fn paused(status: Option<&Status>) -> Standing {
    let standing = |cause: &str| Standing::new(Level::Caution, "PAUSED", cause);
    let by_operator = status.is_none_or(|status| status.stops().has(Stop::Paused));
    match status.and_then(Status::timecode_state) {
        Some(TimecodeState::Waiting) if !by_operator => {
            standing("The show waits for its first timecode.").remedied(WALK_ALONE)
        }
        Some(TimecodeState::Lost) if !by_operator => {
            standing("The timecode is lost, and the show stands.").remedied(WALK_ALONE)
        }
        Some(timecode) if !by_operator && timecode != TimecodeState::None => {
            standing("The timecode stands still, so the show stands still.")
        }
        _ => standing("An operator has paused the show.").remedied("`resume` continues it."),
    }
}

const WALK_ALONE: &str = "`resume` lets it walk on by itself until timecode comes.";

/// Why a replayed show is paused: the replay is, or the recorded show was.
fn replayed_pause(snapshot: &Snapshot) -> &'static str {
    let is_of_replay = snapshot.replay.is_some_and(|replay| replay.paused != 0);
    if is_of_replay { "The replay is paused." } else { "The recorded show was paused here." }
}

/// Whether the show is a replayed one: nobody can release it, and no dragon walks.
fn is_replayed(snapshot: &Snapshot) -> bool {
    snapshot.replay.is_some() || snapshot.status.as_deref().and_then(Status::source_kind) == Some(SourceKind::Replay)
}

/// The standing of a held show. Waiting for the guard is calm; every other hold is a safety stop.
fn held(snapshot: &Snapshot) -> Standing {
    let danger = |cause: String| Standing::new(Level::Danger, "HELD", cause);
    // The status may be a tenth of a second older than the frame. Then the cause is not known yet.
    let status_of_hold = snapshot.status.as_deref().filter(|status| status.show_state() == Some(ShowState::Held));
    let Some(status) = status_of_hold else { return Standing::new(Level::Caution, "HELD", "The dragon stands.") };
    let stops = status.stops();
    if stops.has(Stop::Held) || status.guard_state() == Some(GuardState::None) {
        let (cause, remedy) = if stops.has(Stop::Restarted) {
            ("The server was restarted, so the dragon stands where it was last seen.".to_owned(), LOOK_AND_RELEASE)
        } else {
            (format!("{} holds the show for safety.", holder(snapshot)), RELEASE)
        };
        return danger(cause).remedied(format!("{remedy}{}", behind_the_hold(snapshot.guard)));
    }
    match snapshot.guard {
        GuardSituation::Missing => {
            danger("No guard runs, so the dragon stands at the end of its proven travel.".to_owned())
                .remedied("Start `bench-dragon monitor --guard`: the dragon then walks on by itself.")
        }
        GuardSituation::AtEnd { for_good: true } => {
            danger(GUARD_END.to_owned()).remedied("Only a seek moves the dragon: a release does not.")
        }
        GuardSituation::AtEnd { for_good: false } => {
            danger(GUARD_END.to_owned()).remedied("Timecode can move the dragon: a release does not.")
        }
        GuardSituation::Waiting | GuardSituation::Working | GuardSituation::None => {
            Standing::new(Level::Calm, "HELD", "The guard is proving the travel ahead.")
                .remedied("Wait: the dragon then walks on by itself.")
        }
    }
}

const RELEASE: &str = "A release lifts the hold.";
const LOOK_AND_RELEASE: &str = "Look at the dragon, then release it.";
const GUARD_END: &str = "The guard has stopped the dragon permanently: ahead, benches come nearer than the margin or a border, or nothing is proved.";

/// The stop that remains after the release of a hold.
fn behind_the_hold(guard: GuardSituation) -> &'static str {
    match guard {
        GuardSituation::AtEnd { for_good: true } => " The guard's stop stays: only a seek moves the dragon.",
        GuardSituation::AtEnd { for_good: false } => " The guard's stop stays: timecode can move the dragon.",
        GuardSituation::Missing => " No guard runs: start `bench-dragon monitor --guard` first.",
        GuardSituation::None | GuardSituation::Waiting | GuardSituation::Working => "",
    }
}

/// The holder of the show: the sender of the last accepted hold of this run.
fn holder(snapshot: &Snapshot) -> String {
    let run_id = snapshot.header().map(|header| header.run_id);
    let is_hold = |event: &&CommandEvent| {
        Some(event.run_id) == run_id && event.event_kind() == Some(EventKind::Hold) && event.outcome().is_ok()
    };
    let last = snapshot.commands.log.latest().map(|numbered| &numbered.event).rfind(is_hold);
    last.and_then(CommandEvent::sent_by).map_or("An operator".to_owned(), |sender| format!("An operator ({sender})"))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_geometry::clearance::PairClearance;
    use bench_dragon_ipc::{FrameHeader, ReaderReport, ReplayStatus, Stops};
    use glam::DVec2;

    use super::*;
    use crate::display::observe::ReaderLog;

    fn snapshot(state: ShowState, stops: Stops, guard: GuardState) -> Snapshot {
        let header = FrameHeader { state: state.to_wire(), ..FrameHeader::default() };
        let (state, stops, guard) = (state.to_wire(), stops.to_wire(), guard.to_wire());
        let status = Status { state, stops, guard, ..Status::default() };
        Snapshot { status: Some(Arc::new(status)), ..Snapshot::live(header) }
    }

    fn stands(snapshot: &Snapshot) -> (Level, &'static str) {
        let Standing { level, word, cause, .. } = Standing::of(snapshot, 0);
        assert!(cause.ends_with('.'), "{cause} is a sentence");
        (level, word)
    }

    #[test]
    fn only_safety_stops_and_failures_are_red() {
        let none = Stops::default();
        let [held, limit] = [Stops::from([Stop::Held]), Stops::from([Stop::GuardLimit])];
        for (state, stops, guard, expected) in [
            (ShowState::Running, none, GuardState::None, (Level::Good, "RUNNING")),
            (ShowState::Stopping, held, GuardState::None, (Level::Caution, "STOPPING")),
            (ShowState::Paused, Stops::from([Stop::Paused]), GuardState::None, (Level::Caution, "PAUSED")),
            (ShowState::Ready, none, GuardState::None, (Level::Calm, "READY")),
            (ShowState::Held, held, GuardState::None, (Level::Danger, "HELD")),
            (ShowState::Held, Stops::from([Stop::Held, Stop::Restarted]), GuardState::None, (Level::Danger, "HELD")),
            (ShowState::Held, limit, GuardState::Running, (Level::Calm, "HELD")),
            (ShowState::Finished, none, GuardState::None, (Level::Calm, "FINISHED")),
            (ShowState::Ended, none, GuardState::None, (Level::Calm, "ENDED")),
        ] {
            assert_eq!(stands(&snapshot(state, stops, guard)), expected, "{stops:?}");
        }
        let held_by_guard = snapshot(ShowState::Held, limit, GuardState::Running);
        for guard in [GuardSituation::AtEnd { for_good: true }, GuardSituation::Missing] {
            assert_eq!(stands(&Snapshot { guard, ..held_by_guard.clone() }), (Level::Danger, "HELD"), "{guard:?}");
        }
        let unguarded =
            Snapshot { guard: GuardSituation::Missing, ..snapshot(ShowState::Ready, none, GuardState::Missing) };
        assert_eq!(stands(&unguarded), (Level::Danger, "READY"));
    }

    #[test]
    fn a_replayed_stand_is_that_of_the_recorded_show_and_has_no_remedy() {
        for (state, level, cause) in [
            (ShowState::Held, Level::Caution, "The recorded show was held here."),
            (ShowState::Ready, Level::Calm, "The recorded show waited at its start here."),
            (ShowState::Paused, Level::Caution, "The recorded show was paused here."),
        ] {
            let live = snapshot(state, Stops::default(), GuardState::None);
            let status = live.status.as_deref().copied().unwrap_or_default();
            let status = Status { source: SourceKind::Replay.to_wire(), ..status };
            let standing = Standing::of(&Snapshot { status: Some(Arc::new(status)), ..live }, 0);
            assert_eq!((standing.level, &*standing.cause, standing.remedy), (level, cause, None));
        }
        let replay = Some(ReplayStatus { paused: 1, ..ReplayStatus::default() });
        let paused = Snapshot { replay, ..snapshot(ShowState::Paused, Stops::default(), GuardState::None) };
        assert_eq!(Standing::of(&paused, 0).cause, "The replay is paused.");
    }

    #[test]
    fn a_show_without_frames_stands_as_its_connection() {
        let running = snapshot(ShowState::Running, Stops::default(), GuardState::None);
        let age_ns = 2_000_000_000;
        for (presence, has_source, expected) in [
            (SourcePresence::Waiting, false, (Level::Caution, "NO SERVER")),
            (SourcePresence::Waiting, true, (Level::Caution, "STARTING")),
            (SourcePresence::Silent { age_ns }, true, (Level::Danger, "SILENT")),
            (SourcePresence::Gone { age_ns }, false, (Level::Danger, "SERVER LOST")),
            (SourcePresence::Failed { reason: "no memory".to_owned() }, true, (Level::Danger, "NO BUS")),
            (SourcePresence::Ended { age_ns }, false, (Level::Calm, "ENDED")),
        ] {
            assert_eq!(stands(&Snapshot { presence, has_source, ..running.clone() }), expected);
        }
    }

    #[test]
    fn a_hold_says_what_stops_the_dragon_after_it() {
        let stops = Stops::from([Stop::Held, Stop::GuardLimit]);
        let held = snapshot(ShowState::Held, stops, GuardState::Running);
        for (guard, remedy) in [
            (GuardSituation::Waiting, "A release lifts the hold."),
            (
                GuardSituation::AtEnd { for_good: true },
                "A release lifts the hold. The guard's stop stays: only a seek moves the dragon.",
            ),
        ] {
            let standing = Standing::of(&Snapshot { guard, ..held.clone() }, 0);
            assert_eq!(standing.remedy.as_deref(), Some(remedy));
        }
    }

    #[test]
    fn a_contact_and_a_full_disk_are_red_in_any_state_and_come_first() {
        let mut readers = ReaderLog::default();
        let mut full = ReaderReport { frames: 1, ended: ReaderReport::DISK_FULL, ..ReaderReport::default() };
        full.set_name("record");
        readers.push(full);
        let pair = PairClearance { benches: [3, 11], clearance_m: -0.084, point: DVec2::ZERO };
        let bad = |state, stops| Snapshot {
            nearest: Some(pair),
            readers: Arc::new(readers.clone()),
            ..snapshot(state, stops, GuardState::None)
        };
        let running = Standing::of(&bad(ShowState::Running, Stops::default()), 0);
        let dangers = "CONTACT: benches 3 and 11 overlap by 84.0 mm. The disk is full: the show is not recorded.";
        assert_eq!((running.level, running.word), (Level::Danger, "RUNNING"));
        assert_eq!(running.cause, format!("{dangers} The dragon walks."));
        assert!(running.remedy.is_some_and(|remedy| remedy.starts_with("Hold the show. Look at the benches")));
        let held = Standing::of(&bad(ShowState::Held, Stops::from([Stop::Held])), 0);
        assert_eq!(held.cause, format!("{dangers} An operator holds the show for safety."));
        assert!(held.remedy.is_some_and(|remedy| remedy.ends_with("walks on. A release lifts the hold.")));
    }

    #[test]
    fn a_disk_that_is_full_within_a_minute_is_named() {
        let of = |room_s| {
            let mut readers = ReaderLog::default();
            let mut report = ReaderReport { frames: 1, room_s, ..ReaderReport::default() };
            report.set_name("record");
            readers.push(report);
            let runs = snapshot(ShowState::Running, Stops::default(), GuardState::None);
            Standing::of(&Snapshot { readers: Arc::new(readers), ..runs }, 0)
        };
        let short = of(45.0);
        assert_eq!((short.level, short.word), (Level::Caution, "RUNNING"));
        assert_eq!(short.cause, "The dragon walks. The lamp recorder is red: 45 s of disk left.");
        assert_eq!(short.remedy.as_deref(), Some("Free some disk space."));
        assert_eq!(of(61.0).level, Level::Good);
    }

    #[test]
    fn a_guard_that_hangs_is_red() {
        let mut monitor = ReaderReport { frames: 1, sent_ns: 1_000_000_000, ..ReaderReport::default() };
        monitor.set_name("monitor");
        let mut readers = ReaderLog::default();
        readers.push(monitor);
        let at = |published_ns, state: ShowState, guard| {
            let stops = if state == ShowState::Held { Stops::from([Stop::GuardLimit]) } else { Stops::default() };
            let snapshot = snapshot(state, stops, GuardState::Running);
            let header = FrameHeader { published_ns, ..*snapshot.header().expect("a frame") };
            let live = Snapshot::live(header);
            let hangs = Snapshot { readers: Arc::new(readers.clone()), status: snapshot.status, guard, ..live };
            Standing::of(&hangs, 0)
        };
        let held = at(9_000_000_000, ShowState::Held, GuardSituation::Waiting);
        assert_eq!((held.level, held.word), (Level::Danger, "HELD"));
        assert_eq!(held.cause, "The guard does not answer: it has been silent for 8 s. The dragon stands.");
        assert_eq!(held.remedy.as_deref(), Some("End `bench-dragon monitor --guard`, and start it again."));
        let level = |published_ns, state, guard| at(published_ns, state, guard).level;
        assert_eq!(level(9_000_000_000, ShowState::Running, GuardSituation::Working), Level::Danger);
        assert_eq!(level(4_000_000_000, ShowState::Held, GuardSituation::Waiting), Level::Calm);
        // The lamp of the monitor stays red, although nothing is to be proved any more.
        assert_eq!(level(9_000_000_000, ShowState::Finished, GuardSituation::Working), Level::Caution);
    }

    #[test]
    fn a_server_that_was_lost_before_the_first_look_is_red() {
        use bench_dragon_ipc::NodeEntry;

        use crate::display::observe::Members;

        let serve = NodeEntry { name: "serve".to_owned(), pid: Some(7) };
        let lost = Members { dead: vec![serve.clone()], ..Members::default() };
        let of = |members: &Members| Snapshot { members: Arc::new(members.clone()), ..Snapshot::default() };
        let standing = Standing::of(&of(&lost), 0);
        assert_eq!((standing.level, standing.word), (Level::Danger, "SERVER LOST"));
        assert!(standing.remedy.is_some_and(|remedy| remedy.contains("serve --config FILE --held --start-at=SECONDS")));
        let suspended = Members { source: Some(7), has_source: true, living: vec![serve], ..Members::default() };
        let read = Snapshot { has_source: true, reading_since_ns: Some(0), seen_ns: 2_000_000_000, ..of(&suspended) };
        let standing = Standing::of(&read, read.seen_ns);
        assert_eq!((standing.level, standing.word), (Level::Danger, "SILENT"));
        assert!(standing.remedy.is_some_and(|remedy| remedy.contains("kill -CONT 7")));
        let starts = Snapshot { hears_source: true, ..read.clone() };
        assert_eq!(Standing::of(&starts, read.seen_ns).word, "STARTING");
    }
}
