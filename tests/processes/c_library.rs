//! The C library, used by C and C++ programs. They read the same values as Rust, to the last bit, and get the same errors. The
//! programs are in `ipc/c/tests`, and check themselves what needs no other process.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use bench_dragon_ipc::service::frame_buffer;
use bench_dragon_ipc::{
    Alert, AlertSubscriber, BenchState, CommandClient, CommandEvent, CommandEventReader, Continuity, DescriptionReader,
    DragonMotion, HandleState, Request,
};
use rustix::process::{Pid, Signal, kill_process};
use test_support::eventually::{DEADLINE, eventually};
use test_support::process::Process;
use test_support::skip::has_programs;

use crate::c_compiler::Language::{C99, Cpp17};
use crate::c_compiler::Linkage::{Shared, Static};
use crate::c_compiler::{Language, Linkage, compile, prefix, succeed, under_valgrind};
use crate::dragons::TWO_DRAGONS;
use crate::reader::{Reader, Shot};
use crate::stage::Stage;

const COMPILERS: [&str; 3] = ["gcc", "g++", "pkg-config"];
/// Benches of the paper's dragon.
const BENCHES: usize = 223;

/// All combinations of language and linkage.
const WAYS: [(Language, Linkage); 4] = [(C99, Shared), (C99, Static), (Cpp17, Shared), (Cpp17, Static)];

/// Returns the command of a client, under valgrind if the machine has it.
fn watched(program: &Path) -> Command {
    if has_programs(&["valgrind"]) { under_valgrind(program) } else { Command::new(program) }
}

/// Starts a client on a stage's instance.
fn start(stage: &Stage, mut client: Command, args: &[&str]) -> Process {
    client.arg(stage.domain().instance().as_str()).args(args);
    Process::start(client)
}

/// Compiles a client of `ipc/c/tests`, runs it under valgrind to its end, and returns its stdout.
fn run(stage: &Stage, source: &str, args: &[&str]) -> String {
    let program = compile(stage, source, language_of(source), Shared);
    start(stage, watched(&program), args).end().expect_clean().stdout
}

/// Returns the language of a client.
fn language_of(source: &str) -> Language {
    if Path::new(source).extension().is_some_and(|extension| extension == "cpp") { Cpp17 } else { C99 }
}

#[test]
fn c_and_cpp_read_the_same_values_as_rust() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let programs: Vec<PathBuf> =
        WAYS.iter().map(|&(language, linkage)| compile(&stage, "frames.c", language, linkage)).collect();
    let server = stage.serve(&["--held", "--rate", "20", "--until", "2"]);
    let clients = programs.iter().map(Command::new).chain([watched(&programs[0])]);
    let clients: Vec<(PathBuf, Process)> = clients
        .enumerate()
        .map(|(number, command)| {
            let file = stage.path(&number.to_string());
            let mut process = start(&stage, command, &[&file.to_string_lossy()]);
            assert_eq!(process.next_line().as_deref(), Some("reading"), "{:?}", process.complaint());
            (file, process)
        })
        .collect();

    let mut reader = Reader::join(&stage);
    let mut shots = vec![reader.next()];
    let commands = CommandClient::open(stage.domain(), "test").expect("a server has created the services");
    commands.call(Request::Release, DEADLINE).expect("the show is held");
    shots.extend(reader.read_to_end());
    assert_eq!(reader.lost(), 0);
    // For its reader, the first frame has no predecessor.
    let expected: Vec<String> = shots[1..].iter().map(line_of).collect();
    assert_eq!(shots[shots.len() - 1].header.show_time_ns, 2_000_000_000, "the whole show");
    for (file, process) in clients {
        process.end().expect_clean();
        let lines = fs::read_to_string(file).expect("the client has written it");
        let lines: Vec<&str> = lines.lines().collect();
        assert!(
            lines.ends_with(&expected.iter().map(String::as_str).collect::<Vec<_>>()),
            "the client has read the same frames and values"
        );
        assert!(lines[0].ends_with(" 0 0"), "the first frame is its reader's first");
    }
    server.summary();
}

#[test]
fn a_c_client_gets_an_error_for_every_missing_or_invalid_argument() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    assert_eq!(run(&stage, "arguments.c", &[]).trim_end(), env!("CARGO_PKG_VERSION"));
}

#[test]
fn a_c_client_commands_the_server_and_gets_the_reason_of_a_refusal() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    run(&stage, "commands.c", &[]);
    server.summary();
}

#[test]
fn a_c_client_reads_the_events_of_the_commands_to_a_server() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let events = CommandEventReader::open(stage.domain(), "test").expect("a server has created the services");
    let printed = run(&stage, "command_events.c", &[]);
    let mut expected: Vec<String> = Vec::new();
    eventually("all events have arrived", || {
        expected.extend(std::iter::from_fn(|| events.receive().expect("the bus is readable")).map(line_of_event));
        (expected.len() >= printed.lines().count()).then_some(())
    });
    assert_eq!(printed.lines().collect::<Vec<_>>(), expected);
    server.stop();
}

#[test]
fn a_c_client_reads_the_dragons_by_their_names() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--config", TWO_DRAGONS, "--held", "--rate", "20"]);
    let printed = run(&stage, "dragons.c", &[]);
    let shot = Reader::join(&stage).next();
    let line = |(name, motion): (&str, &DragonMotion)| {
        let benches: Vec<BenchState> = motion.benches(&shot.handles).collect();
        let ends = [benches[0], benches[benches.len() - 1]];
        let centres = ends.map(|bench| format!("{:x} {:x}", bench.centre_m[0].to_bits(), bench.centre_m[1].to_bits()));
        format!("{name} {} {:x} 1 {}", benches.len(), motion.travel_m.to_bits(), centres.join(" "))
    };
    let expected: Vec<String> = ["gold", "silver"].into_iter().zip(shot.header.dragons()).map(line).collect();
    assert_eq!(printed.lines().collect::<Vec<_>>(), expected);
    server.stop();
}

/// Returns an event as `command_events.c` prints it.
fn line_of_event(event: CommandEvent) -> String {
    let CommandEvent { run_id, number, tick, show_time_ns, wall_ns, overruns, values, .. } = event;
    let CommandEvent { lowest, highest, kind, sender, pid, refusal, flags, .. } = event;
    let [a, b, c, d, lowest, highest] = [values[0], values[1], values[2], values[3], lowest, highest]
        .map(|value: f64| format!("{:x}", value.to_bits()));
    format!(
        "{run_id} {number} {tick} {show_time_ns:x} {wall_ns:x} {overruns} {a} {b} {c} {d} {lowest} {highest} {kind} {sender} {pid} \
         {refusal} {flags}"
    )
}

#[test]
fn a_frame_that_a_c_client_holds_outlives_the_server_and_its_client() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let reader = DescriptionReader::open(stage.domain(), "test").expect("a server has created the services");
    let description = eventually("the description has arrived", || reader.poll().expect("the bus is readable"));
    let expected = format!("{}\n20\n{}", server.process.pid(), description.toml);
    assert_eq!(run(&stage, "lifetimes.c", &[]), expected);
    server.summary();
}

#[test]
fn a_c_client_reads_on_from_one_server_to_the_next() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let program = compile(&stage, "restart.c", C99, Shared);
    let server = stage.serve(&["--rate", "20"]);
    let mut client = start(&stage, watched(&program), &[]);
    assert_eq!(client.next_line(), Some(server.run_id.to_string()));
    server.stop();
    let server = stage.serve(&["--rate", "20"]);
    assert_eq!(client.end().expect_clean().stdout, format!("{}\n", server.run_id));
    server.stop();
}

#[test]
fn a_c_client_tells_ended_lost_and_hanging_servers_apart() {
    if !has_programs(&COMPILERS) {
        return;
    }
    for (end, state) in [("stop", "ended"), ("kill", "lost"), ("suspend", "hanging")] {
        let stage = Stage::new();
        let program = compile(&stage, "source.c", C99, Shared);
        let server = stage.serve(&["--rate", "20"]);
        let mut client = start(&stage, watched(&program), &[]);
        assert_eq!(client.next_line().as_deref(), Some("reading"), "{:?}", client.complaint());
        let pid = Pid::from_raw(server.process.pid().cast_signed()).expect("a process id is not 0");
        match end {
            "stop" => drop(server.stop()),
            "kill" => server.process.kill(),
            _ => {
                kill_process(pid, Signal::STOP).expect("the server is a child of this test");
                let printed = client.end().expect_clean().stdout;
                kill_process(pid, Signal::CONT).expect("the server is a child of this test");
                assert_eq!(printed, format!("{state}\n"));
                server.stop();
                continue;
            }
        }
        assert_eq!(client.end().expect_clean().stdout, format!("{state}\n"));
    }
}

#[test]
fn a_c_client_that_stops_reading_counts_what_it_lost() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let beyond = 100;
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "500"]);
    let ticks = frame_buffer(BENCHES + 1) + beyond;
    let lost: usize = run(&stage, "gaps.c", &[&ticks.to_string()]).trim_end().parse().expect("a number");
    assert!(lost >= beyond, "{lost} lost");
    server.stop();
}

#[test]
fn a_c_client_gets_the_same_alerts_as_rust() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--held", "--time-scale", "5"]);
    assert_eq!(stage.run(&["ctl", "hold"]).code(), Some(0));
    let alerts = AlertSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let mut monitor = stage.start(&["monitor", "--format", "json"]);
    // The monitor reads frames once it reports the hold.
    monitor.json_until("the monitor reports that the show is held", |line| line["kind"] == "held");

    let printed = run(&stage, "alerts.c", &["410"]);
    let printed: Vec<&str> = printed.lines().collect();
    let heard: Vec<String> = std::iter::from_fn(|| alerts.receive().expect("the bus is readable"))
        .map(|alert| line_of_alert(&alert))
        .collect();
    let until = heard
        .iter()
        .position(|line| Some(line.as_str()) == printed.last().copied())
        .expect("the contact is among the alerts");
    let heard: Vec<&str> = heard[..=until].iter().map(String::as_str).collect();
    assert!(printed.len() > 1, "alerts of near benches precede the contact");
    assert!(heard.ends_with(&printed), "{printed:#?}\n{heard:#?}");
    monitor.terminate().expect_clean();
    server.stop();
}

#[test]
fn threads_share_a_client_and_each_has_its_own_last_error() {
    if !has_programs(&COMPILERS) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    run(&stage, "threads.cpp", &[]);
    server.summary();
}

#[test]
fn cmake_builds_the_examples_and_they_print_the_pose() {
    if !has_programs(&["cmake", "gcc", "g++"]) {
        return;
    }
    let stage = Stage::new();
    let build = stage.path("build");
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/ipc/c/example");
    let installed = format!("-DCMAKE_PREFIX_PATH={}", prefix().display());
    let mut configure = Command::new("cmake");
    configure.args(["-S", example, "-B"]).arg(&build).arg(installed);
    configure.args(["-DCMAKE_C_FLAGS=-Wall -Wextra -Werror", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror"]);
    succeed(configure);
    let mut make = Command::new("cmake");
    make.arg("--build").arg(&build);
    succeed(make);

    let server = stage.serve(&["--rate", "20", "--until", "1", "--readers", "2"]);
    let heads = start(&stage, Command::new(build.join("head")), &[]);
    let benches = start(&stage, Command::new(build.join("benches")), &[]).end().expect_clean().stdout;
    let heads = heads.end().expect_clean().stdout;
    assert!(heads.starts_with("0.000 s: head's front hinge at 8.800, "), "{heads}");
    assert_eq!(benches.lines().count(), 223, "{benches}");
    assert!(benches.starts_with("0: centre "), "{benches}");
    assert_eq!(server.summary()["frames"], heads.lines().count(), "one line per frame: {heads}");
}

/// Returns a frame as the line that the client `frames` writes.
fn line_of(shot: &Shot) -> String {
    let numbers =
        shot.handles.iter().flat_map(|HandleState { position_m, velocity_mps }| [*position_m, *velocity_mps]).flatten();
    let benches = shot.header.benches(&shot.handles).flat_map(|bench| {
        let [x, y, z] = bench.centre_m;
        let [vx, vy, vz] = bench.velocity_mps;
        [x, y, z, bench.heading_rad, vx, vy, vz, bench.turn_rate_radps, bench.pitch_rad]
    });
    let words = shot.header_words().into_iter().chain(numbers.chain(benches).map(f64::to_bits));
    let continuity = match shot.continuity {
        Continuity::First => "0 0".to_owned(),
        Continuity::Next => "1 0".to_owned(),
        Continuity::Lost(frames) => format!("2 {frames}"),
        Continuity::Restarted => "3 0".to_owned(),
    };
    words.map(|word| format!("{word:x}")).chain([continuity]).collect::<Vec<_>>().join(" ")
}

/// Returns an alert as the line that the client `alerts` prints.
fn line_of_alert(alert: &Alert) -> String {
    let [x, y] = alert.point_m.map(f64::to_bits);
    let words = [
        alert.run_id,
        alert.tick,
        alert.show_time_ns as u64,
        alert.forecast_ns as u64,
        alert.clearance_m.to_bits(),
        x,
        y,
        alert.kind.into(),
        alert.bench_a.into(),
        alert.bench_b.into(),
    ];
    words.map(|word| format!("{word:x}")).join(" ")
}
