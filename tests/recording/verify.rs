//! Verification: a recording that equals its simulation is verified, and one changed bit is found anywhere.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use bench_dragon::config::Config;
use bench_dragon::recording::{Parts, Recorder, RecorderSettings};
use bench_dragon::source::replay::verify::{RunVerdict, RunVerification, Value, Verification, verify};
use bench_dragon::source::server::motion::HeadState;
use bench_dragon::source::server::schedule::Schedule;
use bench_dragon::source::server::{Simulation, TickInputs};
use bench_dragon_ipc::{
    Command, CommandEvent, CommandReply, EventKind, FrameHeader, HandleState, Refusal, Request, RunStart, Sender,
};
use tempfile::{TempDir, tempdir};

const RUN_ID: u64 = 7;
const RATE_HZ: u32 = 300;
const EPOCH_NS: u64 = 1_000_000_007;
const TOML: &str = "[dragon]\nbenches = 20\n[head]\naccel_mps2 = 0.5\n[serve]\nrate_hz = 300\n";

/// The requests of a tick, and their replies.
struct AskedRequests {
    due: Vec<Request>,
    replies: Vec<(Request, Result<(), Refusal>)>,
}

impl TickInputs for AskedRequests {
    fn requests(&mut self, _head: HeadState, decide: &mut dyn FnMut(Request) -> Result<f64, Refusal>) {
        self.replies.extend(self.due.drain(..).map(|request| (request, decide(request).map(|_course_mps| ()))));
    }
}

/// The frames and events of a recorded run. A test can change them.
#[derive(Clone)]
struct Tape {
    frames: Vec<(FrameHeader, Vec<HandleState>)>,
    events: Vec<CommandEvent>,
}

impl Tape {
    /// Simulates a run of this many ticks, with requests at ticks and missed periods before ticks, as a server does.
    fn of(ticks: u64, requests: &[(u64, Request)], missed: &[(u64, u64)]) -> Self {
        let config = Config::from_toml(TOML).expect("a valid text");
        let start = start();
        let mut simulation = Simulation::of_run(&config, &start, RUN_ID).expect("a sound start");
        let mut schedule = Schedule::new(EPOCH_NS, RATE_HZ);
        let mut tape = Self { frames: Vec::new(), events: Vec::new() };
        tape.record(start.event(7), 0);
        for tick in 0..ticks {
            let missed = missed.iter().find(|(at, _)| *at == tick).map_or(0, |(_, missed)| *missed);
            if tick > 0 {
                // Shortly after the last missed period, despite the rounding.
                let ended_ns = schedule.due_ns() + Schedule::from_epoch_ns(missed, RATE_HZ).expect("a short time") + 2;
                assert_eq!(schedule.advance(ended_ns), missed, "the schedule misses these periods");
            }
            let due = requests.iter().filter(|(at, _)| *at == tick).map(|(_, request)| *request).collect();
            let mut inputs = AskedRequests { due, replies: Vec::new() };
            simulation.tick(missed, &mut inputs);
            for (request, outcome) in inputs.replies {
                let reply = match outcome {
                    Ok(()) => CommandReply::accepted(RUN_ID, tick),
                    Err(refusal) => CommandReply::refused(RUN_ID, tick, refusal),
                };
                let command = Command { sender: Sender::Ctl.to_wire(), ..request.to_wire() };
                tape.record(CommandEvent::answered(&command, &reply), schedule.overruns());
            }
            let header = simulation.header(RUN_ID, tick, schedule.due_ns());
            let mut handles = vec![HandleState::default(); config.lead().dimensions().handles()];
            simulation.write(&mut handles);
            tape.frames.push((header, handles));
        }
        tape.record(CommandEvent::plain(EventKind::End, Sender::Server, ticks - 1), schedule.overruns());
        tape
    }

    fn record(&mut self, event: CommandEvent, overruns: u64) {
        let number = self.events.len() as u64;
        self.events.push(CommandEvent { run_id: RUN_ID, number, overruns, ..event });
    }

    /// Writes a recording with the events after the frames.
    fn write(&self, path: &Path) {
        let mut recorder = Recorder::start(RecorderSettings::new(path, 0)).expect("a recorder");
        recorder.describe(RUN_ID, TOML).expect("the configuration");
        for (header, handles) in &self.frames {
            recorder.frame(header, handles).expect("a frame");
        }
        for event in &self.events {
            recorder.record(event, EPOCH_NS).expect("an event");
        }
        recorder.finish().expect("a finished recording");
    }

    fn verify(&self) -> RunVerification {
        let folder = tempdir().expect("a folder");
        let path = folder.path().join("a.mcap");
        self.write(&path);
        let Verification { mut runs, flawed, is_interrupted, .. } = verified(&[path]);
        assert!(flawed.is_empty() && !is_interrupted);
        assert_eq!(runs.len(), 1);
        runs.remove(0)
    }
}

fn start() -> RunStart {
    RunStart {
        start_s: 0.0,
        travel_m: 0.0,
        speed_mps: 1.0,
        until_s: None,
        is_held: false,
        is_paused: false,
        is_guarded: false,
        follows_timecode: false,
        is_ready: false,
        is_restarted: false,
        stays: false,
    }
}

fn verified(files: &[PathBuf]) -> Verification {
    verify(&Parts::in_this_order(files), &AtomicBool::new(false), |_| ()).expect("a recording")
}

/// Returns a run with all commands of an operator, and with short and long standstills.
fn eventful() -> Tape {
    let requests = [
        (10, Request::Speed { speed_mps: 2.0 }),
        (200, Request::Pause),
        (400, Request::Resume),
        (450, Request::Seek { show_time_s: 60.0 }),
        (451, Request::Seek { show_time_s: 1e9 }),
        (600, Request::Hold),
        (600, Request::Resume),
        (900, Request::Release),
    ];
    Tape::of(1200, &requests, &[(5, 3), (100, 75), (101, 1), (300, 9), (700, 76), (701, 2), (950, 200), (960, 7)])
}

fn reason(run: &RunVerification) -> (u64, &str) {
    let RunVerdict::Unverifiable { from_tick, reason } = &run.verdict else { panic!("{run:?}") };
    (*from_tick, reason)
}

#[test]
fn a_run_with_commands_and_missed_periods_is_as_simulated() {
    let run = eventful().verify();
    assert_eq!(run.verdict, RunVerdict::Verified);
    assert_eq!((run.frames, run.verified, run.missing, run.overruns), (1200, 1200, 0, 373));
    assert_eq!((run.first_tick, run.last_tick, run.commands, run.grants, run.timecode), (0, 1199, 6, 0, 0));
}

/// A field of a frame, its handle, and its change.
type Change<'a> = (&'a str, Option<u64>, Box<dyn Fn(&mut FrameHeader, &mut [HandleState]) + 'a>);

#[test]
fn one_changed_bit_is_found_in_every_field_that_is_compared() {
    let whole = Tape::of(60, &[(20, Request::Speed { speed_mps: 2.0 })], &[(30, 2)]);
    let flip = |value: &mut f64| *value = f64::from_bits(value.to_bits() ^ 1);
    let changes: [Change<'_>; 10] = [
        ("position_m[0]", Some(17), Box::new(|_, handles| flip(&mut handles[17].position_m[0]))),
        ("position_m[1]", Some(0), Box::new(|_, handles| flip(&mut handles[0].position_m[1]))),
        ("position_m[2]", Some(20), Box::new(|_, handles| flip(&mut handles[20].position_m[2]))),
        ("velocity_mps[1]", Some(20), Box::new(|_, handles| flip(&mut handles[20].velocity_mps[1]))),
        ("head_travel_m", None, Box::new(|header, _| flip(&mut header.head_travel_m))),
        ("head_speed_mps", None, Box::new(|header, _| flip(&mut header.head_speed_mps))),
        ("time_scale", None, Box::new(|header, _| flip(&mut header.time_scale))),
        ("show_time_ns", None, Box::new(|header, _| header.show_time_ns ^= 1)),
        ("scheduled_ns", None, Box::new(|header, _| header.scheduled_ns ^= 1)),
        ("state", None, Box::new(|header, _| header.state ^= 1)),
    ];
    for (field, handle, change) in changes {
        let mut tape = whole.clone();
        let (header, handles) = &mut tape.frames[41];
        change(header, handles);
        let run = tape.verify();
        let RunVerdict::Differs { difference } = &run.verdict else { panic!("{field}: {run:?}") };
        assert_eq!((difference.tick, difference.field.as_str(), difference.handle), (41, field, handle));
        assert_ne!(difference.recorded, difference.simulated, "{field}");
        assert_eq!((run.frames, run.verified), (60, 41), "{field}");
    }
}

#[test]
fn a_changed_command_is_found_where_it_first_shows() {
    let whole = Tape::of(60, &[(20, Request::Speed { speed_mps: 0.5 }), (25, Request::Release)], &[(30, 2)]);
    let mut later = whole.clone();
    later.events[1].tick = 22;
    let RunVerdict::Differs { difference } = later.verify().verdict else {
        panic!("the speed changed two ticks earlier")
    };
    assert_eq!((difference.tick, difference.field.as_str()), (20, "head_travel_m"));

    let mut accepted = whole.clone();
    accepted.events[2].refusal = 0;
    let RunVerdict::Differs { difference } = accepted.verify().verdict else { panic!("there was no hold to release") };
    assert_eq!((difference.tick, difference.field.as_str()), (25, "command event 2"));
    assert_eq!(difference.recorded, Value::Text("accepted".to_owned()));

    let mut overruns = whole;
    overruns.events[3].overruns = 1;
    let RunVerdict::Differs { difference } = overruns.verify().verdict else { panic!("the frames have two overruns") };
    assert_eq!((difference.tick, difference.field.as_str()), (59, "overruns of command event 3"));
}

#[test]
fn the_last_moments_before_a_crash_are_unverifiable_and_not_different() {
    let requests = [(20, Request::Speed { speed_mps: 2.0 }), (1000, Request::Speed { speed_mps: 0.1 })];
    let whole = Tape::of(1500, &requests, &[]);
    let mut killed = whole.clone();
    killed.events.truncate(2);
    let run = killed.verify();
    let (from_tick, reason) = reason(&run);
    assert_eq!((from_tick, run.verified), (1000, 1000));
    assert!(reason.starts_with("the record of commands has no end, as after a crash"), "{reason}");

    let mut long_before = whole.clone();
    long_before.events.truncate(1);
    assert!(matches!(long_before.verify().verdict, RunVerdict::Differs { .. }), "4.9 s before the end");
    let mut behind_a_gap = long_before.clone();
    behind_a_gap.frames.retain(|(header, _)| !(10..21).contains(&header.tick));
    assert!(
        matches!(behind_a_gap.verify().verdict, RunVerdict::Unverifiable { from_tick: 22, .. }),
        "a lost file's end"
    );
    let mut begun_late = long_before;
    begun_late.frames.retain(|(header, _)| header.tick >= 10);
    assert!(matches!(begun_late.verify().verdict, RunVerdict::Differs { .. }), "the first events are all there");
    let mut ended = whole;
    ended.events.remove(2);
    ended.events[2].number = 2;
    assert!(matches!(ended.verify().verdict, RunVerdict::Differs { .. }), "the record of commands is whole");
}

#[test]
fn frames_that_the_recorder_lost_are_simulated_unless_periods_were_missed_meanwhile() {
    let whole = eventful();
    let mut tape = whole.clone();
    tape.frames.retain(|(header, _)| !(500..620).contains(&header.tick) && header.tick != 40);
    let run = tape.verify();
    assert_eq!((&run.verdict, run.frames, run.verified, run.missing), (&RunVerdict::Verified, 1079, 1079, 121));

    let mut tape = whole;
    tape.frames.retain(|(header, _)| !(690..710).contains(&header.tick));
    let run = tape.verify();
    let (from_tick, reason) = reason(&run);
    assert_eq!((from_tick, run.verified, run.frames), (690, 690, 1180));
    assert_eq!(reason, "20 frames are missing there, and the server missed 78 periods among them, at unknown ticks");
}

#[test]
fn a_recording_that_begins_late_is_verified_where_no_period_was_missed_before() {
    let requests = [(10, Request::Speed { speed_mps: 2.0 }), (150, Request::Pause)];
    let mut tape = Tape::of(200, &requests, &[(120, 5)]);
    tape.frames.retain(|(header, _)| header.tick >= 100);
    let run = tape.verify();
    assert_eq!((&run.verdict, run.first_tick, run.frames, run.missing), (&RunVerdict::Verified, 100, 100, 100));
    assert_eq!((run.commands, run.overruns), (2, 5));

    let mut tape = Tape::of(200, &requests, &[(50, 5)]);
    tape.frames.retain(|(header, _)| header.tick >= 100);
    let run = tape.verify();
    let (from_tick, reason) = reason(&run);
    assert_eq!((from_tick, run.verified), (100, 0));
    assert!(
        reason.starts_with("the recording begins at tick 100, and its first frame differs from a simulation"),
        "{reason}"
    );
}

#[test]
fn a_show_that_stands_where_its_recording_begins_may_hide_its_lag() {
    // The server misses 80 periods behind its first tick, and the show stands before it has made up any.
    let requests = [(1, Request::Pause), (20, Request::Resume), (40, Request::Speed { speed_mps: 2.0 })];
    let begun_late = |missed: &[(u64, u64)]| {
        let mut tape = Tape::of(60, &requests, missed);
        tape.frames.retain(|(header, _)| header.tick >= 10);
        tape
    };
    let lagging = begun_late(&[(1, 80)]);
    let run = lagging.verify();
    let (from_tick, reason) = reason(&run);
    assert_eq!((from_tick, run.first_tick, run.verified), (20, 10, 10));
    assert!(
        reason.starts_with("the recording begins at tick 10, and its show, which stood until then, differs from"),
        "{reason}"
    );
    let differs_at = |mut tape: Tape, change: &dyn Fn(&mut Tape)| {
        change(&mut tape);
        let verdict = tape.verify().verdict;
        let RunVerdict::Differs { difference } = verdict else { panic!("{verdict:?}") };
        (difference.tick, difference.field)
    };
    // Where no period was missed, or the show has walked, a difference is one.
    let punctual = begun_late(&[]);
    assert_eq!(punctual.verify().verdict, RunVerdict::Verified);
    let is_at = |tape: &mut Tape, tick: u64| tape.frames[tick as usize - 10].0.show_time_ns += 1;
    assert_eq!(differs_at(punctual.clone(), &|tape| is_at(tape, 20)), (20, "show_time_ns".to_owned()));
    assert_eq!(differs_at(punctual, &|tape| is_at(tape, 30)), (30, "show_time_ns".to_owned()));
    // A count of missed periods that changes without missed periods is one too.
    let counts = |tape: &mut Tape| tape.events[3].overruns += 1;
    let standing = Tape::of(60, &[(1, Request::Pause), (20, Request::Pause), (30, Request::Pause)], &[(1, 80)]);
    let late = |tape: &mut Tape| {
        tape.frames.retain(|(header, _)| header.tick >= 10);
        counts(tape);
    };
    assert_eq!(differs_at(standing, &late), (30, "overruns of command event 3".to_owned()));
}

#[test]
fn missing_events_end_the_verifiable_part() {
    let whole = Tape::of(60, &[(20, Request::Pause), (40, Request::Resume)], &[]);
    let mut tape = whole.clone();
    tape.events.remove(2);
    let run = tape.verify();
    assert_eq!(reason(&run), (20, "1 events of its commands are missing there"));
    assert_eq!(run.verified, 20);

    let mut tape = whole.clone();
    tape.events.remove(0);
    let run = tape.verify();
    assert_eq!(reason(&run), (0, "the first 1 events of its commands are missing: the recording began too late"));

    let mut tape = whole;
    tape.events.clear();
    let run = tape.verify();
    assert!(reason(&run).1.starts_with("it has no record of commands"), "{run:?}");
}

#[test]
fn impossible_values_in_a_recording_are_unverifiable() {
    let whole = Tape::of(5, &[], &[]);
    let starts = [
        RunStart { travel_m: f64::NAN, ..start() },
        RunStart { travel_m: 1e300, ..start() },
        RunStart { start_s: f64::INFINITY, ..start() },
        RunStart { speed_mps: -1.0, ..start() },
    ];
    for start in starts {
        let mut tape = whole.clone();
        tape.events[0] = CommandEvent { run_id: RUN_ID, ..start.event(7) };
        assert_eq!(reason(&tape.verify()), (0, "its start is out of range for its dragon"));
    }
    let mut tape = whole.clone();
    tape.frames[4].0.tick = u64::MAX;
    assert!(matches!(tape.verify().verdict, RunVerdict::Differs { .. }), "the tick is impossible");
    let mut tape = whole.clone();
    tape.frames[4].0.tick = 200_000_000;
    tape.frames[4].0.scheduled_ns = EPOCH_NS + 200_000_000 * 1_000_000_000 / u64::from(RATE_HZ);
    assert!(reason(&tape.verify()).1.ends_with("more than the 86400000 in a row that can be simulated"));
    let mut tape = whole;
    tape.frames.swap(2, 3);
    assert_eq!(reason(&tape.verify()).0, 2);
}

#[test]
fn the_files_of_a_rotated_recording_are_verified_as_one() {
    let folder: TempDir = tempdir().expect("a folder");
    let whole = eventful();
    let parts = [0..400, 400..800, 800..1200].map(|ticks: std::ops::Range<u64>| {
        let path = folder.path().join(format!("{}.mcap", ticks.start));
        let frames = whole.frames.iter().filter(|(header, _)| ticks.contains(&header.tick)).cloned().collect();
        let events = whole.events.iter().filter(|event| ticks.contains(&event.tick)).copied().collect();
        Tape { frames, events }.write(&path);
        path
    });
    let Verification { runs, .. } = verified(&parts);
    assert_eq!((&runs[0].verdict, runs[0].frames), (&RunVerdict::Verified, 1200));
    let Verification { runs, .. } = verified(&parts[1..]);
    assert!(reason(&runs[0]).1.contains("events of its commands are missing"), "{runs:?}");
    let [first, second, third] = parts;
    let Verification { runs, .. } = verified(&[first, third, second]);
    let (from_tick, reason) = reason(&runs[0]);
    assert!(from_tick == 400 && reason.contains("frames are missing there"), "{runs:?}");
}
