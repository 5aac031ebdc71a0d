//! The captain, who leads the show to its end after the faults.

use bench_dragon_ipc::{FrameHeader, Request, ShowState, Status, Stop, Stops, TimecodeState};

use super::faults::Windows;
use super::timecode::Sender;
use super::{Event, World};
use crate::promises::Promise;
use crate::scenario::SECOND_NS;

/// Period of the captain, who leads the show to its end after the faults.
const CAPTAIN_NS: u64 = SECOND_NS;
/// Longest time after the faults until the show walks. Restarts wait up to 30 s, and a child has 30 s to its first sign of life.
const SETTLE_NS: u64 = 180 * SECOND_NS;

/// How far the captain has led the show to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Captain {
    Waits,
    /// Leads the show to a walk. Instant by which it walks.
    Leads(u64),
    /// Has asked for a seek. Instant by which the head has got there.
    Seeks(u64),
    /// Has sent a stop. Instant by which the show has ended.
    Stops(u64),
    Done,
}

/// Returns the command that lets a show with these stops walk on, at this speed.
pub fn request_to_walk(stops: Stops, speed_mps: f64) -> Request {
    if stops.has(Stop::Held) || stops.has(Stop::Ready) {
        Request::Release
    } else if stops.has(Stop::Paused) {
        Request::Resume
    } else if stops.has(Stop::Waiting) {
        Request::Go
    } else {
        Request::Speed { speed_mps }
    }
}

impl World<'_> {
    /// The captain looks once a second at a show without faults: it must walk or be at an end, and then end by a stop.
    pub(super) fn lead(&mut self) {
        let scenario = self.scenario;
        self.after(CAPTAIN_NS, Event::Captain);
        if self.captain == Captain::Waits {
            self.windows = Windows::default();
            self.sender = Sender { stands: false, pace: 1.0, silent_until: 0, ..self.sender };
            self.captain = Captain::Leads(self.now_ns + SETTLE_NS);
        }
        match self.captain {
            Captain::Leads(until_ns) => {
                let state = self.newest.as_ref().and_then(FrameHeader::show_state);
                if self.has_arrived() {
                    let seeks = self.is_seek_due();
                    let until_ns = self.now_ns + SETTLE_NS;
                    self.captain = if seeks { Captain::Seeks(until_ns) } else { Captain::Stops(until_ns) };
                }
                let (stops, at_s) = (self.status.as_deref().map(Status::stops), self.sender.position_s);
                self.promises.require(Promise::WalksOn, self.now_ns, self.now_ns < until_ns, || {
                    format!("the show stands as {state:?} with {stops:?}, a timecode would be at {at_s} s")
                });
                self.urge();
            }
            Captain::Seeks(until_ns) => {
                let is_there = self.has_sought;
                self.promises.require(Promise::SeekIsProved, self.now_ns, self.now_ns < until_ns, || {
                    format!("a seek to {} s is refused", scenario.seek_s())
                });
                if is_there {
                    self.captain = Captain::Stops(self.now_ns + SETTLE_NS);
                } else if self.calls.iter().all(|call| !call.is_captains) {
                    self.begin_call(Request::Seek { show_time_s: scenario.seek_s() }, true);
                }
            }
            Captain::Stops(until_ns) => {
                let newest = self.newest;
                self.promises.require(Promise::EndsWhenTold, self.now_ns, self.now_ns < until_ns, || {
                    format!("the show goes on: {newest:?}")
                });
                if self.calls.iter().all(|call| !call.is_captains) {
                    self.begin_call(Request::Stop, true);
                }
            }
            Captain::Waits | Captain::Done => {}
        }
    }

    /// Whether the guard must prove the captain's seek: its target keeps the margin, and no timecode leads.
    pub(super) fn is_seek_due(&mut self) -> bool {
        let travel_m = self.scenario.config.course_m(self.scenario.seek_s());
        let is_within = self.scenario.flags.until_s.is_none_or(|until_s| self.scenario.seek_s() < until_s);
        !self.scenario.flags.timecode && is_within && self.promises.is_clear_at(travel_m)
    }

    /// Whether the show walks, or stands at an end that no command but a seek leaves.
    pub(super) fn has_arrived(&mut self) -> bool {
        let can_follow = self.can_follow_timecode();
        let (Some(header), Some(status), Some(server)) = (self.newest, &self.status, &self.server) else {
            return false;
        };
        let is_live = header.run_id == server.run_id && status.run_id == server.run_id;
        let is_final = status.guard_end_m == header.course_m || self.guards.iter().any(|guard| guard.is_final(&header));
        is_live
            && match header.show_state() {
                Some(ShowState::Running) => header.course_mps > 0.0 && header.tick > 5,
                Some(ShowState::Held) => is_final && !status.stops().has(Stop::Held),
                Some(ShowState::Finished) => true,
                Some(ShowState::Paused) => {
                    status.stops().has(Stop::Timecode)
                        && (status.timecode != TimecodeState::Locked.to_wire() || !can_follow)
                        && !status.stops().has(Stop::Paused)
                }
                _ => false,
            }
    }

    /// Whether the show can be where the timecode is. Before its begin, behind its end, and where no guard can prove the margin, it
    /// stands.
    fn can_follow_timecode(&mut self) -> bool {
        let config = &self.scenario.config;
        let at_s = self.sender.position_s;
        let last_s = self.scenario.flags.until_s.unwrap_or(f64::INFINITY).min(config.last_seek_s());
        let is_within = (config.start_s()..last_s - 1.0).contains(&at_s);
        is_within && (!self.scenario.is_guarded() || self.promises.is_clear_at(config.course_m(at_s)))
    }

    /// Sends the command that lets the show walk on.
    pub(super) fn urge(&mut self) {
        if self.calls.iter().any(|call| call.is_captains) {
            return;
        }
        let Some(status) = &self.status else { return };
        let request = request_to_walk(status.stops(), self.scenario.config.tables().head.speed_mps);
        self.begin_call(request, true);
    }
}
