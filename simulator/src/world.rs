//! The world: one thread that carries a scenario out, event after event.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;
use std::time::Instant;

use bench_dragon::source::server::Steering;
use bench_dragon::source::timecode::Position;
use bench_dragon_ipc::{FrameHeader, Refusal, Request, ShowState, Status, Stop, TimecodeState};
use zerocopy::IntoBytes as _;

use crate::agenda::Agenda;
use crate::fault::{FaultKind, Part, TimecodeFault};
use crate::guard::{Findings, GuardProcess, GuardStep};
use crate::promises::{Broken, Promise, Promises};
use crate::scenario::{SECOND_NS, Scenario};
use crate::server::{Decided, Server};
use crate::supervisor::{ChildState, Supervisor};

const MS_NS: u64 = 1_000_000;
/// Time from a process's start until it has joined the bus.
const START_NS: u64 = 60 * MS_NS;
/// Period at which the show looks at its children and the bus.
const LOOK_NS: u64 = 50 * MS_NS;
/// Period of the status.
const REPORT_NS: u64 = 100 * MS_NS;
/// Longest time of a message on the bus, and of a process until it wakes.
const MESSAGE_NS: u64 = MS_NS;
/// Longest time of a usual proof of the guard.
const PROOF_NS: u64 = 30 * MS_NS;
/// Longest wait of an operator, and of the guard, for a reply.
const OPERATOR_PATIENCE_NS: u64 = 5 * SECOND_NS;
const GUARD_PATIENCE_NS: u64 = 2 * SECOND_NS;
/// Period at which an operator's client repeats a seek that is not proved yet.
const PROOF_PERIOD_NS: u64 = 20 * MS_NS;
/// Period of the timecode's packets.
const TIMECODE_NS: u64 = 40 * MS_NS;
/// Period of the captain, who leads the show to its end after the faults.
const CAPTAIN_NS: u64 = SECOND_NS;
/// Longest time after the faults until the show walks. Restarts wait up to 30 s, and a child has 30 s to its first sign of life.
const SETTLE_NS: u64 = 180 * SECOND_NS;

/// Longest delay before a restart.
const LONGEST_BACKOFF_NS: u64 = 30 * SECOND_NS;

/// Time without a fault after which a show is where its timecode is, and its greatest distance: the follower's jump, and the time
/// between two packets and two ticks.
const STEADY_NS: u64 = 8 * SECOND_NS;
const FARTHEST_S: f64 = 1.2;

/// The process that waits for a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Caller {
    /// A guard's thread: its process and its question.
    Guard(u64, u64),
    /// An operator's client, by number.
    Operator(u64),
}

#[derive(Clone, Copy, Debug)]
enum Event {
    Fault(usize),
    Look,
    ServerJoins(u64),
    Tick(u64),
    Report(u64),
    GuardJoins(u64),
    /// The monitor wakes for its frames.
    Frames(u64),
    /// The guard's thread wakes.
    Work(u64),
    GuardSends(u64, u64, Request),
    Arrives(Caller, Request, u64),
    Replied(Caller, Option<Result<u64, Refusal>>),
    GivesUp(Caller),
    ForeignEnds(u64),
    Timecode,
    Captain,
}

/// What a play of a scenario came to.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The first broken promise.
    pub broken: Option<Broken>,
    /// Hash of all frames, replies, ends and starts.
    pub trace: u64,
    /// Length of the play, in nanoseconds of the simulated clock.
    pub length_ns: u64,
    /// Faults and commands that happened.
    pub faults: u64,
    /// Frames published.
    pub frames: u64,
    /// Runs of the server, and shows.
    pub runs: u64,
    /// Shows that have begun.
    pub shows: u64,
    /// Metres that the heads have walked.
    pub walked_m: f64,
    /// Commands and grants that a server has answered.
    pub replies: u64,
}

/// Plays a scenario up to the end of its show, or to the first broken promise.
pub fn play(scenario: &Scenario) -> Outcome {
    let mut world = World::new(scenario);
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| world.run())) {
        let text = panic.downcast_ref::<String>().map_or("a panic", String::as_str);
        world.promises.require(Promise::NothingPanics, world.now_ns, false, || text.to_owned());
    }
    world.outcome()
}

/// Windows in which the bus or a process is bad, each up to an instant.
#[derive(Clone, Copy, Debug, Default)]
struct Windows {
    clock_stands_until: u64,
    clock_stood_at: u64,
    requests_lost_until: u64,
    requests_late: (u64, u64),
    replies_lost_until: u64,
    frames_lost_until: u64,
    proofs_slow: (u64, u64),
}

/// An operator's command on its way.
#[derive(Clone, Copy, Debug)]
struct Call {
    number: u64,
    request: Request,
    begun_ns: u64,
    is_captains: bool,
}

/// The sender of timecode.
#[derive(Clone, Copy, Debug)]
struct Sender {
    position_s: f64,
    pace: f64,
    stands: bool,
    silent_until: u64,
}

/// How far the captain has led the show to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Captain {
    Waits,
    /// Leads the show to a walk. Instant by which it walks.
    Leads(u64),
    /// Has asked for a seek. Instant by which the head has got there.
    Seeks(u64),
    /// Has sent a stop. Instant by which the show has ended.
    Stops(u64),
    Done,
}

struct World<'a> {
    scenario: &'a Scenario,
    epoch: Instant,
    now_ns: u64,
    agenda: Agenda<Event>,
    server: Option<Server>,
    guards: Vec<GuardProcess<'a>>,
    supervisor: Supervisor,
    status: Option<Rc<Status>>,
    newest: Option<FrameHeader>,
    /// Whether a frame has arrived since the last look.
    has_news: bool,
    /// Instants at which the server and the guard last ran, by the looks.
    lived_ns: [u64; 2],
    /// Instants at which they were last not stopped.
    hung_ns: [u64; 2],
    is_over: bool,
    windows: Windows,
    calls: Vec<Call>,
    sender: Sender,
    /// Instant of the last fault, or at which a show with timecode last did not run.
    steady_ns: u64,
    captain: Captain,
    /// Whether the captain's seek was accepted.
    has_sought: bool,
    promises: Promises<'a>,
    trace: DefaultHasher,
    next_life: u64,
    counts: Outcome,
}

impl<'a> World<'a> {
    fn new(scenario: &'a Scenario) -> Self {
        let epoch = Instant::now();
        let sender = Sender { position_s: 10.0, pace: 1.0, stands: false, silent_until: 0 };
        let counts = Outcome {
            broken: None,
            trace: 0,
            length_ns: 0,
            faults: 0,
            frames: 0,
            runs: 0,
            shows: 0,
            walked_m: 0.0,
            replies: 0,
        };
        Self {
            scenario,
            epoch,
            now_ns: 0,
            agenda: Agenda::new(),
            server: None,
            guards: Vec::new(),
            supervisor: Supervisor::new(scenario, 0, epoch),
            status: None,
            newest: None,
            has_news: false,
            lived_ns: [0; 2],
            hung_ns: [0; 2],
            is_over: false,
            windows: Windows::default(),
            calls: Vec::new(),
            sender,
            steady_ns: 0,
            captain: Captain::Waits,
            has_sought: false,
            promises: Promises::new(scenario),
            trace: DefaultHasher::new(),
            next_life: 0,
            counts,
        }
    }

    fn run(&mut self) {
        for number in 0..self.scenario.faults.len() {
            self.agenda.add(self.scenario.faults[number].at_ns, Event::Fault(number));
        }
        self.agenda.add(self.scenario.length_ns + SECOND_NS, Event::Captain);
        if self.scenario.flags.timecode {
            self.agenda.add(TIMECODE_NS, Event::Timecode);
        }
        self.begin_show();
        self.agenda.add(LOOK_NS, Event::Look);
        while self.captain != Captain::Done && self.promises.broken.is_none() {
            let Some((at_ns, event)) = self.agenda.next() else { return };
            self.now_ns = at_ns;
            self.handle(event);
        }
    }

    fn outcome(self) -> Outcome {
        Outcome { broken: self.promises.broken, trace: self.trace.finish(), length_ns: self.now_ns, ..self.counts }
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Fault(number) => self.fail(self.scenario.faults[number].kind),
            Event::Look => self.look(),
            Event::ServerJoins(life) => self.join_server(life),
            Event::Tick(life) => self.tick(life),
            Event::Report(life) => self.report(life),
            Event::GuardJoins(life) => self.join_guard(life),
            Event::Frames(life) => self.read_frames(life),
            Event::Work(life) => self.work(life),
            Event::GuardSends(life, number, request) => self.send(Caller::Guard(life, number), request),
            Event::Arrives(caller, request, run_life) => self.arrive(caller, request, run_life),
            Event::Replied(caller, reply) => self.take_reply(caller, reply),
            Event::GivesUp(caller) => self.give_up(caller),
            Event::ForeignEnds(life) => self.end_guard(life),
            Event::Timecode => self.send_timecode(),
            Event::Captain => self.lead(),
        }
    }

    fn after(&mut self, delay_ns: u64, event: Event) {
        self.agenda.add(self.now_ns + delay_ns, event);
    }

    fn message_ns(&self, purpose: u64) -> u64 {
        self.scenario.latency_ns(self.now_ns, purpose, MESSAGE_NS)
    }

    fn life(&mut self) -> u64 {
        self.next_life += 1;
        self.next_life
    }

    // The show and its processes.

    fn begin_show(&mut self) {
        self.supervisor = Supervisor::new(self.scenario, self.now_ns, self.epoch);
        self.promises.begin_show();
        (self.status, self.newest, self.is_over) = (None, None, false);
        self.counts.shows += 1;
        self.start(Part::Server);
        self.start(Part::Guard);
    }

    fn start(&mut self, part: Part) {
        let life = self.life();
        self.supervisor.note_start(part);
        ("start", part == Part::Server, life, self.now_ns).hash(&mut self.trace);
        match part {
            Part::Server => {
                let (start, _) = self.supervisor.start_of_server(self.scenario);
                // Numbers of runs are random in the program. Here they only differ.
                self.server = Some(Server::new(self.scenario, start, life, life, self.now_ns + START_NS));
                self.after(START_NS, Event::ServerJoins(life));
            }
            Part::Guard => {
                self.guards.push(GuardProcess::new(life, false));
                self.after(START_NS, Event::GuardJoins(life));
            }
        }
    }

    fn join_server(&mut self, life: u64) {
        let Some(server) = self.server.as_mut().filter(|server| server.life == life) else { return };
        let (run_id, start, due_ns) = (server.run_id, server.start, server.due_ns());
        self.counts.runs += 1;
        let told = self.status.as_ref().map(|status| (status.run_id, status.tick));
        self.promises.begin_run(run_id, start, told, self.now_ns);
        self.agenda.add(due_ns, Event::Tick(life));
        self.after(0, Event::Report(life));
    }

    fn tick(&mut self, life: u64) {
        let (now_ns, windows) = (self.now_ns, self.windows);
        let Some(server) = self.server.as_mut().filter(|server| server.life == life) else { return };
        let resumes_ns = server.stopped_until_ns.max(windows.clock_stands_until);
        if resumes_ns > now_ns {
            return self.agenda.add(resumes_ns, Event::Tick(life));
        }
        let ticked = server.tick();
        let header = FrameHeader { published_ns: now_ns, ..ticked.header };
        self.promises.take_tick(&ticked, now_ns);
        header.as_bytes().hash(&mut self.trace);
        self.counts.frames += 1;
        if let Some(last) = self.newest.filter(|last| last.run_id == header.run_id) {
            self.counts.walked_m += (header.head_travel_m - last.head_travel_m).max(0.0);
        }
        let arrives = windows.frames_lost_until <= now_ns;
        let is_seek = |decided: &Decided| matches!(decided.request, Request::Seek { .. }) && decided.outcome.is_ok();
        let is_sought = ticked.decided.iter().any(is_seek);
        for guard in self.guards.iter_mut().filter(|guard| guard.has_joined && arrives) {
            guard.deliver(&header, ticked.handles, is_sought);
            let wake_ns = self.scenario.latency_ns(now_ns, 10 + guard.life, MESSAGE_NS);
            self.agenda.add(now_ns + wake_ns, Event::Frames(guard.life));
        }
        let (decided, steering) = (ticked.decided, ticked.steering);
        (self.newest, self.has_news) = (Some(header), true);
        if steering.is_some_and(|steering| steering.leads) {
            self.supervisor.has_timecode_run = !steering.is_some_and(|steering| steering.stands);
        }
        let ended_ns =
            now_ns + self.scenario.latency_ns(now_ns, 3, MESSAGE_NS / 4) + std::mem::take(&mut server.busy_ns);
        // A clock that stands at the end of the tick shows its earlier reading.
        let reading_ns = if windows.clock_stands_until > ended_ns { windows.clock_stood_at } else { ended_ns };
        server.end_tick(reading_ns);
        let due_ns = server.due_ns();
        self.promises.require(Promise::PeriodsAreSkipped, now_ns, due_ns >= reading_ns, || {
            format!("the next tick is due at {due_ns} ns, and the clock reads {reading_ns} ns")
        });
        let due_ns = due_ns.max(ended_ns);
        self.reply(&decided, header.tick);
        let has_sought = decided.iter().any(|decided| decided.caller.is_none() && decided.outcome.is_ok());
        self.check_timecode(&header, steering, has_sought);
        if header.show_state() == Some(ShowState::Ended) {
            return self.end_server();
        }
        self.agenda.add(due_ns, Event::Tick(life));
    }

    fn reply(&mut self, decided: &[Decided], tick: u64) {
        for (place, &Decided { caller, request, outcome }) in decided.iter().enumerate() {
            self.counts.replies += 1;
            (request.to_wire().as_bytes(), outcome.is_ok()).hash(&mut self.trace);
            let Some(caller) = caller.filter(|_| self.windows.replies_lost_until <= self.now_ns) else { continue };
            let delay_ns = self.message_ns(20 + place as u64);
            self.after(delay_ns, Event::Replied(caller, Some(outcome.map(|()| tick))));
        }
    }

    /// The server has ended in order: it was told to, or has reached the end of its run.
    fn end_server(&mut self) {
        self.drop_server();
        self.is_over = true;
        // A show that ends by itself after the faults has walked, too.
        if self.captain != Captain::Waits {
            self.captain = Captain::Done;
        }
    }

    /// Removes the server's process. Clients that wait for a reply get an error.
    fn drop_server(&mut self) {
        let Some(server) = self.server.take() else { return };
        ("server ends", server.life).hash(&mut self.trace);
        for (caller, _) in server.requests {
            self.after(20 * MS_NS, Event::Replied(caller, None));
        }
    }

    fn report(&mut self, life: u64) {
        let now_ns = self.now_ns;
        let Some(server) = self.server.as_ref().filter(|server| server.life == life) else { return };
        if server.stopped_until_ns > now_ns {
            let at_ns = server.stopped_until_ns;
            return self.agenda.add(at_ns, Event::Report(life));
        }
        self.status = Some(Rc::new(server.status()));
        self.after(REPORT_NS, Event::Report(life));
        for number in 0..self.guards.len() {
            let life = self.guards[number].life;
            let wake_ns = self.scenario.latency_ns(now_ns, 30 + life, 20 * MS_NS);
            self.after(wake_ns, Event::Work(life));
        }
    }

    // The monitor and the guard.

    /// Whether this process may act now. A stopped one gets the event when it continues.
    fn guard_at(&mut self, life: u64, event: Event) -> Option<&mut GuardProcess<'a>> {
        let now_ns = self.now_ns;
        let guard = self.guards.iter_mut().find(|guard| guard.life == life)?;
        if guard.stopped_until_ns > now_ns {
            self.agenda.add(guard.stopped_until_ns, event);
            return None;
        }
        Some(guard)
    }

    fn join_guard(&mut self, life: u64) {
        // `guard.lock` allows one guard per instance.
        let is_taken = self.guards.iter().any(|guard| guard.has_joined && guard.life != life);
        let is_locked = is_taken && self.scenario.is_guarded();
        let has_server = self.server.is_some();
        let Some(guard) = self.guard_at(life, Event::GuardJoins(life)) else { return };
        if is_locked {
            return self.end_guard(life);
        }
        guard.has_joined = has_server;
        if !has_server {
            self.after(20 * MS_NS, Event::GuardJoins(life));
        }
    }

    fn read_frames(&mut self, life: u64) {
        let scenario = self.scenario;
        let Some(guard) = self.guard_at(life, Event::Frames(life)) else { return };
        let Findings { faults, alerts, read } = guard.read(scenario);
        alerts.len().hash(&mut self.trace);
        for read in &read {
            self.promises.take_read(read, self.now_ns);
        }
        let is_late = read.iter().any(|read| read.is_reported_late);
        self.promises.require(Promise::ContactIsReported, self.now_ns, !is_late, || {
            "a contact is reported where the boards overlap, and not where they touch".to_owned()
        });
        self.promises
            .require(Promise::NoFalseFault, self.now_ns, faults == 0, || "a frame is called faulty".to_owned());
        if self.scenario.is_guarded() {
            self.work(life);
        }
    }

    fn work(&mut self, life: u64) {
        let status = self.status.clone();
        let Some(guard) = self.guard_at(life, Event::Work(life)) else { return };
        let step = guard.work(status.as_deref());
        let rests = self.newest.filter(|header| {
            crate::guard::is_held(header)
                && self.guards.iter().any(|guard| guard.life == life && guard.is_final(header))
        });
        if let Some(header) = rests {
            self.promises.take_final_rest(&header, self.now_ns);
        }
        if let GuardStep::Ask(request, number) = step {
            let (until, longer_ns) = self.windows.proofs_slow;
            let longer_ns = if until > self.now_ns { longer_ns } else { 0 };
            let proof_ns = self.scenario.latency_ns(self.now_ns, 40, PROOF_NS) + longer_ns;
            self.after(proof_ns, Event::GuardSends(life, number, request));
        }
    }

    fn end_guard(&mut self, life: u64) {
        let Some(place) = self.guards.iter().position(|guard| guard.life == life) else { return };
        let guard = self.guards.remove(place);
        ("guard ends", life).hash(&mut self.trace);
        if !guard.is_foreign {
            self.plan_restart(Part::Guard);
        }
    }

    // Commands.

    /// A client sends a request. Without a server it has its answer at once.
    fn send(&mut self, caller: Caller, request: Request) {
        let now_ns = self.now_ns;
        if let Caller::Guard(life, number) = caller
            && self.guard_at(life, Event::GuardSends(life, number, request)).is_none()
        {
            return;
        }
        let patience_ns = match caller {
            Caller::Guard(..) => GUARD_PATIENCE_NS,
            Caller::Operator(_) => OPERATOR_PATIENCE_NS,
        };
        let Some(server) = &self.server else {
            return self.after(MS_NS, Event::Replied(caller, None));
        };
        let server_life = server.life;
        self.after(patience_ns, Event::GivesUp(caller));
        if self.windows.requests_lost_until > now_ns {
            return;
        }
        let (late_until, later_ns) = self.windows.requests_late;
        let later_ns = if late_until > now_ns { later_ns } else { 0 };
        let delay_ns = self.message_ns(50) + later_ns;
        self.after(delay_ns, Event::Arrives(caller, request, server_life));
    }

    fn arrive(&mut self, caller: Caller, request: Request, server_life: u64) {
        match self.server.as_mut().filter(|server| server.life == server_life) {
            Some(server) => server.requests.push_back((caller, request)),
            None => self.after(0, Event::Replied(caller, None)),
        }
    }

    fn take_reply(&mut self, caller: Caller, reply: Option<Result<u64, Refusal>>) {
        match caller {
            Caller::Guard(life, number) => {
                let Some(guard) = self.guard_at(life, Event::Replied(caller, reply)) else { return };
                // Without an answer the guard looks at the newest frame again.
                if guard.take_reply(number, reply) && reply.is_some_and(|reply| reply.is_ok()) {
                    self.work(life);
                }
            }
            Caller::Operator(number) => self.answer(number, reply),
        }
    }

    fn answer(&mut self, number: u64, reply: Option<Result<u64, Refusal>>) {
        let Some(place) = self.calls.iter().position(|call| call.number == number) else { return };
        let call = self.calls[place];
        self.has_sought |= call.is_captains && matches!((call.request, reply), (Request::Seek { .. }, Some(Ok(_))));
        let may_be_proved = reply == Some(Err(Refusal::NotProved)) && self.guards.iter().any(|guard| guard.has_joined);
        if may_be_proved && self.now_ns - call.begun_ns < OPERATOR_PATIENCE_NS {
            let retried = self.begin_call(call.request, call.is_captains, PROOF_PERIOD_NS);
            self.calls.swap_remove(place);
            if let Some(retried) = self.calls.iter_mut().find(|call| call.number == retried) {
                retried.begun_ns = call.begun_ns;
            }
            return;
        }
        self.calls.swap_remove(place);
    }

    fn give_up(&mut self, caller: Caller) {
        self.take_reply(caller, None);
    }

    fn begin_call(&mut self, request: Request, is_captains: bool, delay_ns: u64) -> u64 {
        let number = self.life();
        self.calls.push(Call { number, request, begun_ns: self.now_ns, is_captains });
        let server_life = self.server.as_ref().map(|server| server.life);
        match server_life.filter(|_| self.windows.requests_lost_until <= self.now_ns) {
            Some(life) => {
                let (late_until, later_ns) = self.windows.requests_late;
                let later_ns = if late_until > self.now_ns { later_ns } else { 0 };
                let delay_ns = delay_ns + later_ns + self.message_ns(60);
                self.after(delay_ns, Event::Arrives(Caller::Operator(number), request, life));
                self.after(delay_ns + OPERATOR_PATIENCE_NS, Event::GivesUp(Caller::Operator(number)));
            }
            None => self.after(delay_ns + MS_NS, Event::GivesUp(Caller::Operator(number))),
        }
        number
    }

    // Faults.

    fn fail(&mut self, kind: FaultKind) {
        self.steady_ns = self.now_ns;
        self.counts.faults += 1;
        let until = |duration_ns: u64| self.now_ns + duration_ns;
        match kind {
            FaultKind::Kill(part) => self.kill(part),
            FaultKind::Stop(Part::Server, ns) => {
                let until = until(ns);
                self.server.iter_mut().for_each(|server| server.stopped_until_ns = server.stopped_until_ns.max(until));
            }
            FaultKind::Stop(Part::Guard, ns) => {
                let until = until(ns);
                self.guards.iter_mut().for_each(|guard| guard.stopped_until_ns = guard.stopped_until_ns.max(until));
            }
            FaultKind::Overrun(ns) => self.server.iter_mut().for_each(|server| server.busy_ns = ns),
            FaultKind::ClockStands(ns) => {
                (self.windows.clock_stood_at, self.windows.clock_stands_until) = (self.now_ns, until(ns));
            }
            FaultKind::LoseRequests(ns) => self.windows.requests_lost_until = until(ns),
            FaultKind::DelayRequests(ns, later_ns) => self.windows.requests_late = (until(ns), later_ns),
            FaultKind::LoseReplies(ns) => self.windows.replies_lost_until = until(ns),
            FaultKind::LoseFrames(ns) => self.windows.frames_lost_until = until(ns),
            FaultKind::SlowProofs(ns, longer_ns) => self.windows.proofs_slow = (until(ns), longer_ns),
            FaultKind::SecondGuard(ns) => {
                let life = self.life();
                self.guards.push(GuardProcess::new(life, true));
                self.after(START_NS, Event::GuardJoins(life));
                self.after(START_NS + ns, Event::ForeignEnds(life));
            }
            FaultKind::Command(request) => drop(self.begin_call(request, false, 0)),
            FaultKind::Timecode(fault) => self.fail_timecode(fault),
        }
    }

    fn kill(&mut self, part: Part) {
        match part {
            Part::Server if self.server.is_some() => {
                self.drop_server();
                self.plan_restart(Part::Server);
            }
            Part::Server => {}
            Part::Guard => {
                let own = self.guards.iter().find(|guard| !guard.is_foreign).map(|guard| guard.life);
                if let Some(life) = own {
                    self.end_guard(life);
                }
            }
        }
    }

    fn plan_restart(&mut self, part: Part) {
        // A show that gives up after too many restarts is over.
        if !self.is_over && !self.supervisor.note_end(part, self.now_ns) {
            self.drop_server();
            self.is_over = true;
        }
    }

    fn fail_timecode(&mut self, fault: TimecodeFault) {
        let sender = &mut self.sender;
        match fault {
            TimecodeFault::Jump(seconds) => sender.position_s = (sender.position_s + seconds).max(0.0),
            TimecodeFault::Stand => sender.stands = !sender.stands,
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
    fn check_timecode(&mut self, header: &FrameHeader, steering: Option<Steering>, has_sought: bool) {
        let config = &self.scenario.config;
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
            !is_within || off_s.abs() < FARTHEST_S && !has_sought,
            || format!("the show is {off_s} s from its timecode: {header:?}"),
        );
    }

    fn send_timecode(&mut self) {
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

    fn hear_timecode(&mut self, position_s: f64) {
        let (Some(server), Ok(position)) = (&mut self.server, Position::of_seconds(position_s.rem_euclid(86_400.0)))
        else {
            return;
        };
        server.hear(position, self.now_ns);
    }

    // The supervisor and the captain.

    fn look(&mut self) {
        self.after(LOOK_NS, Event::Look);
        if self.is_over {
            return self.begin_next_show();
        }
        if let Some(header) = self.newest.filter(|_| self.has_news) {
            self.supervisor.seen.see_frame(&header);
        }
        if let Some(status) = &self.status {
            self.supervisor.seen.see_status(**status);
        }
        let now_ns = self.now_ns;
        let own = self.guards.iter().find(|guard| !guard.is_foreign);
        let stopped = |until_ns: u64| until_ns > now_ns;
        let server_stopped = self.server.as_ref().is_some_and(|server| stopped(server.stopped_until_ns));
        let guard_stopped = own.is_some_and(|guard| stopped(guard.stopped_until_ns));
        let children = [
            ChildState {
                part: Part::Server,
                runs: self.server.is_some(),
                is_stopped: server_stopped,
                is_heard: std::mem::take(&mut self.has_news),
            },
            ChildState {
                part: Part::Guard,
                runs: own.is_some(),
                is_stopped: guard_stopped,
                is_heard: own.is_some_and(|guard| guard.has_joined) && !guard_stopped,
            },
        ];
        for part in self.supervisor.look(now_ns, children) {
            let [server, guard] = children;
            let heard_ns = self.newest.map_or(0, |header| header.published_ns);
            let is_healthy = match part {
                Part::Server => !server.is_stopped && now_ns - heard_ns < 5 * SECOND_NS - LOOK_NS,
                Part::Guard => !guard.is_stopped && guard.is_heard,
            };
            self.hung_ns[usize::from(part == Part::Guard)] = now_ns;
            self.promises.require(Promise::HealthyChildLives, now_ns, !is_healthy, || format!("{part:?} is killed"));
            self.kill(part);
        }
        for part in [Part::Server, Part::Guard] {
            if !self.is_over && self.supervisor.is_due(part, now_ns) {
                self.start(part);
            }
        }
        for (place, child) in children.into_iter().enumerate() {
            if !child.runs || !child.is_stopped {
                self.hung_ns[place] = now_ns;
            }
            let hung_ns = now_ns - self.hung_ns[place];
            self.promises.require(Promise::HungChildEnds, now_ns, hung_ns <= 6 * SECOND_NS, || {
                format!("{:?} is stopped for {hung_ns} ns", child.part)
            });
        }
        let has_guard = self.guards.iter().any(|guard| !guard.is_foreign);
        for (place, runs) in [self.server.is_some(), has_guard].into_iter().enumerate() {
            if runs || self.is_over {
                self.lived_ns[place] = now_ns;
            }
            let missing_ns = now_ns - self.lived_ns[place];
            let returns = missing_ns <= LONGEST_BACKOFF_NS + SECOND_NS;
            self.promises.require(Promise::DeadChildReturns, now_ns, returns, || {
                format!("child {place} is missing for {missing_ns} ns")
            });
        }
    }

    /// After a show that has ended, another one begins, unless the faults are over.
    fn begin_next_show(&mut self) {
        let own: Vec<u64> = self.guards.iter().filter(|guard| !guard.is_foreign).map(|guard| guard.life).collect();
        self.guards.retain(|guard| !own.contains(&guard.life));
        self.begin_show();
    }

    /// The captain looks once a second at a show without faults: it must walk or be at an end, and then end by a stop.
    fn lead(&mut self) {
        let scenario = self.scenario;
        self.after(CAPTAIN_NS, Event::Captain);
        if self.captain == Captain::Waits {
            self.windows = Windows::default();
            self.sender = Sender { stands: false, pace: 1.0, silent_until: 0, ..self.sender };
            self.captain = Captain::Leads(self.now_ns + SETTLE_NS);
        }
        match self.captain {
            Captain::Leads(until_ns) => {
                let state = self.newest.and_then(|header| header.show_state());
                if self.has_arrived() {
                    let seeks = self.is_seek_due();
                    let until_ns = self.now_ns + SETTLE_NS;
                    self.captain = if seeks { Captain::Seeks(until_ns) } else { Captain::Stops(until_ns) };
                }
                self.promises.require(Promise::WalksOn, self.now_ns, self.now_ns < until_ns, || {
                    format!("the show stands as {state:?}")
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
                    self.begin_call(Request::Seek { show_time_s: scenario.seek_s() }, true, 0);
                }
            }
            Captain::Stops(until_ns) => {
                let newest = self.newest;
                self.promises.require(Promise::EndsWhenTold, self.now_ns, self.now_ns < until_ns, || {
                    format!("the show goes on: {newest:?}")
                });
                if self.calls.iter().all(|call| !call.is_captains) {
                    self.begin_call(Request::Stop, true, 0);
                }
            }
            Captain::Waits | Captain::Done => {}
        }
    }

    /// Whether the guard must prove the captain's seek: its target keeps the margin, and no timecode leads.
    fn is_seek_due(&mut self) -> bool {
        let travel_m = self.scenario.config.tables().head.speed_mps * self.scenario.seek_s();
        let is_within = self.scenario.flags.until_s.is_none_or(|until_s| self.scenario.seek_s() < until_s);
        !self.scenario.flags.timecode && is_within && self.promises.is_clear_at(travel_m)
    }

    /// Whether the show walks, or stands at an end that no command but a seek leaves.
    fn has_arrived(&self) -> bool {
        let (Some(header), Some(status), Some(server)) = (self.newest, &self.status, &self.server) else {
            return false;
        };
        let is_live = header.run_id == server.run_id && status.run_id == server.run_id;
        let is_final =
            status.guard_end_m == header.head_travel_m || self.guards.iter().any(|guard| guard.is_final(&header));
        is_live
            && match header.show_state() {
                Some(ShowState::Running) => header.head_speed_mps > 0.0 && header.tick > 5,
                Some(ShowState::Held) => is_final && !status.stops().has(Stop::Held),
                Some(ShowState::Finished) => true,
                Some(ShowState::Paused) => {
                    status.stops().has(Stop::Timecode)
                        && status.timecode != TimecodeState::Locked.to_wire()
                        && !status.stops().has(Stop::Paused)
                }
                _ => false,
            }
    }

    /// Sends the command that lets the show walk on.
    fn urge(&mut self) {
        if self.calls.iter().any(|call| call.is_captains) {
            return;
        }
        let Some(status) = &self.status else { return };
        let stops = status.stops();
        let request = if stops.has(Stop::Held) || stops.has(Stop::Ready) {
            Request::Release
        } else if stops.has(Stop::Paused) {
            Request::Resume
        } else {
            Request::Speed { speed_mps: self.scenario.config.tables().head.speed_mps }
        };
        self.begin_call(request, true, 0);
    }
}
