//! The server's process: the production simulation and schedule on the simulated clock.

use std::collections::VecDeque;

use bench_dragon::source::server::motion::{HeadState, Limits};
use bench_dragon::source::server::schedule::Schedule;
use bench_dragon::source::server::{ReachedCue, Simulation, Steering, TickInputs, TimecodeFollowing};
use bench_dragon::source::timecode::{FollowerSettings, Position, SampleQueue, ShowPosition, TimecodeSample};
use bench_dragon::source::{CommandLog, Moment, answer_command};
use bench_dragon_ipc::service::MAX_ACTIVE_REQUESTS;
use bench_dragon_ipc::{
    CommandEvent, CommandReply, EventKind, FrameHeader, HandleState, Refusal, Request, RunStart, Sender, ShowState,
    Status, Stops, TimecodeKind, TimecodeState,
};
use rtrb::{Consumer, Producer};

use crate::scenario::Scenario;
use crate::world::Caller;

/// Time from the start of the schedule to release 0, as in the server.
const LEAD_NS: u64 = 1_000_000;

/// A running server.
#[derive(Debug)]
pub(crate) struct Server {
    pub(crate) run_id: u64,
    /// Number of the process, which tells its events from those of an earlier one.
    pub(crate) life: u64,
    pub(crate) start: RunStart,
    pub(crate) stopped_until_ns: u64,
    /// Requests that wait for the next tick.
    pub(crate) requests: VecDeque<(Caller, Request)>,
    /// Time that the next tick takes.
    pub(crate) busy_ns: u64,
    simulation: Simulation,
    schedule: Schedule,
    tick: u64,
    missed: u64,
    handles: Vec<HandleState>,
    following: Option<(TimecodeFollowing, Producer<TimecodeSample>)>,
    log: CommandLog,
    /// Events that the reporting thread publishes next.
    pub(crate) events: Consumer<CommandEvent>,
}

/// A request with its reply.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decided {
    /// `None` for the follower of timecode.
    pub(crate) caller: Option<Caller>,
    pub(crate) request: Request,
    pub(crate) outcome: Result<(), Refusal>,
    /// The reply of the server; that of the follower has none.
    pub(crate) reply: Option<CommandReply>,
}

/// The results of one tick.
#[derive(Debug)]
pub(crate) struct Ticked<'a> {
    pub(crate) header: FrameHeader,
    pub(crate) handles: &'a [HandleState],
    pub(crate) missed: u64,
    /// The head before the requests, after the missed periods.
    pub(crate) before: HeadState,
    pub(crate) decided: Vec<Decided>,
    pub(crate) steering: Option<Steering>,
    /// Numbers of the cues that the show has reached.
    pub(crate) reached: Vec<usize>,
    pub(crate) behind_ns: u64,
    pub(crate) stops: Stops,
    pub(crate) limits: Limits,
}

/// The inputs of one tick.
struct Inputs<'a> {
    requests: &'a mut VecDeque<(Caller, Request)>,
    following: Option<&'a mut TimecodeFollowing>,
    due_ns: u64,
    run_id: u64,
    tick: u64,
    overruns: u64,
    log: &'a mut CommandLog,
    before: Option<HeadState>,
    decided: Vec<Decided>,
    steering: Option<Steering>,
    reached: Vec<usize>,
}

impl Inputs<'_> {
    fn moment(&self, head: HeadState) -> Moment {
        Moment { show_time_ns: head.show_time_ns, overruns: self.overruns }
    }
}

impl TickInputs for Inputs<'_> {
    fn requests(&mut self, head: HeadState, decide: &mut dyn FnMut(Request) -> Result<f64, Refusal>) {
        self.before = Some(head);
        let moment = self.moment(head);
        for _ in 0..MAX_ACTIVE_REQUESTS {
            let Some((caller, request)) = self.requests.pop_front() else { return };
            // Requests pass the wire, as on the bus.
            let (reply, event) = answer_command(&request.to_wire(), self.run_id, self.tick, &mut *decide);
            self.log.record(event, moment);
            let outcome = reply.outcome().map(|_tick| ());
            self.decided.push(Decided { caller: Some(caller), request, outcome, reply: Some(reply) });
        }
    }

    fn steering(
        &mut self,
        head: HeadState,
        show: ShowPosition,
        seek: &mut dyn FnMut(f64) -> Result<(), Refusal>,
    ) -> Option<Steering> {
        let moment = self.moment(head);
        let following = self.following.as_deref_mut()?;
        let (decided, log, tick) = (&mut self.decided, &mut *self.log, self.tick);
        let mut seek = |show_time_s| {
            let outcome = seek(show_time_s);
            decided.push(Decided { caller: None, request: Request::Seek { show_time_s }, outcome, reply: None });
            outcome
        };
        let record = |event: CommandEvent| log.record(CommandEvent { tick, ..event }, moment);
        self.steering = Some(following.steer(self.due_ns, show, &mut seek, record));
        self.steering
    }

    fn reached(&mut self, head: HeadState, cue: ReachedCue) {
        self.reached.push(cue.number);
        self.log.record(cue.event(self.tick), self.moment(head));
    }
}

impl Server {
    pub(crate) fn new(scenario: &Scenario, start: RunStart, run_id: u64, life: u64, now_ns: u64) -> Self {
        let config = &scenario.config;
        let mut simulation = Simulation::of_run(config, &start, run_id).expect("the start of the run is valid");
        let following = scenario.flags.timecode.then(|| {
            simulation.follow();
            let settings = FollowerSettings {
                offset_s: 0.0,
                timeout_ns: 1_000_000_000,
                period_s: config.tick_s(),
                first_s: config.start_s(),
                last_s: start.until_s.map_or(config.last_seek_s(), |until_s| until_s.min(config.last_seek_s())),
            };
            let (samples, inbox) = SampleQueue::with_sender();
            (TimecodeFollowing::new(settings, TimecodeKind::Osc, inbox).0, samples)
        });
        let (mut log, events) = CommandLog::new(run_id, || 0);
        let moment = Moment { show_time_ns: simulation.motion().head().show_time_ns, overruns: 0 };
        log.record(start.event(life as u32), moment);
        Self {
            run_id,
            life,
            start,
            stopped_until_ns: 0,
            requests: VecDeque::new(),
            busy_ns: 0,
            simulation,
            schedule: Schedule::new(now_ns + LEAD_NS, config.tables().serve.rate_hz),
            tick: 0,
            missed: 0,
            handles: vec![HandleState::default(); config.formation().layout().handles()],
            following,
            log,
            events,
        }
    }

    /// Instant of the next tick.
    pub(crate) fn due_ns(&self) -> u64 {
        self.schedule.due_ns()
    }

    /// Takes a packet of timecode. A full queue drops it.
    pub(crate) fn hear(&mut self, position: Position, arrived_ns: u64) {
        if let Some((_, samples)) = &mut self.following {
            let _ = samples.push(TimecodeSample { position, arrived_ns });
        }
    }

    /// Runs the tick that is due.
    pub(crate) fn tick(&mut self) -> Ticked<'_> {
        let missed = self.missed;
        let mut inputs = Inputs {
            requests: &mut self.requests,
            following: self.following.as_mut().map(|(following, _)| following),
            due_ns: self.schedule.due_ns(),
            run_id: self.run_id,
            tick: self.tick,
            overruns: self.schedule.overruns(),
            log: &mut self.log,
            before: None,
            decided: Vec::new(),
            steering: None,
            reached: Vec::new(),
        };
        self.simulation.tick(missed, &mut inputs);
        let Inputs { before, decided, steering, reached, .. } = inputs;
        let header = self.simulation.header(self.run_id, self.tick, self.schedule.due_ns());
        self.simulation.write(&mut self.handles);
        if header.show_state() == Some(ShowState::Ended) {
            let moment = Moment { show_time_ns: header.show_time_ns, overruns: self.schedule.overruns() };
            self.log.record(CommandEvent::plain(EventKind::End, Sender::Server, self.tick), moment);
        }
        self.tick += 1;
        let motion = self.simulation.motion();
        Ticked {
            header,
            handles: &self.handles,
            missed,
            before: before.expect("every tick asks for its requests"),
            decided,
            steering,
            reached,
            behind_ns: self.simulation.behind_ns()[0],
            stops: motion.stops(),
            limits: motion.limits(),
        }
    }

    /// Moves to the next release, at the reading of the clock at the end of a tick.
    pub(crate) fn end_tick(&mut self, now_ns: u64) {
        self.missed = self.schedule.advance(now_ns);
    }

    /// The status that the reporter's thread publishes.
    pub(crate) fn status(&self) -> Status {
        let motion = self.simulation.motion();
        let (head, limits) = (motion.head(), motion.limits());
        let travel = |travel_m: Option<f64>| travel_m.unwrap_or(Status::NONE);
        let followed = self.following.as_ref().map(|(following, _)| following.timecode());
        let (timecode_kind, timecode) = followed.unwrap_or((TimecodeKind::None, TimecodeState::None));
        Status {
            run_id: self.run_id,
            tick: self.tick.saturating_sub(1),
            show_time_ns: head.show_time_ns,
            overruns: self.schedule.overruns(),
            behind_ns: self.simulation.behind_ns()[0],
            most_behind_ns: self.simulation.behind_ns()[1],
            granted_to_m: travel(limits.granted_to_m),
            asked_m: travel(limits.asked_m),
            guard_end_m: travel(limits.end_m),
            rate_hz: self.schedule.rate_hz(),
            state: head.state.to_wire(),
            stops: motion.stops().to_wire(),
            timecode: timecode.to_wire(),
            timecode_kind: timecode_kind.to_wire(),
            ..Status::default()
        }
    }
}
