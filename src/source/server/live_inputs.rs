//! The inputs of a server's tick: a signal, the bus and the timecode.

use bench_dragon_ipc::{CommandEvent, EventKind, Refusal, Request, Sender};

use super::following::TimecodeFollowing;
use super::motion::HeadState;
use super::schedule::Schedule;
use super::simulation::{ReachedCue, Steering, TickInputs};
use crate::source::timecode::ShowPosition;
use crate::source::{Moment, SourcePorts};

/// The inputs of one tick. It records each of them.
pub(super) struct LiveInputs<'a> {
    pub(super) ports: &'a mut SourcePorts,
    pub(super) following: Option<&'a mut TimecodeFollowing>,
    pub(super) tick: u64,
    /// The schedule, whose next period is that of the tick.
    pub(super) schedule: &'a Schedule,
    /// Whether a signal has asked for the end of the run since the last tick.
    pub(super) is_signalled: bool,
}

impl LiveInputs<'_> {
    fn moment(&self, head: HeadState) -> Moment {
        Moment { show_time_ns: head.show_time_ns, overruns: self.schedule.overruns() }
    }
}

impl TickInputs for LiveInputs<'_> {
    fn requests(&mut self, head: HeadState, decide: &mut dyn FnMut(Request) -> Result<f64, Refusal>) {
        let moment = self.moment(head);
        if self.is_signalled {
            // A stop is always accepted.
            let _ = decide(Request::Stop);
            let stop = CommandEvent::plain(EventKind::Stop, Sender::Signal, self.tick);
            self.ports.report.commands.record(stop, moment);
        }
        self.ports.take_commands(self.tick, moment, decide);
    }

    fn steering(
        &mut self,
        head: HeadState,
        show: ShowPosition,
        seek: &mut dyn FnMut(f64) -> Result<(), Refusal>,
    ) -> Option<Steering> {
        let (moment, tick) = (self.moment(head), self.tick);
        let following = self.following.as_deref_mut()?;
        let report = &mut self.ports.report;
        let record = |event: CommandEvent| report.commands.record(CommandEvent { tick, ..event }, moment);
        let steering = following.steer(self.schedule.due_ns(), show, seek, record);
        let (kind, state) = following.timecode();
        report.report_timecode(kind, state);
        Some(steering)
    }

    fn reached(&mut self, head: HeadState, cue: ReachedCue) {
        let moment = self.moment(head);
        self.ports.report.commands.record(cue.event(self.tick), moment);
    }
}
