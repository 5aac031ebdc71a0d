//! The sender of timecode.

use bench_dragon::source::server::Steering;
use bench_dragon::source::timecode::Position;
use bench_dragon_ipc::{FrameHeader, ShowState};

use super::{Event, MS_NS, World};
use crate::fault::TimecodeFault;
use crate::promises::Promise;
use crate::scenario::SECOND_NS;

/// Period of the timecode's packets.
pub(super) const TIMECODE_NS: u64 = 40 * MS_NS;
/// Time without a fault after which a show is where its timecode is, and its greatest distance: the follower's jump, and the time
/// between two packets and two ticks.
const STEADY_NS: u64 = 8 * SECOND_NS;
const FARTHEST_S: f64 = 1.2;
/// Greatest deviation of a pace that the show follows.
const PACE_RANGE: f64 = 0.05;

/// The sender of timecode.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sender {
    pub(super) position_s: f64,
    pub(super) pace: f64,
    pub(super) stands: bool,
    pub(super) silent_until: u64,
    /// Greatest speed of a show so far, and the number of times at most that it has braked from there since its last seek.
    pub(super) fastest_mps: f64,
    pub(super) stood: u32,
}

impl World<'_> {
    pub(super) fn fail_timecode(&mut self, fault: TimecodeFault) {
        let sender = &mut self.sender;
        match fault {
            TimecodeFault::Jump(seconds) => sender.position_s = (sender.position_s + seconds).max(0.0),
            TimecodeFault::Stand => (sender.stands, sender.stood) = (!sender.stands, sender.stood + 1),
            TimecodeFault::Silent(ns) => sender.silent_until = self.now_ns + ns,
            TimecodeFault::Pace(pace) => sender.pace = pace,
            TimecodeFault::Stray(seconds) => {
                let position_s = (sender.position_s + seconds).max(0.0);
                self.hear_timecode(position_s);
            }
        }
    }

    /// Checks that a show which has run for some time without a fault is where its timecode is. It then seeks no more. A
    /// guarded head may have to wait for its grant.
    pub(super) fn check_timecode(&mut self, header: &FrameHeader, steering: Option<Steering>, has_sought: bool) {
        let config = &self.scenario.config;
        let sender = &mut self.sender;
        sender.fastest_mps = sender.fastest_mps.max(header.course_mps);
        // A head with ramps comes to rest ahead of a timecode that stands. The pace removes that lead, or a seek does.
        let braking_s = config.accel_mps2().map_or(0.0, |accel_mps2| sender.fastest_mps / accel_mps2);
        let lead_s = f64::from(sender.stood) * braking_s;
        // Beyond this range of paces, the follower seeks.
        let may_seek = (sender.pace - 1.0).abs() > PACE_RANGE || lead_s > 0.0;
        if has_sought {
            sender.stood = 0;
        }
        let runs = header.show_state() == Some(ShowState::Running) && steering.is_some_and(|steering| steering.leads);
        if !runs || self.scenario.is_guarded() {
            self.steady_ns = self.now_ns;
        }
        if self.now_ns - self.steady_ns < STEADY_NS {
            return;
        }
        let off_s = header.show_time_s() - self.sender.position_s;
        let is_within = (config.start_s()..config.last_seek_s()).contains(&self.sender.position_s);
        self.promises.require(
            Promise::FollowsTimecode,
            self.now_ns,
            !is_within || (-FARTHEST_S..FARTHEST_S + lead_s).contains(&off_s) && (!has_sought || may_seek),
            || format!("the show is {off_s} s from its timecode: {header:?}"),
        );
    }

    pub(super) fn send_timecode(&mut self) {
        let sender = &mut self.sender;
        if !sender.stands {
            sender.position_s += sender.pace * TIMECODE_NS as f64 * 1e-9;
        }
        let position_s = sender.position_s;
        if sender.silent_until <= self.now_ns {
            self.hear_timecode(position_s);
        }
        self.after(TIMECODE_NS, Event::Timecode);
    }

    pub(super) fn hear_timecode(&mut self, position_s: f64) {
        let (Some(server), Ok(position)) = (&mut self.server, Position::of_seconds(position_s.rem_euclid(86_400.0)))
        else {
            return;
        };
        server.hear(position, self.now_ns);
        self.watch.heard_timecode_ns = self.now_ns;
    }
}
