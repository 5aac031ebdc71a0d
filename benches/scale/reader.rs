//! A reader in a separate process: this program, started with other arguments.

use std::hint::black_box;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon::source::server::ServerSummary;
use bench_dragon_geometry::dragon::ChainSolver;
use bench_dragon_ipc::service::{self, Member};
use bench_dragon_ipc::{BusError, Domain, Frame, FrameHeader, FrameSubscriber, HandleState, Instance, ShowState};
use serde::{Deserialize, Serialize};
use test_support::dragons::paper_dragon_of;

use crate::HABITS;
use crate::server::Setting;

/// The first argument of a reader.
const ROLE: &str = "read-frames";
/// Period of a polling reader.
const POLL_PERIOD: Duration = Duration::from_millis(1);
/// Longest wait of a woken reader for one frame.
const WAIT: Duration = Duration::from_secs(1);
/// Busy loop of a reader by the clock, before and after each due instant.
const SPIN: Duration = Duration::from_micros(100);
/// A reader panics after this time without a frame.
const FRAME_TIMEOUT: Duration = Duration::from_secs(30);
/// Frames that a proving reader keeps, and the number of ticks between them.
const SAMPLES: usize = 12;
const SAMPLE_TICKS: u64 = 97;
/// Largest allowed distance of a position from the reference solver's. It is the documented bound for the paper's dragon. For
/// longer dragons, along which small errors of the links accumulate, it is a micrometre. The bench reports the actual errors.
const TOLERANCE_M: f64 = 1e-9;
const LONG_TOLERANCE_M: f64 = 1e-6;
/// Largest allowed difference of a velocity from the reference solver's.
const TOLERANCE_MPS: f64 = 1e-8;

/// How a reader detects new frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Habit {
    /// Checks for frames once a millisecond.
    Polling,
    /// Sleeps on the wake word.
    Woken,
    /// Sleeps on iceoryx2's event, as stock clients do.
    Event,
    /// Sleeps by the clock until shortly before a frame is due, then polls.
    Clock,
}

impl Habit {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Polling => "polling",
            Self::Woken => "woken",
            Self::Event => "event",
            Self::Clock => "clock",
        }
    }
}

/// Arguments of a process that is a reader.
#[derive(Debug)]
pub(crate) struct Role {
    instance: Instance,
    habit: Habit,
    benches: usize,
    proving: bool,
}

/// Result of a reader, which it prints at its end.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Account {
    frames: u64,
    /// Frames that the reader lost.
    pub(crate) lost: u64,
    first_tick: u64,
    last_tick: u64,
    samples: usize,
    /// Largest distance of a handle from the reference solver's position.
    pub(crate) largest_error_m: f64,
}

/// A reader's process.
#[derive(Debug)]
pub(crate) struct Reader {
    child: Child,
    stdout: BufReader<ChildStdout>,
    proving: bool,
}

impl Reader {
    /// Starts a reader of a server that has been created.
    pub(crate) fn start(domain: &Domain, setting: &Setting, proving: bool) -> Self {
        let mut child = Command::new(std::env::current_exe().expect("the path of this program is known"))
            .args([ROLE, domain.instance().as_str(), setting.habit.name()])
            .args([setting.benches.to_string(), proving.to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("this program can be started again");
        let stdout = BufReader::new(child.stdout.take().expect("stdout is piped"));
        Self { child, stdout, proving }
    }

    /// Waits until the reader is connected.
    pub(crate) fn wait_until_open(&mut self) {
        assert_eq!(self.line(), "open");
    }

    /// Waits for the reader's end and returns its result. Panics unless each frame was either read or counted as lost.
    pub(crate) fn end(mut self, summary: &ServerSummary) -> Account {
        let line = self.line();
        let account: Account = serde_json::from_str(&line)
            .unwrap_or_else(|_| panic!("a reader printed {line:?}, must be its result as JSON"));
        assert!(self.child.wait().expect("a child can be waited for").success(), "{account:?}");
        assert_eq!((account.first_tick, account.last_tick), (0, summary.frames - 1), "{account:?}");
        assert_eq!(account.frames + account.lost, summary.frames, "{account:?}");
        assert!(!self.proving || account.samples > 1, "frames are compared with the reference solver: {account:?}");
        account
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.stdout.read_line(&mut line).expect("a reader prints text");
        line.trim_end().to_owned()
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        // No effect on a process that has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Role {
    /// Parses the arguments of a reader; `None` if this process is the bench itself.
    pub(crate) fn of_arguments() -> Option<Self> {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let [role, instance, habit, benches, proving] = arguments.as_slice() else { return None };
        (role == ROLE).then(|| Self {
            instance: Instance::new(instance).expect("the bench's instance"),
            habit: HABITS.into_iter().find(|known| known.name() == habit).expect("a known habit"),
            benches: benches.parse().expect("a number of benches"),
            proving: proving == "true",
        })
    }

    /// Reads until the show ends, then prints the result.
    pub(crate) fn play(self) {
        let domain = Domain::new(self.instance.clone()).expect("the bench's domain");
        let mut frames = FrameSubscriber::open(&domain, "scale").expect("the server has been created");
        // The listener must exist before tick 0.
        let events = (self.habit == Habit::Event).then(|| {
            let member =
                Member::join(&domain, "scale-events", service::Role::Client).expect("the server has been created");
            let events = member.frame_events().expect("the server has created its services");
            (events.listener_builder().create().expect("there is room for every reader"), events, member)
        });
        say("open");
        let mut log = Log { benches: self.benches, proving: self.proving, ..Log::default() };
        let mut read = || match (&events, self.habit) {
            (Some((listener, ..)), _) => {
                listener.timed_wait(|_| (), WAIT).expect("the listener is open");
                frames.receive()
            }
            (None, Habit::Woken) => frames.wait(WAIT),
            (None, Habit::Clock) => frames.wait_until_due(WAIT, SPIN),
            (None, _) => frames.receive(),
        };
        self.read_all(&mut read, &mut log);
        log.account.lost = frames.lost();
        drop((frames, events));
        log.check_samples();
        say(&serde_json::to_string(&log.account).expect("numbers are valid JSON"));
    }

    fn read_all(&self, read: &mut impl FnMut() -> Result<Option<Frame>, BusError>, log: &mut Log) {
        let mut heard = Instant::now();
        while !log.is_over {
            match read().expect("the bus is readable") {
                Some(frame) => {
                    log.take(&frame);
                    heard = Instant::now();
                }
                None if heard.elapsed() > FRAME_TIMEOUT => panic!("no frame for {FRAME_TIMEOUT:?}"),
                None if self.habit == Habit::Polling => thread::sleep(POLL_PERIOD),
                None => {}
            }
        }
    }
}

/// Data that a reader collects from its frames.
#[derive(Debug, Default)]
struct Log {
    benches: usize,
    proving: bool,
    account: Account,
    samples: Vec<(FrameHeader, Vec<HandleState>)>,
    is_over: bool,
}

impl Log {
    /// Reads every handle of a frame. Panics if the frame has the wrong size or is not newer than the last frame.
    fn take(&mut self, frame: &Frame) {
        let (header, handles) = (frame.header(), frame.handles());
        assert_eq!(handles.len(), self.benches + 1, "a frame has one more handle than benches");
        black_box(handles.iter().map(|handle| handle.position_m[0] + handle.velocity_mps[0]).sum::<f64>());
        if self.account.frames == 0 {
            self.account.first_tick = header.tick;
        } else {
            assert!(header.tick > self.account.last_tick, "tick {} after {}", header.tick, self.account.last_tick);
        }
        self.account.frames += 1;
        self.account.last_tick = header.tick;
        self.is_over = header.show_state() == Some(ShowState::Ended);
        let is_sample = header.tick % SAMPLE_TICKS == 0 && self.samples.len() < SAMPLES || self.is_over;
        if self.proving && is_sample {
            self.samples.push((*header, handles.to_vec()));
        }
    }

    /// Panics unless the kept frames match the reference solver's results for their travels.
    fn check_samples(&mut self) {
        if !self.proving {
            return;
        }
        let dragon = paper_dragon_of(self.benches);
        let mut solver = ChainSolver::new(&dragon);
        let mut largest = [0.0; 2];
        for (header, handles) in &self.samples {
            let chain = solver.solve(&dragon, header.head_travel_m).expect("the travel is within the run");
            for (state, handle) in handles.iter().zip(chain) {
                let velocity = handle.tangent * (handle.speed_ratio * header.head_speed_mps);
                let off = [
                    distance(state.position_m, handle.position.to_array()),
                    distance(state.velocity_mps, velocity.to_array()),
                ];
                largest = [0, 1].map(|k| off[k].max(largest[k]));
            }
        }
        let tolerance_m = if self.benches == 223 { TOLERANCE_M } else { LONG_TOLERANCE_M };
        let [error_m, error_mps] = largest;
        assert!(
            error_m <= tolerance_m && error_mps <= TOLERANCE_MPS,
            "errors are {error_m:e} m and {error_mps:e} m/s, must be at most {tolerance_m:e} and {TOLERANCE_MPS:e}"
        );
        self.account.samples = self.samples.len();
        self.account.largest_error_m = error_m;
    }
}

fn distance([x, y, _]: [f64; 3], [other_x, other_y]: [f64; 2]) -> f64 {
    (x - other_x).hypot(y - other_y)
}

fn say(line: &str) {
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{line}").and_then(|()| stdout.flush()).expect("the bench reads the lines of its readers");
}
