//! Timecode from a source that implements the protocols independently: `tests/python/timecode.py`.

use std::io::Write as _;
use std::net::UdpSocket;
use std::process::ChildStdin;

use bench_dragon_ipc::{FrameHeader, ShowState};
use serde_json::{Value, json};
use test_support::children::{await_child, kill};
use test_support::process::Process;
use test_support::pytest::python;

use crate::periods::periods;
use crate::reader::{Reader, Shot};
use crate::server::Server;
use crate::stage::Stage;

/// Seconds of a frame of timecode.
const FRAME_S: f64 = 0.04;
const RATE_HZ: f64 = 50.0;

/// A source of timecode, which ends with the test.
pub(crate) struct Desk {
    process: Process,
    orders: ChildStdin,
}

/// A position of the source's clock, and its instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock {
    position_s: f64,
    epoch_ns: u64,
}

impl Desk {
    pub(crate) fn start(args: &[&str]) -> Self {
        let mut command = python();
        command.arg("tests/python/timecode.py").args(args);
        let (process, orders) = Process::start_with_stdin(command);
        Self { process, orders }
    }

    /// Sends an order, and waits until it is executed.
    pub(crate) fn order(&mut self, order: &str) -> Clock {
        writeln!(self.orders, "{order}").expect("the source reads its orders");
        let answer = self.process.json();
        Clock {
            position_s: answer["position_s"].as_f64().expect("a number"),
            epoch_ns: answer["epoch_ns"].as_u64().expect("an instant"),
        }
    }
}

impl Clock {
    /// Whether a frame's show time equals the clock's position when the frame was due, to within a timecode frame.
    fn agrees(self, header: &FrameHeader, offset_s: f64) -> bool {
        let elapsed_s = header.scheduled_ns.saturating_sub(self.epoch_ns) as f64 * 1e-9;
        (header.show_time_s() - self.position_s - elapsed_s - offset_s).abs() < FRAME_S
    }
}

/// Starts a server that follows timecode. Returns it with its address.
pub(crate) fn serve(stage: &Stage, source: &str, args: &[&str]) -> (Server, String) {
    let mut server = stage.serve(&[&["--rate", "50", "--timecode", source], args].concat());
    let listen = listens(&mut server.process);
    (server, listen)
}

/// Returns the address at which a server or a show listens for timecode.
fn listens(process: &mut Process) -> String {
    let listening = process.json();
    assert_eq!(listening["type"], "listening", "{listening}");
    listening["listen"].as_str().expect("an address").to_owned()
}

/// Returns the next line with this event.
pub(crate) fn event(process: &mut Process, event: &str) -> Value {
    let is_wanted = |line: &Value| line["type"] == "timecode" && line["event"] == event;
    process.json_until(&format!("timecode event {event:?}"), is_wanted).pop().expect("the wanted line comes last")
}

/// Reads until 50 frames agree with the clock. After the show has settled, most frames agree.
pub(crate) fn read_following(reader: &mut Reader, clock: Clock, offset_s: f64) -> Vec<Shot> {
    const WANTED: usize = 50;
    let (mut shots, mut agreed) = (Vec::new(), 0);
    while agreed < WANTED {
        let shot = reader.next();
        agreed += usize::from(clock.agrees(&shot.header, offset_s));
        shots.push(shot);
        assert!(shots.len() < 80 * WANTED, "{agreed} of {} frames agree with the timecode", shots.len());
    }
    shots
}

/// Checks that successive running frames differ by the time scale ÷ the rate, and counts the frames that jumped.
fn count_seeks(shots: &[Shot]) -> usize {
    let runs = |shot: &Shot| shot.state() == ShowState::Running;
    let neighbours = shots.windows(2).filter(|pair| pair[1].header.tick == pair[0].header.tick + 1 && runs(&pair[1]));
    let is_seek = |pair: &&[Shot]| {
        let step_ns = pair[1].header.show_time_ns - pair[0].header.show_time_ns;
        let time_scale = pair[1].header.time_scale;
        assert!((0.9..=1.1).contains(&time_scale), "{time_scale}");
        // During missed periods, the show advanced at the previous time scale.
        let jumped = (periods(&pair[0].header, &pair[1].header, RATE_HZ as u64) - 1) as f64;
        let expected_ns = (jumped * pair[0].header.time_scale + time_scale) / RATE_HZ * 1e9;
        (step_ns as f64 - expected_ns).abs() > 2.0
    };
    let seeks = neighbours.filter(is_seek);
    // Each other step must be a rest or a jump.
    seeks
        .inspect(|pair| {
            let step_s = (pair[1].header.show_time_ns - pair[0].header.show_time_ns) as f64 * 1e-9;
            assert!(step_s == 0.0 || step_s.abs() > 0.45, "{step_s} s at {}", pair[1].header.tick);
        })
        .filter(|pair| pair[1].header.show_time_ns != pair[0].header.show_time_ns)
        .count()
}

#[test]
fn a_show_waits_for_art_net_timecode_and_follows_it() {
    let stage = Stage::new();
    // A source that a busy machine delays for a second is not lost.
    let (mut server, listen) = serve(&stage, "artnet:127.0.0.1:0", &["--timecode-timeout", "5"]);
    let mut reader = Reader::join(&stage);
    let standing = reader.next();
    assert_eq!((standing.state(), standing.header.show_time_ns), (ShowState::Paused, 0));
    let mut desk = Desk::start(&["artnet", &listen]);

    let clock = desk.order("play 60");
    let mut shots = read_following(&mut reader, clock, 0.0);
    assert!(shots.iter().all(|shot| shot.header.show_time_ns == 0 || shot.header.show_time_s() >= 59.95));
    let line = event(&mut server.process, "follows");
    assert!(line["position_s"].as_f64() >= Some(60.0), "{line}");

    let clock = desk.order("play 120");
    shots.extend(read_following(&mut reader, clock, 0.0));
    assert!(shots.last().expect("frames").header.show_time_s() >= 120.0);

    desk.order("silence");
    let line = event(&mut server.process, "lost");
    let lost_s = line["time_s"].as_f64().expect("a time");
    let free = reader.read_until("the show continues without timecode for half a second", |header| {
        header.show_time_s() > lost_s + 0.5
    });
    let last = free.last().expect("frames");
    assert_eq!((last.state(), last.header.time_scale), (ShowState::Running, 1.0), "the show continues by itself");
    shots.extend(free);

    desk.order("speak");
    event(&mut server.process, "follows");
    shots.extend(read_following(&mut reader, clock, 0.0));

    // A stall of this machine may cause another seek.
    assert!(count_seeks(&shots) >= 1, "the show has sought to 120 s");

    for junk in ["00", "4172742d4e6574000097000e0000", "4172742d4e6574000097000e00001900000001", "ffffffffff"] {
        desk.order(&format!("send {junk}"));
    }
    // ArtDmx packets are ignored, and not counted.
    desk.order("send 4172742d4e6574000050000e");
    // The packets before this order are counted by then.
    desk.order("stand");
    event(&mut server.process, "stands");
    reader.read_until("the show is paused", |header| header.show_state() == Some(ShowState::Paused));
    let lines = server.process.terminate().expect_clean().json_lines();
    let counts = lines.iter().find(|line| line["type"] == "timecode_summary").expect("a summary");
    assert_eq!(counts["malformed"], 4, "{counts}");
    assert!(counts["of_others"] == 0 && counts["taken"].as_u64() > Some(0), "{counts}");
}

#[test]
fn one_desk_is_followed_and_packets_of_another_are_counted() {
    let stage = Stage::new();
    // The timeout is longer than any stall of the first source.
    let (mut server, listen) = serve(&stage, "artnet:127.0.0.1:0", &["--timecode-timeout", "3600"]);
    let mut desk = Desk::start(&["artnet", &listen]);
    let mut other = Desk::start(&["artnet", &listen, "--from", "127.0.0.2"]);
    desk.order("play 60");
    event(&mut server.process, "follows");
    for _ in 0..2 {
        other.order("send 4172742d4e6574000097000e00000000050001");
    }
    // The packets before this order are counted by then.
    desk.order("stand");
    let stands = event(&mut server.process, "stands");
    assert!(stands["position_s"].as_f64() < Some(290.0), "{stands}");
    let lines = server.process.terminate().expect_clean().json_lines();
    let counts = lines.iter().find(|line| line["type"] == "timecode_summary").expect("a summary");
    assert_eq!((&counts["of_others"], &counts["malformed"]), (&json!(2), &json!(0)), "{counts}");
}

#[test]
fn a_show_ends_where_it_has_walked_and_not_where_its_timecode_jumps() {
    let stage = Stage::new();
    let (mut server, listen) = serve(&stage, "osc:0", &["--until", "100"]);
    let mut reader = Reader::join(&stage);
    let mut desk = Desk::start(&["osc", &listen]);
    desk.order("play 500");
    let beyond = reader.read_until("the show is at its end", |header| header.show_state() == Some(ShowState::Finished));
    assert_eq!(beyond.last().expect("frames").header.show_time_s(), 100.0);
    reader.read_to_tick(beyond.last().expect("frames").header.tick + 10);
    let clock = desk.order("play 60");
    read_following(&mut reader, clock, 0.0);
    // The position is seconds before the end, since a delayed source is followed late.
    desk.order("play 95");
    reader.read_to_end();
    event(&mut server.process, "follows");
    let summary = server.summary();
    assert_eq!(summary["sim_time_s"], 100.0, "{summary}");
}

#[test]
fn a_seek_is_refused_while_the_show_follows_timecode() {
    let stage = Stage::new();
    let (server, listen) = serve(&stage, "osc:0", &[]);
    stage.run(&["ctl", "seek", "5"]).expect_clean();
    let mut reader = Reader::join(&stage);
    let mut desk = Desk::start(&["osc", &listen]);
    let clock = desk.order("play 10");
    read_following(&mut reader, clock, 0.0);
    let refused = stage.run(&["ctl", "seek", "5"]);
    let told = "refused: the show follows timecode: seek on the device that sends it\n";
    assert_eq!((refused.code(), refused.stderr.as_str()), (Some(1), told));
    server.process.terminate().expect_clean();
}

#[test]
fn osc_timecode_is_followed_in_every_form_with_an_offset() {
    for (form, kind) in [("text", "2"), ("numbers", "1"), ("decimals", "1"), ("float", "0"), ("double", "3")] {
        let stage = Stage::new();
        let (server, listen) = serve(&stage, "osc:0", &["--timecode-offset", "-3540"]);
        let mut reader = Reader::join(&stage);
        let mut desk = Desk::start(&["osc", &listen, "--form", form, "--kind", kind]);
        let clock = desk.order("play 3600");
        let shots = read_following(&mut reader, clock, -3540.0);
        count_seeks(&shots);
        server.process.terminate().expect_clean();
    }
}

#[test]
fn an_operators_pause_overrides_the_timecode() {
    let stage = Stage::new();
    let (server, listen) = serve(&stage, "osc:0", &[]);
    let mut reader = Reader::join(&stage);
    let mut desk = Desk::start(&["osc", &listen]);
    let clock = desk.order("play 10");
    read_following(&mut reader, clock, 0.0);
    stage.run(&["ctl", "pause"]).expect_clean();
    let paused = reader.read_until("the show is paused", |header| header.show_state() == Some(ShowState::Paused));
    let paused_ns = paused.last().expect("frames").header.show_time_ns;
    let clock = desk.order("play 200");
    let last_tick = paused.last().expect("frames").header.tick + 50;
    assert!(reader.read_to_tick(last_tick).iter().all(|shot| shot.header.show_time_ns == paused_ns));
    stage.run(&["ctl", "resume"]).expect_clean();
    read_following(&mut reader, clock, 0.0);
    server.process.terminate().expect_clean();
}

#[test]
fn a_guarded_show_seeks_to_the_timecode_after_its_guards_proof() {
    let stage = Stage::new();
    let (server, listen) = serve(&stage, "osc:0", &["--guarded"]);
    let mut reader = Reader::join(&stage);
    let mut desk = Desk::start(&["osc", &listen]);
    let clock = desk.order("play 100");
    let unproved = reader.read_to_tick(60);
    assert!(unproved.iter().all(|shot| shot.header.show_time_ns == 0), "no guard has proved the travel");
    let monitor = stage.start(&["monitor", "--guard", "--format", "json"]);
    read_following(&mut reader, clock, 0.0);
    server.process.terminate().expect_clean();
    monitor.terminate();
}

#[test]
fn a_monitor_sweeps_the_travel_of_a_show_that_follows_timecode() {
    let stage = Stage::new();
    let (server, listen) = serve(&stage, "osc:0", &["--until", "414", "--readers", "2"]);
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let mut reader = Reader::join(&stage);
    // The first frame reaches both readers.
    reader.next();
    let mut desk = Desk::start(&["osc", &listen]);
    // The position is seconds before the contact, since a delayed source is followed late.
    desk.order("play 408");
    reader.read_to_end();
    server.process.end().expect_clean();
    let lines = monitor.terminate().expect_clean().json_lines();
    let contact = lines.iter().find(|line| line["kind"] == "contact").unwrap_or_else(|| panic!("{lines:?}"));
    let time_s = contact["time_s"].as_f64().expect("a time");
    assert!((time_s - 412.473_838).abs() < 1e-6 && contact["benches"] == json!([0, 8]), "{contact}");
}

#[test]
fn a_show_that_follows_timecode_continues_after_a_contact_until_it_is_stopped() {
    let stage = Stage::new();
    let mut show = stage.start(&["show", "--out", "out", "--rate", "50", "--timecode", "osc:0", "--format", "json"]);
    let mut reader = Reader::await_server(&stage);
    reader.next();
    let mut desk = Desk::start(&["osc", &listens(&mut show)]);
    desk.order("play 408");
    reader.read_until("show time is past 414 s", |header| header.show_time_s() > 414.0);
    let clock = desk.order("play 200");
    read_following(&mut reader, clock, 0.0);
    stage.run(&["ctl", "stop"]).expect_clean();
    let summary = show.end();
    assert_eq!(summary.code(), Some(0), "{}", summary.stderr);
    assert_eq!(summary.last_json()["contact"]["benches"], json!([0, 8]), "{}", summary.stdout);
}

#[test]
fn a_server_killed_while_the_timecode_stands_is_restarted_and_follows() {
    let stage = Stage::new();
    let args = ["show", "--out", "out", "--rate", "50", "--auto-resume", "--timecode", "osc:0", "--format", "json"];
    let mut show = stage.start(&args);
    let mut reader = Reader::await_server(&stage);
    let before = reader.next().header.run_id;
    let mut desk = Desk::start(&["osc", &listens(&mut show)]);
    let clock = desk.order("play 100");
    read_following(&mut reader, clock, 0.0);
    desk.order("stand");
    show.complaint_with(": so does the show");
    kill(await_child(show.pid(), "serve", None));
    reader.read_until("a frame of the next run", |header| header.run_id != before);
    let clock = desk.order("play 200");
    read_following(&mut reader, clock, 0.0);
    let ended = show.terminate();
    assert_eq!((ended.code(), &ended.last_json()["restarts"]["serve"]), (Some(0), &json!(1)), "{}", ended.stderr);
}

#[test]
fn impossible_timecode_sources_are_refused_in_one_line() {
    let stage = Stage::new();
    let taken = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let source = format!("osc:{}", taken.local_addr().expect("an address").port());
    let busy = format!(
        "error: cannot listen for timecode on 127.0.0.1:{}: another program uses this port; end that program or send the \
         timecode to another port\n",
        &source[4..]
    );
    for (args, code, error) in [
        (&["--timecode", &source][..], 1, busy.as_str()),
        (
            &["--timecode", "midi"],
            2,
            "error: invalid value 'midi' for '--timecode <SOURCE>': must be \
             osc:[ADDRESS:]PORT[/MESSAGE], MESSAGE without blanks and #*,?[]{}, or artnet[:ADDRESS[:PORT]], or \
             ltc:- or ltc:FILE.wav\n",
        ),
        (
            &["--timecode", "artnet:127.0.0.1:0", "--timecode-fps", "25"],
            2,
            "error: --timecode-fps is only for osc and ltc: Art-Net timecode contains its frame rate\n",
        ),
        (
            &["--timecode", "osc:0", "--time-scale", "2"],
            2,
            "error: time_scale is 2, must be 1 with --timecode, which sets the pace\n",
        ),
        (
            &["--timecode", "osc:0", "--timecode-fps", "60"],
            2,
            "error: invalid value '60' for '--timecode-fps <FPS>': must be 24, 25, 29.97 (drop-frame), 29.97ndf or 30\n",
        ),
        (
            &["--timecode", "osc:0", "--start-travel", "0", "--until", "-5"],
            2,
            "error: --until is -5, must be at least 0\n",
        ),
    ] {
        let ended = stage.run(&[&["serve"], args].concat());
        assert_eq!((ended.code(), ended.stdout.as_str(), ended.stderr.as_str()), (Some(code), "", error), "{args:?}");
    }
    let lonely = stage.run(&["serve", "--timecode-offset", "1"]);
    assert!(lonely.code() == Some(2) && lonely.stderr.lines().count() == 1, "{}", lonely.stderr);
}
