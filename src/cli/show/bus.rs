//! The ports of a show on the bus, and the last known state of the dragon.

use bench_dragon_ipc::{
    BusError, CommandEvent, CommandEventReader, Domain, FrameHeader, FrameSubscriber, ReaderReports, ShowState, Status,
    StatusReader, Stop, Stops,
};

pub(super) struct ShowPorts {
    pub(super) frames: FrameSubscriber,
    pub(super) status: StatusReader,
    readers: ReaderReports,
    commands: CommandEventReader,
}

impl ShowPorts {
    /// Opens the ports. They stay valid after a restart of the server.
    pub(super) fn open(domain: &Domain) -> Result<Self, BusError> {
        let status = StatusReader::open(domain, "show-status")?;
        let readers = ReaderReports::open(domain, "show-readers")?;
        let commands = CommandEventReader::open(domain, "show-commands")?;
        // The frames last, so that the other ports are open at the first frame.
        Ok(Self { frames: FrameSubscriber::open(domain, "show")?, status, readers, commands })
    }

    /// The oldest command event that has not been read yet.
    pub(super) fn next_command(&self) -> Result<Option<CommandEvent>, BusError> {
        self.commands.receive()
    }

    /// Process ids of the readers that have reported since the last call and have not ended.
    pub(super) fn living_readers(&self) -> Vec<u32> {
        // An unreadable report comes from a killed reader, and is skipped.
        let reports = std::iter::from_fn(|| self.readers.receive().ok().flatten());
        reports.filter(|report| report.ended == 0).map(|report| report.pid).collect()
    }
}

/// The last known state, from frames and statuses.
#[derive(Clone, Debug, Default)]
pub struct LastSeen {
    /// The header of the newest frame.
    pub header: Option<FrameHeader>,
    /// The newest status.
    pub status: Option<Status>,
    /// The last ordered speed along the course, in metres per show second.
    pub ordered_mps: Option<f64>,
    /// Whether the show was paused when it was last not held. A hold hides a pause.
    pub is_paused: bool,
    /// Run and tick of the last frame that was paused.
    paused_at: Option<(u64, u64)>,
}

impl LastSeen {
    /// Notes a frame.
    pub fn see_frame(&mut self, header: &FrameHeader) {
        match header.show_state() {
            Some(ShowState::Running) => {
                self.is_paused = false;
            }
            Some(ShowState::Paused) => {
                (self.is_paused, self.paused_at) = (true, Some((header.run_id, header.tick)));
            }
            Some(ShowState::Stopping) => self.is_paused = self.stops().has(Stop::Paused),
            _ => {}
        }
        self.header = Some(*header);
    }

    /// Notes a command's event.
    pub fn see_event(&mut self, event: &CommandEvent) {
        self.ordered_mps = event.ordered_mps().or(self.ordered_mps);
    }

    /// Notes a status. It names the operator's pause where a frame's state hides it: held, ready and finished.
    pub fn see_status(&mut self, status: Status) {
        let hides_pause = |header: &FrameHeader| {
            let state = header.show_state();
            status.run_id == header.run_id && !matches!(state, Some(ShowState::Running | ShowState::Paused))
        };
        // A status may be older than the last frame that was paused.
        let is_older = self.paused_at.is_some_and(|(run_id, tick)| run_id == status.run_id && tick > status.tick);
        if self.header.as_ref().is_some_and(hides_pause) {
            self.is_paused = status.stops().has(Stop::Paused) || self.is_paused && is_older;
        }
        self.status = Some(status);
    }

    /// Whether the show has reached its end in this frame, and had not before.
    pub(super) fn finishes_with(&self, header: &FrameHeader) -> bool {
        let is_finished = |header: &FrameHeader| header.show_state() == Some(ShowState::Finished);
        is_finished(header) && !self.header.as_ref().is_some_and(is_finished)
    }

    /// The reasons that keep the head from walking, by the newest status.
    pub(super) fn stops(&self) -> Stops {
        self.status.as_ref().map(Status::stops).unwrap_or_default()
    }

    /// Whether an operator holds the show. A guard's stop is not a hold, because the next grant lifts it. The status is older than
    /// the frame: a head that brakes for a reason that the status does not have is held.
    pub(super) fn is_held(&self) -> bool {
        let (held, others) = (self.stops().has(Stop::Held), [Stop::Paused, Stop::Timecode, Stop::Ending]);
        // The status of a restarted server comes before its first frame.
        let is_of_newer_run = |header: FrameHeader| self.status.is_some_and(|status| status.run_id != header.run_id);
        self.header.is_some_and(|header| match header.show_state() {
            _ if is_of_newer_run(header) && held => true,
            Some(ShowState::Held) => {
                held || self.status.as_ref().is_none_or(|status| header.course_m != status.granted_to_m)
            }
            Some(ShowState::Stopping) => held || !others.into_iter().any(|stop| self.stops().has(stop)),
            _ => false,
        })
    }

    /// Whether the show still waits at its start for its first release.
    pub(super) fn is_ready(&self) -> bool {
        self.header.is_some_and(|header| header.show_state() == Some(ShowState::Ready))
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{CommandReply, Refusal, Request};

    use super::*;

    fn frame(state: ShowState, head_travel_m: f64) -> FrameHeader {
        FrameHeader { state: state as u32, head_travel_m, head_speed_mps: 0.8, ..FrameHeader::default() }
            .of_one_dragon()
    }

    #[test]
    fn a_guards_stop_at_the_end_of_its_grant_is_not_a_hold() {
        let mut seen = LastSeen::default();
        seen.see_frame(&frame(ShowState::Held, 7.0));
        assert!(seen.is_held());
        seen.status = Some(Status { granted_to_m: 7.0, ..Status::default() });
        assert!(!seen.is_held());
        seen.status = Some(Status { granted_to_m: 8.0, ..Status::default() });
        assert!(seen.is_held());
    }

    /// A status of the same run with these stops.
    fn status(stops: Stops, granted_to_m: f64) -> Status {
        Status { stops: stops.to_wire(), granted_to_m, ..Status::default() }
    }

    #[test]
    fn an_operators_hold_at_the_end_of_the_grant_is_a_hold() {
        let mut seen = LastSeen::default();
        seen.see_frame(&frame(ShowState::Held, 7.0));
        seen.see_status(status(Stops::from([Stop::GuardLimit]), 7.0));
        assert!(!seen.is_held());
        seen.see_status(status(Stops::from([Stop::GuardLimit, Stop::Held]), 7.0));
        assert!(seen.is_held());
    }

    #[test]
    fn a_restarted_server_that_is_killed_before_its_first_frame_was_held_by_its_status() {
        let mut seen = LastSeen::default();
        seen.see_frame(&frame(ShowState::Paused, 7.0));
        seen.see_status(Status { run_id: 1, ..status(Stops::from([Stop::Held]), 9.0) });
        assert!(seen.is_held());
    }

    #[test]
    fn a_head_that_brakes_for_an_unknown_reason_is_held() {
        let mut seen = LastSeen::default();
        seen.see_status(status(Stops::default(), 9.0));
        seen.see_frame(&frame(ShowState::Stopping, 7.0));
        assert!(seen.is_held());
        seen.see_status(status(Stops::from([Stop::Paused]), 9.0));
        assert!(!seen.is_held() && seen.is_paused);
    }

    #[test]
    fn a_pause_during_a_hold_or_at_the_end_stays() {
        for state in [ShowState::Held, ShowState::Ready, ShowState::Finished] {
            let mut seen = LastSeen::default();
            seen.see_frame(&frame(state, 7.0));
            seen.see_status(status(Stops::from([Stop::Paused, Stop::Held]), 9.0));
            seen.see_frame(&frame(state, 7.0));
            assert!(seen.is_paused, "{state:?}");
            assert!(seen.resumption(super::super::ResumptionSettings::default()).is_some_and(|start| start.is_paused));
        }
    }

    #[test]
    fn a_server_killed_during_a_ramp_starts_again_with_the_ordered_speed() {
        let event = |request: Request, refused: Option<Refusal>, course_mps: f64| {
            let reply = refused.map_or(CommandReply::accepted(1, 9), |refusal| CommandReply::refused(1, 9, refusal));
            CommandEvent::answered(&request.to_wire(), &reply).ordering(course_mps)
        };
        let mut seen = LastSeen::default();
        seen.see_frame(&frame(ShowState::Running, 7.0));
        let speed = |seen: &LastSeen| {
            let start = seen.resumption(super::super::ResumptionSettings::default()).expect("a frame has arrived");
            start.args().into_iter().find(|arg| arg.starts_with("--start-speed="))
        };
        assert_eq!(speed(&seen), None);
        seen.see_event(&event(Request::Pace { factor: 0.5 }, None, 0.6));
        assert_eq!(speed(&seen), Some("--start-speed=0.6".to_owned()));
        seen.see_event(&event(Request::Speed { speed_mps: 99.0 }, Some(Refusal::Unknown), 0.6));
        seen.see_event(&event(Request::Hold, None, 0.6));
        seen.see_frame(&frame(ShowState::Stopping, 7.1));
        assert_eq!(speed(&seen), Some("--start-speed=0.6".to_owned()));
    }

    #[test]
    fn a_pause_stays_through_a_hold_and_ends_with_a_running_frame() {
        let mut seen = LastSeen::default();
        seen.see_frame(&frame(ShowState::Running, 1.0));
        assert!(!seen.is_paused);
        seen.see_frame(&frame(ShowState::Paused, 1.0));
        seen.see_frame(&frame(ShowState::Held, 1.0));
        assert!(seen.is_paused && seen.is_held());
        seen.see_frame(&frame(ShowState::Running, 1.1));
        assert!(!seen.is_paused && !seen.is_held());
    }
}
