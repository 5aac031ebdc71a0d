//! The server: advances the dragon at a fixed rate and publishes every frame.
//!
//! Steps of one tick:
//!
//! 1. Sleep until the tick is due.
//! 2. Advance the simulation ([`Simulation::tick`]) by the missed periods, the waiting commands, the newest timecode, and one
//!    period.
//! 3. Write the handles directly into the loaned sample, send it, and wake the readers.
//! 4. Loan the next sample.
//!
//! The loop neither locks nor formats, and allocates nothing itself. A slower thread publishes its counters.
//!
//! A command takes effect in the period in which the loop takes it. Before that, the show advances by the missed
//! periods without the command. So a show that misses periods has, in every other period, the position that it would
//! have had without the misses.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bench_dragon_ipc::source::SourceLock;
use bench_dragon_ipc::{BusError, CommandEvent, Domain, EventKind, RunStart, Sender, ShowState, SourceKind, Stop};

use crate::config::Config;
use crate::output::histogram::Percentiles;
use crate::source::{ExpectedReaders, Moment, SourcePorts, TimesOfAll, service_manager, take_instance};
use crate::system::clock::{monotonic_ns, sleep_until, spin_until};

pub mod motion;
pub mod schedule;

mod cue_track;
mod following;
mod live_inputs;
mod real_time;
mod simulation;

pub use following::{TimecodeFollowing, TimecodeNews};
pub use simulation::{ReachedCue, Simulation, Steering, TickInputs};

use live_inputs::LiveInputs;
use schedule::Schedule;

/// Time from the start of the schedule to the first due instant.
const LEAD: Duration = Duration::from_millis(1);

/// Settings of a server.
#[derive(Clone, Debug)]
pub struct ServerSettings {
    /// The dragon, its route and the rate.
    pub config: Config,
    /// How the run begins. The server sets `follows_timecode` itself, after [`Server::follow`].
    pub start: RunStart,
    /// The readers to wait for before tick 0.
    pub readers: ExpectedReaders,
}

/// Results of a run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ServerSummary {
    /// Number of the run.
    pub run_id: u64,
    /// Frames published.
    pub frames: u64,
    /// Show time of the last frame, in seconds.
    #[serde(rename = "sim_time_s")]
    pub show_time_s: f64,
    /// Periods missed.
    pub overruns: u64,
    /// Lag of the show behind the clock at the end, in seconds of wall time.
    pub behind_s: f64,
    /// Greatest lag of the run, in seconds of wall time.
    pub most_behind_s: f64,
    /// From each due instant to the start of its tick, in microseconds.
    pub lateness_us: Percentiles,
    /// From the start of each tick until the loop was ready for the next one, in microseconds.
    pub tick_us: Percentiles,
    /// The sender of the stop that ended the run; null if the run reached its end.
    pub stopped_by: Option<StoppedBy>,
}

/// The sender of a stop.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct StoppedBy {
    /// Kind of the sender, in lower case.
    pub sender: String,
    /// Process id of the sender; null if it is unknown.
    pub pid: Option<u32>,
}

/// A server that is ready to run.
#[derive(Debug)]
pub struct Server {
    simulation: Simulation,
    // Dropped in this order: the ports before the lock.
    ports: SourcePorts,
    _lock: SourceLock,
    following: Option<TimecodeFollowing>,
    is_ending: bool,
    settings: ServerSettings,
}

impl Server {
    /// Takes the instance, creates its services and publishes the description.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`] where another source runs on the instance; otherwise the reason why it cannot create
    /// its services.
    pub fn create(domain: &Domain, settings: ServerSettings) -> Result<Self, BusError> {
        let lock = take_instance(domain)?;
        let handle_count = settings.config.formation().layout().handles();
        let (toml, rate_hz) = (settings.config.to_toml(), settings.config.tables().serve.rate_hz);
        let ports = SourcePorts::open(domain, SourceKind::Server, &toml, handle_count, rate_hz)?;
        let simulation = Simulation::of_run(&settings.config, &settings.start, ports.run_id)
            .expect("the caller has checked the start of the run");
        let server = Self { simulation, ports, _lock: lock, following: None, is_ending: false, settings };
        service_manager::ready();
        Ok(server)
    }

    /// The run's number.
    pub fn run_id(&self) -> u64 {
        self.ports.run_id
    }

    /// Whether the head walks only on travel that a guard has granted.
    pub fn is_guarded(&self) -> bool {
        self.settings.config.tables().monitor.guard
    }

    /// Makes the show follow timecode. The show stands until the first timecode.
    pub fn follow(&mut self, following: TimecodeFollowing) {
        self.simulation.follow();
        self.following = Some(following);
    }

    /// Publishes frames on the calling thread until the run has ended. The last frame's state is [`ShowState::Ended`].
    ///
    /// The run ends at its end time, or when the head rests after `stop` was set or a client sent a stop.
    ///
    /// The thread takes the configured processor and priority, as far as the kernel allows, and keeps both.
    ///
    /// # Errors
    /// [`BusError::Failed`] where a frame cannot be published.
    pub fn run(mut self, stop: &AtomicBool) -> Result<ServerSummary, BusError> {
        real_time::settle(&self.settings.config);
        let start = RunStart { follows_timecode: self.following.is_some(), ..self.settings.start };
        self.record(start.event(std::process::id()), 0);
        self.wait_for_readers(stop);
        let mut schedule =
            Schedule::new(monotonic_ns() + LEAD.as_nanos() as u64, self.settings.config.tables().serve.rate_hz);
        let (mut tick, mut missed) = (0, 0);
        let spin_ns = u64::from(self.settings.config.tables().serve.spin_us) * 1000;
        loop {
            // A signal ends the sleep early. The loop reads `stop` when the tick is due.
            while !sleep_until(schedule.due_ns() - spin_ns) {}
            let begun_ns = spin_until(schedule.due_ns());
            let state = self.tick(tick, missed, &schedule, stop.load(Ordering::Relaxed))?;
            let ended_ns = monotonic_ns();
            self.ports.report.count(begun_ns - schedule.due_ns(), ended_ns - begun_ns);
            if state == ShowState::Ended {
                self.record(CommandEvent::plain(EventKind::End, Sender::Server, tick), schedule.overruns());
                return Ok(self.finish(tick + 1, &schedule));
            }
            tick += 1;
            missed = schedule.advance(ended_ns);
        }
    }

    /// Runs one tick, after `missed` missed periods. Returns the state in its frame.
    fn tick(&mut self, tick: u64, missed: u64, schedule: &Schedule, has_signal: bool) -> Result<ShowState, BusError> {
        let Self { simulation, ports, following, is_ending, .. } = self;
        let is_signalled = has_signal && !std::mem::replace(is_ending, true);
        simulation.tick(missed, &mut LiveInputs { ports, following: following.as_mut(), tick, schedule, is_signalled });
        let header = simulation.header(ports.run_id, tick, schedule.due_ns());
        ports.publish(|handles| {
            simulation.write(handles);
            header
        })?;
        let (report, motion) = (&ports.report, simulation.motion());
        report.report_frame(&header, schedule.overruns());
        report.report_behind(simulation.behind_ns()[0]);
        report.report_limits(motion.limits());
        report.report_stops(motion.stops());
        Ok(motion.head().state)
    }

    fn record(&mut self, event: CommandEvent, overruns: u64) {
        let moment = self.moment(overruns);
        self.ports.report.commands.record(event, moment);
    }

    fn moment(&self, overruns: u64) -> Moment {
        Moment { show_time_ns: self.simulation.motion().head().show_time_ns, overruns }
    }

    /// Waits for the readers of its settings, unless it is stopped.
    fn wait_for_readers(&mut self, stop: &AtomicBool) {
        const POLL_PERIOD: Duration = Duration::from_millis(1);
        let begun = Instant::now();
        let is_to_end =
            |server: &Self| server.simulation.motion().stops().has(Stop::Ending) || stop.load(Ordering::Relaxed);
        while !is_to_end(self) && self.ports.awaits_readers(self.settings.readers, begun) {
            let moment = self.moment(0);
            self.ports.take_commands(0, moment, |request| self.simulation.answer(request));
            self.ports.report.beat();
            std::thread::sleep(POLL_PERIOD);
        }
    }

    fn finish(self, frames: u64, schedule: &Schedule) -> ServerSummary {
        service_manager::stopping();
        let show_time_s = self.simulation.motion().head().show_time_ns as f64 / 1e9;
        let [behind_s, most_behind_s] = self.simulation.behind_ns().map(|behind_ns| behind_ns as f64 * 1e-9);
        let (run_id, overruns) = (self.run_id(), schedule.overruns());
        let stopped_by = self.ports.report.commands.stop().map(StoppedBy::from);
        let TimesOfAll { lateness_us, tick_us } = self.ports.finish();
        ServerSummary {
            run_id,
            frames,
            show_time_s,
            overruns,
            behind_s,
            most_behind_s,
            lateness_us,
            tick_us,
            stopped_by,
        }
    }
}

impl StoppedBy {
    /// Whether a signal to the server's process has stopped it, and no command.
    pub fn is_signal(&self) -> bool {
        self.sender == Sender::Signal.name()
    }
}

impl From<&CommandEvent> for StoppedBy {
    fn from(stop: &CommandEvent) -> Self {
        let sender = stop.sent_by().map_or_else(|| format!("sender {}", stop.sender), |sender| sender.to_string());
        Self { sender, pid: (stop.pid != 0).then_some(stop.pid) }
    }
}

impl ServerSettings {
    /// Settings of a run that begins at a show time, with the planned speed and travel, and does not wait for readers.
    pub fn planned(config: Config, start_s: f64) -> Self {
        let start = Self::planned_start(&config, start_s);
        Self { config, start, readers: ExpectedReaders::NONE }
    }

    /// The start of a run at a show time, with the planned speed and travel.
    pub fn planned_start(config: &Config, start_s: f64) -> RunStart {
        let speed_mps = config.tables().head.speed_mps;
        RunStart {
            start_s,
            travel_m: config.course_m(start_s),
            speed_mps,
            until_s: None,
            is_held: false,
            is_paused: false,
            is_guarded: config.tables().monitor.guard,
            follows_timecode: false,
            is_ready: false,
            is_restarted: false,
            stays: false,
        }
    }
}
