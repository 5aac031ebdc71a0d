//! The server: advances the dragon at a fixed rate and publishes every frame.
//!
//! One tick, in order: wait for the release; advance the motion by the releases that were missed; take commands; advance the
//! motion by one period; write the handles straight into the loaned sample; send it; wake the readers; loan the next sample. A
//! server that follows timecode looks at the newest one before the last advance, and lets show time go on faster or slower.
//! The loop neither locks nor formats, and allocates nothing of its own; what it counts, a slower thread publishes.
//!
//! A command holds from the release at which the loop takes it: the show has gone on without it through those missed
//! before. So a show that misses releases is, at every other one, where it would have been without.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bench_dragon_ipc::service::{AlertService, EventService, Member, ReaderService, Role};
use bench_dragon_ipc::{BusError, Description, Domain, Refusal, Request, ShowState, SourceLock};

use crate::clock::{monotonic_ns, sleep_until, spin_until};
use crate::config::Config;
use crate::histogram::Percentiles;
use crate::source::{CommandServer, FramePublisher, SourceReport, TimesOfAll, random_run_id, service_manager};

pub mod motion;
pub mod schedule;

mod following;
mod real_time;
mod simulation;

pub use following::{Following, TimecodeNews};
pub use simulation::Simulation;

use motion::{Limits, MotionPlan};
use schedule::Schedule;

/// From here to the first release.
const LEAD: Duration = Duration::from_millis(1);
/// How long a server waits for the readers that it was told to expect.
const READER_PATIENCE: Duration = Duration::from_secs(10);

/// What a server is started with.
#[derive(Clone, Debug)]
pub struct ServerSettings {
    /// The dragon, its route and the rate.
    pub config: Config,
    /// Show time at tick 0, in seconds.
    pub start_s: f64,
    /// Travel at tick 0, where it is not the planned speed times the show time.
    pub start_travel_m: Option<f64>,
    /// Speed at tick 0, where it is not the planned one.
    pub start_speed_mps: Option<f64>,
    /// Show time at which the server ends.
    pub until_s: Option<f64>,
    /// Whether tick 0 is held.
    pub held: bool,
    /// Whether tick 0 is paused, or will be once the hold is lifted.
    pub paused: bool,
    /// Readers to wait for before tick 0, for ten seconds at most.
    pub readers: usize,
}

/// What a server did.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ServerSummary {
    /// Its run.
    pub run_id: u64,
    /// Frames published.
    pub frames: u64,
    /// Show time of the last one, in seconds.
    pub sim_time_s: f64,
    /// Releases skipped.
    pub overruns: u64,
    /// How far the show was behind the clock at the end, in seconds of wall time.
    pub behind_s: f64,
    /// The furthest that it was behind.
    pub most_behind_s: f64,
    /// From each release to the start of its tick, in microseconds.
    pub lateness_us: Percentiles,
    /// From the start of each tick until the loop was ready for the next one, in microseconds.
    pub tick_us: Percentiles,
}

/// A server that is ready to run.
#[derive(Debug)]
pub struct Server {
    simulation: Simulation,
    // Dropped in this order: ports before the node, everything before the lock.
    frames: FramePublisher,
    commands: CommandServer,
    // Alerts are the monitor's and reports the readers', but only a source creates services, and they last while somebody
    // holds them.
    _alerts: (AlertService, EventService),
    _readers: ReaderService,
    report: SourceReport,
    _member: Member,
    _lock: SourceLock,
    following: Option<Following>,
    /// Show seconds per wall-clock second at present.
    time_scale: f64,
    settings: ServerSettings,
    run_id: u64,
}

impl Server {
    /// Takes the instance, creates its services and publishes the description.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`] where another server runs on the instance; the others as [`Member::join`] and
    /// [`Member::frames`].
    pub fn create(domain: &Domain, settings: ServerSettings) -> Result<Self, BusError> {
        let lock = SourceLock::take(domain)?;
        for path in lock.cleared() {
            tracing::warn!("removed {}, which a killed server had left half made", path.display());
        }
        let bench_count = settings.config.dragon().dimensions().benches();
        let member = Member::join(domain, "serve", Role::Source { bench_count })?;
        let run_id = random_run_id();
        let description = Description { run_id, toml: settings.config.to_toml() };
        let report = SourceReport::start("serve", domain.clone(), description, bench_count, settings.config.rate_hz())?;
        let server = Self {
            simulation: Simulation::new(settings.config.dragon().clone(), plan(&settings, run_id)),
            commands: CommandServer::create(&member)?,
            _alerts: (member.alerts()?, member.alert_events()?),
            _readers: member.readers()?,
            // The last service: clients take it for the sign that all are there.
            frames: FramePublisher::create(domain, &member, bench_count)?,
            report,
            _member: member,
            _lock: lock,
            following: None,
            time_scale: settings.config.time_scale(),
            settings,
            run_id,
        };
        service_manager::ready();
        Ok(server)
    }

    /// The run's number.
    pub fn run_id(&self) -> u64 {
        self.run_id
    }

    /// Whether the head walks only where a guard has granted it.
    pub fn is_guarded(&self) -> bool {
        self.settings.config.is_guarded()
    }

    /// Has the show follow timecode: it stands until the first one.
    pub fn follow(&mut self, following: Following) {
        self.simulation.set_stands(true);
        self.following = Some(following);
    }

    /// Publishes frame after frame, on the calling thread, until `stop` is set, a client asks for it, or the show time to
    /// end at is reached.
    ///
    /// The thread takes on the processor and the priority of the configuration, as far as it may, and keeps them.
    ///
    /// # Errors
    /// [`BusError::Failed`] where a frame cannot be published.
    pub fn run(mut self, stop: &AtomicBool) -> Result<ServerSummary, BusError> {
        real_time::settle(&self.settings.config);
        let stopped_before = self.wait_for_readers(stop);
        let mut schedule = Schedule::new(monotonic_ns() + LEAD.as_nanos() as u64, self.settings.config.rate_hz());
        let (mut tick, mut missed) = (0, 0);
        if stopped_before {
            return Ok(self.finish(tick, &schedule));
        }
        let spin_ns = u64::from(self.settings.config.spin_us()) * 1000;
        while !stop.load(Ordering::Relaxed) {
            while !sleep_until(schedule.due_ns() - spin_ns) {
                if stop.load(Ordering::Relaxed) {
                    return Ok(self.finish(tick, &schedule));
                }
            }
            let begun_ns = spin_until(schedule.due_ns());
            let asked_to_stop = self.tick(tick, missed, &schedule)?;
            tick += 1;
            let ended_ns = monotonic_ns();
            let lateness_ns = begun_ns - schedule.due_ns();
            self.report.count(lateness_ns, ended_ns - begun_ns);
            if asked_to_stop || self.is_over() {
                break;
            }
            missed = schedule.advance(ended_ns);
        }
        Ok(self.finish(tick, &schedule))
    }

    /// One tick, after so many missed releases. Returns whether a client asked the server to stop.
    fn tick(&mut self, tick: u64, missed: u64, schedule: &Schedule) -> Result<bool, BusError> {
        self.simulation.miss(missed);
        if self.is_led() {
            // The follower makes up what the timecode is ahead by.
            self.simulation.forget_lag();
        }
        let asked_to_stop = self.take_commands(tick);
        let Self { simulation, frames, following, time_scale, settings, run_id, .. } = self;
        let config = &settings.config;
        if let Some(following) = following {
            *time_scale = following.steer(simulation, schedule.due_ns(), config.rate_hz());
        }
        simulation.advance();
        let bench_count = config.dragon().dimensions().benches() as u32;
        let head = simulation.head();
        let time_scale = *time_scale * simulation.catch_up().pace();
        let header = head.header(*run_id, tick, schedule.due_ns(), time_scale, bench_count);
        let fill = |handles: &mut [_]| {
            simulation.write(handles);
            header
        };
        frames.publish(fill, monotonic_ns)?;
        self.report.tell(&header, schedule.overruns());
        self.report.tell_behind(self.simulation.catch_up().behind_ns(self.settings.config.rate_hz()));
        let Limits { granted_to_m, asked_m } = self.simulation.limits();
        self.report.tell_limits(granted_to_m, asked_m);
        Ok(asked_to_stop)
    }

    /// Answers the commands that have come; they hold from this tick on. Returns whether a client asked the server to stop.
    fn take_commands(&mut self, tick: u64) -> bool {
        let is_led = self.is_led();
        let Self { simulation, commands, run_id, .. } = self;
        let mut asked_to_stop = false;
        commands.drain(*run_id, tick, |request| {
            asked_to_stop |= request == Request::Stop;
            match request {
                // It would be undone at once.
                Request::Seek { .. } if is_led => Err(Refusal::Followed),
                _ => simulation.request(request),
            }
        });
        asked_to_stop
    }

    /// Whether it is a timecode that says where the show is.
    fn is_led(&self) -> bool {
        self.following.as_ref().is_some_and(Following::leads)
    }

    /// Whether the show time to end at is reached. Without one the server goes on publishing the finished show.
    ///
    /// A timecode that jumps beyond it may jump back: only a walk there is the end.
    fn is_over(&self) -> bool {
        let is_put = self.following.is_some() && self.simulation.is_put();
        self.settings.until_s.is_some() && self.simulation.head().state == ShowState::Finished && !is_put
    }

    /// Waits for the readers that were told of, and answers commands meanwhile. Returns whether a client asked the server
    /// to stop.
    fn wait_for_readers(&mut self, stop: &AtomicBool) -> bool {
        const POLL_PERIOD: Duration = Duration::from_millis(1);
        let deadline = Instant::now() + READER_PATIENCE;
        while self.frames.reader_count() < self.settings.readers && !stop.load(Ordering::Relaxed) {
            if Instant::now() >= deadline {
                let (seen, expected) = (self.frames.reader_count(), self.settings.readers);
                tracing::warn!("starting with {seen} of {expected} readers");
                break;
            }
            if self.take_commands(0) {
                return true;
            }
            self.report.beat();
            std::thread::sleep(POLL_PERIOD);
        }
        false
    }

    fn finish(self, frames: u64, schedule: &Schedule) -> ServerSummary {
        service_manager::stopping();
        let sim_time_s = self.simulation.head().sim_time_ns as f64 * 1e-9;
        let (catch_up, rate_hz) = (*self.simulation.catch_up(), self.settings.config.rate_hz());
        let [behind_s, most_behind_s] =
            [catch_up.behind_ns(rate_hz), catch_up.most_behind_ns(rate_hz)].map(|behind_ns| behind_ns as f64 * 1e-9);
        let (run_id, overruns) = (self.run_id, schedule.overruns());
        let TimesOfAll { lateness_us, tick_us } = self.report.finish();
        ServerSummary { run_id, frames, sim_time_s, overruns, behind_s, most_behind_s, lateness_us, tick_us }
    }
}

fn plan(settings: &ServerSettings, run_id: u64) -> MotionPlan {
    let config = &settings.config;
    let speed_mps = config.head_speed_mps();
    MotionPlan {
        speed_mps,
        accel_mps2: config.head_accel_mps2(),
        tick_s: config.tick_s(),
        start_s: settings.start_s,
        start_travel_m: settings.start_travel_m.unwrap_or(speed_mps * settings.start_s),
        start_speed_mps: settings.start_speed_mps.unwrap_or(speed_mps),
        first_s: config.start_s(),
        last_s: config.end_s(),
        end_travel_m: config.dragon().end_travel_m(),
        until_s: settings.until_s,
        held: settings.held,
        paused: settings.paused,
        guarded_run: config.is_guarded().then_some(run_id),
        most_jumped: config.most_jumped(),
    }
}
