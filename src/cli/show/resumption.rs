//! How a restarted server continues: from the last state that the show has seen. Pure.

use bench_dragon_ipc::Stop;

use super::bus::LastSeen;

/// The settings of a show on which the start of a restarted server depends.
#[derive(Clone, Copy, Debug, Default)]
pub struct ResumptionSettings {
    /// Whether the dragon walks on at once after a restart (`--auto-resume`).
    pub auto_resume: bool,
    /// Whether the show follows timecode.
    pub follows_timecode: bool,
    /// Whether the timecode ran at last.
    pub has_timecode_run: bool,
}

/// The start of a restarted server.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resumption {
    start_s: f64,
    travel_m: f64,
    speed_mps: Option<f64>,
    pub(super) is_paused: bool,
    is_ready: bool,
    /// Whether the server holds the dragon until a release.
    pub is_held: bool,
}

impl LastSeen {
    /// How a restarted server continues; `None` if no frame has arrived yet.
    pub fn resumption(&self, settings: ResumptionSettings) -> Option<Resumption> {
        let ResumptionSettings { auto_resume, follows_timecode, has_timecode_run } = settings;
        let header = self.header?;
        // A show that stood still with its timecode follows again. One that an operator paused is held. The newest pause may not be
        // in the status yet; while the timecode ran, it was the operator's.
        let was_paused = self.is_paused && follows_timecode && (has_timecode_run || self.stops().has(Stop::Paused));
        let is_ready = self.is_ready();
        Some(Resumption {
            start_s: header.show_time_s(),
            travel_m: header.course_m,
            speed_mps: self.ordered_mps,
            is_paused: self.is_paused && !follows_timecode,
            is_ready,
            is_held: !is_ready && (!auto_resume || self.is_held() || was_paused),
        })
    }
}

impl Resumption {
    /// The arguments of `serve` for this start.
    pub fn args(&self) -> Vec<String> {
        let flag = |is_set: bool, flag: &str| is_set.then(|| flag.to_owned());
        let mut args = vec![format!("--start-at={}", self.start_s), format!("--start-travel={}", self.travel_m)];
        args.extend(self.speed_mps.map(|speed_mps| format!("--start-speed={speed_mps}")));
        args.extend(flag(self.is_paused, "--paused"));
        args.extend(flag(self.is_ready, "--held"));
        args.extend(flag(self.is_held, "--restarted"));
        args
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{FrameHeader, ShowState, Status, Stops};

    use super::*;

    #[test]
    fn an_operators_pause_while_the_timecode_stands_holds_the_restarted_server() {
        let settings = ResumptionSettings { auto_resume: true, follows_timecode: true, has_timecode_run: false };
        for stops in [&[Stop::Timecode][..], &[Stop::Timecode, Stop::Paused]] {
            let mut seen = LastSeen::default();
            seen.see_frame(&FrameHeader { state: ShowState::Paused as u32, ..FrameHeader::default() });
            let stopped: Stops = stops.iter().copied().collect();
            seen.see_status(Status { stops: stopped.to_wire(), ..Status::default() });
            let is_held = seen.resumption(settings).map(|start| start.is_held);
            assert_eq!(is_held, Some(stops.contains(&Stop::Paused)), "{stops:?}");
        }
    }
}
