//! The world: one thread that carries a scenario out, event after event.

use std::collections::hash_map::DefaultHasher;
use std::hash::Hasher as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Instant;

use bench_dragon::command_queue::LaneKind;
use bench_dragon_ipc::{CommandReply, FrameHeader, Request, Status};

use crate::agenda::Agenda;
use crate::guard::GuardProcess;
use crate::promises::{Broken, Promise, Promises};
use crate::recorder::RecorderProcess;
use crate::scenario::{SECOND_NS, Scenario};
use crate::server::Server;
use crate::supervisor::Supervisor;

mod captain;
mod clients;
mod desks;
mod faults;
mod guard;
mod observer;
mod recorder;
mod server;
mod supervision;
mod timecode;

pub(crate) use clients::Caller;
pub(crate) use desks::DeskCall;

pub use captain::request_to_walk;

use captain::Captain;
use clients::Call;
use desks::{DESKS, Desk};
use faults::Windows;
use observer::{BRIDGE_NS, OBSERVE_NS, Watch};
use recorder::Recordings;
use supervision::LOOK_NS;
use timecode::{Sender, TIMECODE_NS};

const MS_NS: u64 = 1_000_000;
/// Time from a process's start until it has joined the bus.
const START_NS: u64 = 60 * MS_NS;
/// Longest time of a message on the bus, and of a process until it wakes.
const MESSAGE_NS: u64 = MS_NS;

#[derive(Clone, Debug)]
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
    Replied(Caller, Option<CommandReply>),
    GivesUp(Caller),
    ForeignEnds(u64),
    RecorderJoins(u64),
    RecorderReads(u64),
    /// The recorder's writing thread takes the next job, or closes its chunk.
    RecorderWrites(u64),
    RecorderSyncs(u64),
    /// The recording of a killed recorder is repaired.
    Repair(PathBuf),
    /// A lane of a desk wakes.
    Lane(usize, LaneKind),
    Timecode,
    Observe,
    Bridge,
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
    /// Frames in recordings that were read back.
    pub recorded: u64,
    /// Frames of recordings that equal those of the simulation, by `--verify`.
    pub verified: u64,
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
    lived_ns: [u64; 3],
    /// Instants at which they were last not stopped.
    hung_ns: [u64; 3],
    is_over: bool,
    windows: Windows,
    calls: Vec<Call>,
    desks: [Desk; DESKS],
    recorder: Option<RecorderProcess>,
    recordings: Recordings,
    watch: Watch,
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
        let sender = Sender { position_s: 10.0, pace: 1.0, stands: false, silent_until: 0, fastest_mps: 0.0, stood: 0 };
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
            recorded: 0,
            verified: 0,
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
            lived_ns: [0; 3],
            hung_ns: [0; 3],
            is_over: false,
            windows: Windows::default(),
            calls: Vec::new(),
            desks: Default::default(),
            recorder: None,
            recordings: Recordings::default(),
            watch: Watch::default(),
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
        self.agenda.add(OBSERVE_NS, Event::Observe);
        self.agenda.add(BRIDGE_NS, Event::Bridge);
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
            Event::ForeignEnds(life) => self.end_foreign_guard(life),
            Event::Timecode => self.send_timecode(),
            Event::Observe => self.observe(),
            Event::Bridge => self.send_by_bridge(),
            Event::RecorderJoins(life) => self.join_recorder(life),
            Event::RecorderReads(life) => self.read_for_recorder(life),
            Event::RecorderWrites(life) => self.write(life),
            Event::RecorderSyncs(life) => self.sync(life),
            Event::Repair(path) => self.repair(&path),
            Event::Lane(desk, lane) => self.wake_lane(desk, lane),
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
}
