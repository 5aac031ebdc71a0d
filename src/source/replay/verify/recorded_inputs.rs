//! The inputs of a tick as the record of commands has them.

use bench_dragon_ipc::{CommandEvent, EventKind, FrameHeader, Refusal, Request, Sender};

use super::comparison::{Difference, Periods};
use super::events::RunEvents;
use super::run_check::unverifiable;
use super::{RunVerdict, RunVerification};
use crate::source::server::motion::HeadState;
use crate::source::server::{Steering, TickInputs};
use crate::source::timecode::{Follower, ShowPosition};

/// The timecode's effect on the show as last recorded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timecode {
    stands: bool,
    /// Whether the timecode determines the show time. Then the time scale comes from the frames.
    leads: bool,
    time_scale: f64,
}

/// The recorded inputs of one tick, with the verdict on what differs from the record.
pub(super) struct RecordedInputs<'a> {
    pub(super) events: &'a mut RunEvents,
    pub(super) timecode: &'a mut Option<Timecode>,
    pub(super) periods: &'a mut Periods,
    pub(super) tick: u64,
    /// The header of the tick's frame; `None` for a missing frame.
    pub(super) header: Option<&'a FrameHeader>,
    /// Counts the inputs.
    pub(super) found: &'a mut RunVerification,
    pub(super) fault: Option<RunVerdict>,
}

type Decide<'a> = &'a mut dyn FnMut(Request) -> Result<f64, Refusal>;

impl TickInputs for RecordedInputs<'_> {
    fn requests(&mut self, _head: HeadState, decide: Decide<'_>) {
        // The timecode's own seek is not an operator's: it comes with the steering.
        let outcome = self.take_events(|event| event.sender != Sender::Timecode.to_wire(), decide);
        self.note_fault(outcome);
    }

    fn steering(
        &mut self,
        _head: HeadState,
        _show: ShowPosition,
        seek: &mut dyn FnMut(f64) -> Result<(), Refusal>,
    ) -> Option<Steering> {
        let changes_before = self.found.timecode;
        let outcome = self.take_events(|_| true, &mut |request| match request {
            Request::Seek { show_time_s } => seek(show_time_s).map(|()| 0.0),
            _ => Err(Refusal::Unknown),
        });
        self.note_fault(outcome);
        let steering = self.effect(self.found.timecode > changes_before);
        self.note_fault(steering).flatten()
    }
}

impl RecordedInputs<'_> {
    /// Takes events of this tick as long as they are wanted.
    fn take_events(&mut self, is_wanted: impl Fn(&CommandEvent) -> bool, decide: Decide<'_>) -> Result<(), RunVerdict> {
        let is_due = |event: &CommandEvent, tick| event.tick <= tick && is_wanted(event);
        while let Some(event) = self.events.events.next_if(|event| is_due(event, self.tick)) {
            self.periods.agree_with(&event, self.header)?;
            match (event.event_kind(), event.request()) {
                (Some(EventKind::Stand | EventKind::Follow), _) => {
                    *self.timecode = Some(timecode(&event)?);
                    self.found.timecode += 1;
                }
                (_, Some(request)) => self.repeat(request, &event, decide)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Repeats a recorded request. The simulation must give the recorded reply.
    fn repeat(&mut self, request: Request, event: &CommandEvent, decide: Decide<'_>) -> Result<(), RunVerdict> {
        let recorded = event.outcome();
        // The server, not its simulation, refuses unknown commands. The other run of a grant (`OtherRun`) is not recorded.
        if let Err(Refusal::OtherRun | Refusal::Unknown) = recorded {
            return Ok(());
        }
        let simulated = decide(request).map(|_course_mps| ());
        if simulated != recorded {
            let of_event = FrameHeader { tick: event.tick, show_time_ns: event.show_time_ns, ..FrameHeader::default() };
            let [recorded, simulated] = [recorded, simulated].map(|outcome| match outcome {
                Ok(()) => "accepted".to_owned(),
                Err(refusal) => format!("refused ({})", refusal.explain(&request)),
            });
            let field = format!("command event {}", event.number);
            return Err(Difference::in_words(self.header.unwrap_or(&of_event), &field, recorded, simulated));
        }
        let is_grant = matches!(request, Request::Grant { .. });
        self.found.grants += u64::from(simulated.is_ok() && is_grant);
        self.found.commands += u64::from(simulated.is_ok() && !is_grant);
        Ok(())
    }

    /// The timecode's effect from this tick on; `None` without timecode.
    fn effect(&self, has_changed: bool) -> Result<Option<Steering>, RunVerdict> {
        let Some(Timecode { stands, leads, time_scale }) = *self.timecode else { return Ok(None) };
        let steering = |time_scale| Ok(Some(Steering { stands, leads, time_scale }));
        if !leads || has_changed {
            return steering(time_scale);
        }
        // While the timecode leads, the show does not catch up, so the frame contains the timecode's time scale itself.
        let Some(header) = self.header else {
            let reason = "its frame is missing, and with it the time scale by which the show followed the timecode";
            return Err(unverifiable(self.tick, reason));
        };
        require_time_scale(header.time_scale).map_err(|range| {
            Difference::in_words(header, "time_scale", header.time_scale.to_string(), format!("a value {range}"))
        })?;
        steering(header.time_scale)
    }

    /// Keeps the first fault.
    fn note_fault<T>(&mut self, outcome: Result<T, RunVerdict>) -> Option<T> {
        outcome
            .map_err(|fault| {
                self.fault.get_or_insert(fault);
            })
            .ok()
    }
}

/// The timecode's effect in a recorded event.
fn timecode(event: &CommandEvent) -> Result<Timecode, RunVerdict> {
    let [leads, time_scale, ..] = event.values;
    require_time_scale(time_scale).map_err(|range| {
        unverifiable(event.tick, format!("the recorded time scale is {time_scale}, must be {range}"))
    })?;
    let stands = event.event_kind() == Some(EventKind::Stand);
    Ok(Timecode { stands, leads: leads != 0.0, time_scale })
}

/// Checks that a follower of timecode can give this time scale.
fn require_time_scale(time_scale: f64) -> Result<(), String> {
    let (least, greatest) = (Follower::LEAST_TIME_SCALE, Follower::GREATEST_TIME_SCALE);
    if (least - 1e-9..=greatest + 1e-9).contains(&time_scale) {
        return Ok(());
    }
    Err(format!("from {least} to {greatest} with timecode"))
}
