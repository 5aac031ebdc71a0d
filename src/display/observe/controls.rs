//! The commands that the source would accept now.

use bench_dragon_ipc::{GuardState, Refusal, Request, ShowState, SourceKind, Status, Stop, TimecodeState};
use serde::Serialize;

use super::guard_situation::GuardSituation;
use super::snapshot::Snapshot;
use super::snapshot::SourcePresence;

/// The reason for which each command would be refused, in one sentence; `None`, null as JSON, if it would be accepted.
///
/// The source decides. These reasons only disable controls and explain why. A server that hangs refuses nothing: it receives
/// the commands when it continues.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "each field is the command of its name")]
pub struct Controls {
    pub pause: Option<String>,
    pub resume: Option<String>,
    pub speed: Option<String>,
    pub seek: Option<String>,
    pub hold: Option<String>,
    pub release: Option<String>,
    pub stop: Option<String>,
    pub go: Option<String>,
}

impl Controls {
    /// Predicts the replies of a snapshot's source.
    pub fn of(snapshot: &Snapshot) -> Self {
        let state = snapshot.state();
        match (&snapshot.presence, state) {
            (SourcePresence::Ended { .. }, _) => return Self::all("the show has ended"),
            (SourcePresence::Gone { .. }, _) => return Self::all("no server runs"),
            (SourcePresence::Waiting, _) if !snapshot.has_source => return Self::all("no server runs"),
            _ => {}
        }
        let status = snapshot.status.as_deref();
        if status.and_then(Status::source_kind) == Some(SourceKind::Replay) {
            let refused = Self::all(&Refusal::Replayed.to_string());
            return Self { pause: None, resume: None, seek: None, stop: None, ..refused };
        }
        if status.is_some_and(|status| status.stops().has(Stop::Ending)) {
            let refused = Self::all("the server is ending");
            return Self { hold: None, ..refused };
        }
        Self {
            resume: in_words(snapshot, resume(status, state)),
            seek: seek(status),
            release: in_words(snapshot, release(status, state)),
            go: in_words(snapshot, go(status, state)),
            ..Self::default()
        }
    }

    /// The reason for which a request would be refused; `None` if it would be accepted.
    pub fn refusal(&self, request: Request) -> Option<&str> {
        let refusal = match request {
            Request::Pause => &self.pause,
            Request::Resume => &self.resume,
            Request::Speed { .. } => &self.speed,
            Request::Seek { .. } => &self.seek,
            Request::Hold => &self.hold,
            Request::Release => &self.release,
            Request::Stop => &self.stop,
            Request::Go => &self.go,
            Request::Grant { .. } | Request::Pace { .. } => &None,
        };
        refusal.as_deref()
    }

    fn all(reason: &str) -> Self {
        let [pause, resume, speed, seek, hold, release, stop, go] = [(); 8].map(|()| Some(reason.to_owned()));
        Self { pause, resume, speed, seek, hold, release, stop, go }
    }
}

/// Whether an operator holds the show. The status may be a tenth of a second older than the frame.
fn is_held(status: Option<&Status>, state: Option<ShowState>) -> bool {
    let waits_for_guard = |status: &Status| status.guard_state() != Some(GuardState::None);
    match status {
        Some(status) => status.stops().has(Stop::Held) || state == Some(ShowState::Held) && !waits_for_guard(status),
        None => state == Some(ShowState::Held),
    }
}

/// A refusal in words, which fit the state of the show. At the end of the guard's proven travel, they say that the dragon does not
/// walk on.
fn in_words(snapshot: &Snapshot, refusal: Option<Refusal>) -> Option<String> {
    let is_ready = snapshot.state() == Some(ShowState::Ready);
    let words = match (refusal?, snapshot.guard) {
        (Refusal::Held, _) if is_ready => "the show waits at its start: release it first".to_owned(),
        (Refusal::Held, _) => "the show is held: release it first".to_owned(),
        (Refusal::HeldByGuard, GuardSituation::AtEnd { for_good: true }) => {
            "the guard has stopped the dragon permanently: only a seek moves it".to_owned()
        }
        (Refusal::HeldByGuard, GuardSituation::AtEnd { for_good: false }) => {
            "the guard has stopped the dragon at the end of the proven travel: timecode can move it".to_owned()
        }
        (Refusal::HeldByGuard, GuardSituation::Missing) => {
            "no guard runs: the dragon walks on once `bench-dragon monitor --guard` runs".to_owned()
        }
        (refusal, _) => refusal.to_string(),
    };
    Some(snapshot.spoken(&words))
}

fn resume(status: Option<&Status>, state: Option<ShowState>) -> Option<Refusal> {
    match state {
        _ if is_held(status, state) => Some(Refusal::Held),
        Some(ShowState::Ready) => Some(Refusal::Ready),
        Some(ShowState::Held) => Some(Refusal::HeldByGuard),
        Some(ShowState::Finished | ShowState::Ended) => Some(Refusal::Finished),
        _ => None,
    }
}

fn release(status: Option<&Status>, state: Option<ShowState>) -> Option<Refusal> {
    match state {
        _ if is_held(status, state) => None,
        Some(ShowState::Ready) => None,
        Some(ShowState::Held) => Some(Refusal::HeldByGuard),
        _ => Some(Refusal::NotHeld),
    }
}

fn go(status: Option<&Status>, state: Option<ShowState>) -> Option<Refusal> {
    let waits = status.is_some_and(|status| status.stops().has(Stop::Waiting));
    match state {
        Some(ShowState::Waiting) => None,
        _ if is_held(status, state) => Some(Refusal::Held),
        Some(ShowState::Ready) => Some(Refusal::Ready),
        Some(ShowState::Finished | ShowState::Ended) => Some(Refusal::Finished),
        Some(ShowState::Paused) if waits => Some(Refusal::Paused),
        _ => Some(Refusal::NothingWaits),
    }
}

fn seek(status: Option<&Status>) -> Option<String> {
    let status = status?;
    if matches!(status.timecode_state(), Some(TimecodeState::Locked | TimecodeState::Standing)) {
        return Some(Refusal::Followed.to_string());
    }
    let has_no_guard = status.guard_state() == Some(GuardState::Missing);
    has_no_guard.then(|| "no guard runs, so the seek cannot be proved: start bench-dragon monitor --guard".to_owned())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::{FrameHeader, Stops};

    use super::*;

    fn snapshot(state: ShowState, status: &Status) -> Snapshot {
        let header = FrameHeader { state: state.to_wire(), ..FrameHeader::default() };
        Snapshot { status: Some(Arc::new(*status)), ..Snapshot::live(header) }
    }

    fn stopped(stops: Stops, guard: GuardState) -> Status {
        Status { stops: stops.to_wire(), guard: guard.to_wire(), ..Status::default() }
    }

    /// The commands that would be refused, in the order of the fields.
    fn refused(snapshot: &Snapshot) -> String {
        let controls = Controls::of(snapshot);
        let json = serde_json::to_value(&controls).expect("JSON");
        let order = ["pause", "resume", "speed", "seek", "hold", "release", "stop", "go"];
        order.into_iter().filter(|name| !json[name].is_null()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn without_a_server_every_command_is_refused_and_a_hanging_server_refuses_none() {
        let all = "pause resume speed seek hold release stop go";
        assert_eq!(refused(&Snapshot::default()), all);
        assert_eq!(refused(&Snapshot { has_source: true, ..Snapshot::default() }), "release go");
        let running = snapshot(ShowState::Running, &Status::default());
        for (presence, expected) in [
            (SourcePresence::Gone { age_ns: 1 }, all),
            (SourcePresence::Ended { age_ns: 1 }, all),
            (SourcePresence::Silent { age_ns: 1 }, "release go"),
            (SourcePresence::Failed { reason: String::new() }, "release go"),
            (SourcePresence::Live, "release go"),
        ] {
            assert_eq!(refused(&Snapshot { presence, ..running.clone() }), expected);
        }
    }

    #[test]
    fn a_replay_can_be_paused_sought_and_stopped() {
        let replay = Status { source: SourceKind::Replay.to_wire(), ..Status::default() };
        assert_eq!(refused(&snapshot(ShowState::Running, &replay)), "speed hold release go");
    }

    #[test]
    fn the_command_that_lifts_a_stop_depends_on_its_cause() {
        let held = Stops::from([Stop::Held]);
        let limit = Stops::from([Stop::GuardLimit]);
        let both = Stops::from([Stop::Held, Stop::GuardLimit]);
        let ending = Stops::from([Stop::Ending]);
        for (state, stops, guard, expected) in [
            (ShowState::Paused, Stops::default(), GuardState::None, "release go"),
            (ShowState::Waiting, Stops::from([Stop::Waiting]), GuardState::None, "release"),
            (ShowState::Paused, Stops::from([Stop::Waiting, Stop::Paused]), GuardState::None, "release go"),
            (ShowState::Held, held, GuardState::None, "resume go"),
            (ShowState::Stopping, held, GuardState::None, "resume go"),
            (ShowState::Held, limit, GuardState::Running, "resume release go"),
            (ShowState::Held, both, GuardState::Running, "resume go"),
            (ShowState::Held, limit, GuardState::Missing, "resume seek release go"),
            (ShowState::Finished, Stops::default(), GuardState::None, "resume release go"),
            (ShowState::Stopping, ending, GuardState::None, "pause resume speed seek release stop go"),
        ] {
            assert_eq!(refused(&snapshot(state, &stopped(stops, guard))), expected, "{state} {stops:?} {guard:?}");
        }
        let late = snapshot(ShowState::Held, &stopped(Stops::default(), GuardState::None));
        assert_eq!(refused(&late), "resume go", "the status is older than the hold");
    }

    #[test]
    fn at_the_guards_permanent_end_no_reason_promises_that_the_dragon_walks_on() {
        let limit = Stops::from([Stop::GuardLimit]);
        let held = snapshot(ShowState::Held, &stopped(limit, GuardState::Running));
        for (guard, part) in [
            (GuardSituation::Waiting, "it walks on by itself if the guard proves the travel ahead"),
            (GuardSituation::AtEnd { for_good: true }, "permanently: only a seek moves it"),
            (GuardSituation::AtEnd { for_good: false }, "timecode can move it"),
            (GuardSituation::Missing, "monitor --guard"),
        ] {
            let controls = Controls::of(&Snapshot { guard, ..held.clone() });
            for refusal in [controls.release, controls.resume] {
                assert!(refusal.as_ref().is_some_and(|words| words.contains(part)), "{guard:?}: {refusal:?}");
            }
        }
    }

    #[test]
    fn a_seek_is_refused_while_timecode_leads() {
        for (timecode, expected) in [
            (TimecodeState::None, "release go"),
            (TimecodeState::Waiting, "release go"),
            (TimecodeState::Locked, "seek release go"),
            (TimecodeState::Standing, "seek release go"),
            (TimecodeState::Lost, "release go"),
        ] {
            let status = Status { timecode: timecode.to_wire(), ..Status::default() };
            let snapshot = snapshot(ShowState::Running, &status);
            assert_eq!(refused(&snapshot), expected);
            let seek = Request::Seek { show_time_s: 1.0 };
            assert_eq!(Controls::of(&snapshot).refusal(seek).is_some(), expected.contains("seek"));
        }
    }
}
