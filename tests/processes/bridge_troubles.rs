//! Bridges with a missing server, receiver or interface.

use std::fs;
use std::io::{ErrorKind, Read as _};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::process::Command;

use rustix::net::sockopt::set_socket_recv_buffer_size;
use rustix::process::Signal;
use serde_json::json;
use test_support::eventually::{DEADLINE, eventually};
use test_support::process::Process;
use test_support::skip::is_possible;

use crate::first_tracker::{receiver, wait_for, wait_for_status};
use crate::reader::Reader;
use crate::server::Server;
use crate::stage::{Stage, program};

/// An address of this machine on which no other program chooses ports.
const RECEIVER: &str = "127.34.56.78:0";

/// Accepts the connection of a bridge. Its reads have a deadline.
#[track_caller]
fn accept(listener: &TcpListener) -> TcpStream {
    listener.set_nonblocking(true).expect("a listener");
    let (stream, _) = eventually("the bridge connects", || listener.accept().ok());
    stream.set_nonblocking(false).expect("a connection");
    stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    stream
}

/// Returns the message of the next notice. Skips other lines.
fn notice(bridge: &mut Process) -> String {
    let lines = bridge.json_until("a notice", |line| line["type"] == "notice");
    lines.last().expect("a line")["message"].as_str().expect("a text").to_owned()
}

#[test]
fn trackers_of_a_killed_server_become_invalid_and_stop_until_the_next_server_starts() {
    let stage = Stage::new();
    let (socket, target) = receiver();
    let mut bridge = stage.start_waiting(&["bridge", "psn", "--to", &target, "--rate", "50", "--format", "json"]);
    let server = stage.serve(&["--rate", "50"]);
    assert_eq!(bridge.json()["type"], "started");
    assert_ne!(wait_for_status(&socket, 1.0), [0.0; 3]);
    server.process.kill();
    assert_eq!(wait_for_status(&socket, 0.0), [0.0; 3]);
    let silent = bridge
        .json_until("the bridge reports that the server is silent", |line| line["type"] == "silent")
        .pop()
        .expect("the line");
    assert!(silent["age_s"].as_f64() > Some(0.3), "{silent}");
    let server = stage.serve(&["--rate", "50"]);
    assert_ne!(wait_for_status(&socket, 1.0), [0.0; 3]);
    bridge.json_until("the bridge reports frames again", |line| line["type"] == "resumed");
    let summary = bridge.terminate().expect_clean().last_json();
    assert!(summary["stale"].as_u64() > Some(0), "{summary}");
    server.stop();
}

#[test]
fn a_slow_replay_is_not_a_silent_server() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--until", "1", "--readers", "1"]);
    let recorder = stage.start(&["record", "a.mcap"]);
    server.summary();
    recorder.terminate().expect_clean();
    let (socket, target) = receiver();
    let mut bridge = stage.start_waiting(&["bridge", "psn", "--to", &target, "--rate", "50", "--format", "json"]);
    // A frame every two seconds.
    let replay = stage.start(&["replay", "a.mcap", "--rate", "0.01", "--format", "json"]);
    assert_eq!(bridge.json()["type"], "started");
    let old = wait_for(&socket, |tracker| (1_600_000..2_900_000).contains(&tracker.age_us()));
    assert_eq!(old.status, 1.0, "{old:?}");
    assert_ne!(old.speed, [0.0; 3]);
    replay.terminate().expect_clean();
    assert_eq!(wait_for_status(&socket, 0.0), [0.0; 3]);
    bridge.terminate().expect_clean();
}

#[test]
fn a_missing_receiver_is_reported_and_a_later_one_gets_the_poses() {
    let stage = Stage::new();
    let address = {
        let socket = UdpSocket::bind(RECEIVER).expect("a port");
        socket.local_addr().expect("a bound socket has an address")
    };
    let server = stage.serve(&["--rate", "20"]);
    let mut bridge = stage.start(&["bridge", "psn", "--to", &address.to_string(), "--format", "json"]);
    let told = notice(&mut bridge);
    assert!(told.starts_with(&format!("cannot send to {address}, still trying: Connection refused")), "{told}");
    let socket = UdpSocket::bind(address).expect("no other program binds this address");
    socket.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    wait_for_status(&socket, 1.0);
    let told = notice(&mut bridge);
    assert!(told.starts_with(&format!("sending to {address} works again, after ")), "{told}");
    let summary = bridge.terminate().expect_clean().last_json();
    assert!(summary["errors"].as_u64() > Some(0), "{summary}");
    server.stop();
}

#[test]
fn a_stopped_or_killed_bridge_does_not_delay_the_server() {
    let stage = Stage::new();
    let (socket, target) = receiver();
    let server = stage.serve(&["--rate", "500"]);
    let mut bridge = stage.start(&["bridge", "osc", "--to", &target, "--format", "json"]);
    assert_eq!(bridge.json()["type"], "started");
    socket.recv(&mut [0; 1_500]).expect("the bridge sends");
    bridge.signal(Signal::STOP);
    let mut reader = Reader::join(&stage);
    let first = reader.next().header.tick;
    // More frames than the bus keeps for the bridge: the server has overwritten unread ones.
    let shots = reader.read_to_tick(first + 600);
    assert!(shots.windows(2).all(|pair| pair[0].header.run_id == pair[1].header.run_id));
    bridge.kill();
    reader.read_to_tick(first + 700);
    server.stop();
}

/// Whether a signal has stopped the process.
fn is_stopped(pid: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).expect("the process runs");
    let (_, behind_name) = stat.rsplit_once(") ").expect("the name is in parentheses");
    behind_name.starts_with('T')
}

/// The packets between END bytes of SLIP.
fn packets_in(bytes: &[u8]) -> Vec<&[u8]> {
    bytes.split(|byte| *byte == 0xC0).filter(|packet| !packet.is_empty()).collect()
}

/// Reads what the buffers of both ends of a connection of this machine hold, while the sender is stopped.
fn buffered(stream: &mut TcpStream) -> Vec<u8> {
    let ports = [stream.peer_addr(), stream.local_addr()].map(|address| address.expect("a connection").port());
    let mut bytes = Vec::new();
    stream.set_nonblocking(true).expect("a connection");
    eventually("all bytes of the sender have arrived", || {
        let is_last = unsent(ports) == 0;
        let ended = stream.read_to_end(&mut bytes).expect_err("the sender has not closed it").kind();
        assert_eq!(ended, ErrorKind::WouldBlock);
        is_last.then_some(())
    });
    stream.set_nonblocking(false).expect("a connection");
    bytes
}

/// Bytes that have not arrived at the other end of a connection of this machine, from the first port to the second.
fn unsent(ports: [u16; 2]) -> u64 {
    let connections = fs::read_to_string("/proc/net/tcp").expect("Linux lists its connections");
    let queue = connections.lines().skip(1).find_map(|line| {
        let fields: Vec<&str> = line.split_ascii_whitespace().collect();
        let port = |field: &str| u16::from_str_radix(field.rsplit_once(':')?.1, 16).ok();
        let is_this = [port(fields[1]), port(fields[2])] == ports.map(Some);
        is_this.then(|| fields[4].split_once(':').expect("two queues").0)
    });
    u64::from_str_radix(queue.expect("the connection is listed"), 16).expect("a number of bytes")
}

#[test]
fn a_tcp_receiver_that_does_not_read_loses_whole_frames_and_is_reported() {
    // Three frames in the system's buffer, which may be twice as large as requested, and the frames on both sides of it.
    const MOST_KEPT: usize = 12;
    let stage = Stage::new();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    set_socket_recv_buffer_size(&listener, 4_096).expect("a socket");
    let target = listener.local_addr().expect("a bound socket has an address").to_string();
    let server = stage.serve(&["--rate", "50"]);
    let args = ["bridge", "osc", "--tcp", "--to", &target, "--rate", "250", "--format", "json"];
    let mut bridge = stage.start(&args);
    let mut stream = accept(&listener);
    let told = notice(&mut bridge);
    assert_eq!(
        told,
        format!("cannot send to {target}, still trying: the receiver is slower than the bridge, frames are dropped")
    );
    // While the bridge is stopped, no frame follows those that the buffers hold.
    bridge.signal(Signal::STOP);
    eventually("the bridge is stopped", || is_stopped(bridge.pid()).then_some(()));
    let mut bytes = buffered(&mut stream);
    let kept = packets_in(&bytes).len() / 224;
    assert!(kept <= MOST_KEPT, "{kept} frames were kept");
    bridge.signal(Signal::TERM);
    bridge.signal(Signal::CONT);
    stream.read_to_end(&mut bytes).expect("the bridge closes it");
    let summary = bridge.end().expect_clean().last_json();
    assert!(summary["dropped"].as_u64() > Some(0), "{summary}");
    let packets = packets_in(&bytes);
    assert_eq!(packets.len() % 224, 0, "only whole frames");
    assert!(packets.chunks(224).all(|frame| frame[0].starts_with(b"/dragon/show\0")));
    server.stop();
}

#[test]
fn a_tcp_receiver_that_starts_late_or_again_is_found() {
    let stage = Stage::new();
    let address = {
        let listener = TcpListener::bind(RECEIVER).expect("a port");
        listener.local_addr().expect("a bound socket has an address")
    };
    let server = stage.serve(&["--rate", "20"]);
    let mut bridge = stage.start(&["bridge", "osc", "--tcp", "--to", &address.to_string(), "--format", "json"]);
    let told = notice(&mut bridge);
    assert!(told.starts_with(&format!("cannot send to {address}, still trying: Connection refused")), "{told}");
    let listener = TcpListener::bind(address).expect("no other program binds this address");
    for _ in 0..2 {
        let mut stream = accept(&listener);
        let mut beginning = [0; 13];
        stream.read_exact(&mut beginning).expect("the bridge sends");
        assert_eq!(&beginning, b"\xC0/dragon/show");
    }
    bridge.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_network_that_comes_up_is_used_and_its_loss_is_reported() {
    let stage = Stage::new();
    let pair = "link add stage type veth peer name desk";
    let trial = format!("ip {pair} && exec \"$@\"");
    if !is_possible(&["unshare", "--net", "sh", "-c", &trial, "sh"]) {
        return;
    }
    let server = stage.serve(&["--rate", "50"]);
    let in_a_namespace = stage.command(&["bridge", "psn", "--format", "json"]);
    let mut command = Command::new("unshare");
    command.arg("--net").arg(in_a_namespace.get_program()).args(in_a_namespace.get_args());
    let mut bridge = Process::start(command);
    let told = notice(&mut bridge);
    assert!(told.starts_with("cannot send to 236.10.10.10:56565, still trying: Network is unreachable"), "{told}");
    let namespace = format!("--net=/proc/{}/ns/net", bridge.pid());
    let ip = |args: &str| {
        let mut within = Command::new("nsenter");
        within.arg(&namespace).arg("ip").args(args.split(' '));
        Process::start(within).end().expect_clean();
    };
    ip(pair);
    ip("link set desk up");
    ip("link set stage up");
    ip("address add 10.0.0.5/24 dev stage");
    ip("route add default dev stage");
    let told = notice(&mut bridge);
    assert!(told.starts_with("sending to 236.10.10.10:56565 works again, after "), "{told}");
    ip("link delete stage");
    let told = notice(&mut bridge);
    assert!(told.starts_with("cannot send to 236.10.10.10:56565, still trying: "), "{told}");
    let summary = bridge.terminate().expect_clean().last_json();
    assert!(summary["packets"].as_u64() > Some(0) && summary["errors"].as_u64() > Some(0), "{summary}");
    server.stop();
}

#[test]
fn impossible_bridges_are_refused_in_one_line() {
    let stage = Stage::new();
    let cases: [(&[&str], i32, &str); 25] = [
        (
            &["psn", "--stale-after", "0"],
            2,
            "invalid value '0' for '--stale-after <SECONDS>': must be seconds from 0.05 to 60",
        ),
        (
            &["osc", "--stale-after", "-1"],
            2,
            "invalid value '-1' for '--stale-after <SECONDS>': must be seconds from 0.05",
        ),
        (&["osc", "--stale-after", "NaN"], 2, "must be seconds from 0.05 to 60"),
        (
            &["psn", "--interface", "192.0.2.77"],
            1,
            "error: no interface can send from 192.0.2.77, `ip address` lists all interfaces",
        ),
        (&["psn", "--to", "10.0.0.1"], 2, "must be an IPv4 address and a port, such as 10.0.0.20:56565"),
        (&["psn", "--to", "10.0.0.1:0"], 2, "must be an IPv4 address and a port"),
        (&["psn", "--rate", "251"], 2, "must be from 1 to 250"),
        (&["psn", "--ttl", "0"], 2, "must be from 1 to 255"),
        (&["psn", "--name", "Drache \u{9f8d}"], 2, "must be 1 to 64 printable ASCII characters"),
        (
            &["psn", "--axes", "x,y"],
            2,
            "invalid value 'x,y' for '--axes <AXES>': must be x, y and z in some order, each once",
        ),
        (
            &["osc", "--axes", "-x,-x,z"],
            2,
            "invalid value '-x,-x,z' for '--axes <AXES>': must be x, y and z in some order",
        ),
        (
            &["psn", "--offset", "-1,2"],
            2,
            "invalid value '-1,2' for '--offset <X,Y,Z>': must be metres to the right, away and up, such as 2.5,-4,0, each from \
             -10000 to 10000",
        ),
        (&["osc", "--offset", "0,0,20000"], 2, "must be metres to the right, away and up"),
        (
            &["osc", "--rotate", "-361"],
            2,
            "invalid value '-361' for '--rotate <DEGREES>': must be degrees from -360 to 360",
        ),
        (
            &["psn", "--benches", "20..10"],
            2,
            "invalid value '20..10' for '--benches <LIST>': must be numbers from 0 to 99999 and ranges from a lower to a higher \
             one, such as 0,10..20 or 10.., or those of one of several dragons, such as gold:0..5",
        ),
        (&["osc", "--benches", "-1"], 2, "invalid value '-1' for '--benches <LIST>': must be numbers from 0 to 99999"),
        (&["osc", "--benches", "100000"], 2, "must be numbers from 0 to 99999"),
        (&["psn", "--first-id", "65536"], 2, "invalid value '65536' for '--first-id <N>': must be from 0 to 65535"),
        (
            &["psn", "--tracker-name", "Bench {number}"],
            2,
            "invalid value 'Bench {number}' for '--tracker-name <PATTERN>': must be 1 to 60 printable ASCII characters, where \
             {index} and {id} count as five and {dragon} as six, without any other { or }",
        ),
        (&["osc", "--first-id", "1"], 2, "unexpected argument '--first-id' found"),
        (&["osc", "--address", "/dragon"], 2, "must contain {index} for the bench's number"),
        (
            &["osc", "--address", "/a b/{index}"],
            2,
            "must begin with /, have no space and none of #*,?[]{} in its parts",
        ),
        (&["osc", "--tcp", "--ttl", "3"], 2, "cannot be used with"),
        (
            &["osc", "--tcp", "--to", "236.1.1.1:9000"],
            2,
            "--to is 236.1.1.1:9000, must be the address of one machine with --tcp",
        ),
        (
            &["osc", "--show-address", "/dragon/bench/0"],
            2,
            "--show-address is /dragon/bench/0, must differ from each bench's",
        ),
    ];
    for (args, status, complaint) in cases {
        let ended = stage.run(&[&["bridge"], args].concat());
        assert_eq!(ended.code(), Some(status), "{args:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(complaint), "{args:?}: {}", ended.stderr);
        assert_eq!(ended.stderr.lines().count(), 1, "{}", ended.stderr);
    }
}

#[test]
fn more_benches_than_a_frame_can_hold_are_refused_with_the_limit() {
    let stage = Stage::new();
    let config = stage.path("long.toml");
    fs::write(&config, "[dragon]\nbenches = 5101\n[route]\npitch_m = 1.7\nstart_turns = 60\n").expect("a file");
    let config = config.to_str().expect("the path is UTF-8");
    let server = stage.serve(&["--config", config, "--rate", "5", "--held"]);
    let (_socket, target) = receiver();
    let refusals: [(&[&str], &str); 2] = [
        (&[], "5101 benches are chosen, must be at most 5100 for PosiStageNet: choose fewer with --benches"),
        (
            &["--first-id", "65000", "--benches", "0,1000"],
            "bench 1000 would be tracker 66000, must be at most 65535: choose a lower --first-id or other --benches",
        ),
    ];
    for (flags, refusal) in refusals {
        let ended = stage.run(&[&["bridge", "psn", "--to", &target], flags].concat());
        assert_eq!(ended.code(), Some(1), "{}", ended.stderr);
        assert!(ended.stderr.ends_with(&format!("error: {refusal}\n")), "{}", ended.stderr);
    }
    let args = ["bridge", "psn", "--to", &target, "--benches", "1..", "--format", "json"];
    let mut bridge = stage.start(&args);
    let started = bridge.json();
    assert!(started["settings"].as_str().expect("a text").contains("trackers 1 to 5100 "), "{started}");
    bridge.terminate().expect_clean();
    server.stop();
}

/// Serves a dragon with this number of benches.
fn serve_benches(stage: &Stage, benches: usize) -> Server {
    let config = stage.path(&format!("{benches}.toml"));
    fs::write(&config, format!("[dragon]\nbenches = {benches}\n")).expect("a file");
    stage.serve(&["--config", config.to_str().expect("the path is UTF-8"), "--rate", "50"])
}

#[test]
fn chosen_benches_that_the_dragon_does_not_have_are_reported_once_for_each_dragon() {
    let stage = Stage::new();
    let (socket, target) = receiver();
    let args = ["bridge", "psn", "--to", &target, "--benches", "0,10..20", "--rate", "50", "--format", "json"];
    let mut bridge = stage.start_waiting(&args);
    let server = serve_benches(&stage, 15);
    let started = bridge.json();
    let trackers = "trackers 0, 10 to 14 \"Bench 0\" to \"Bench 14\"";
    assert!(started["settings"].as_str().expect("a text").contains(trackers), "{started}");
    let message = "benches 15..20 are not sent: the dragon's last bench is 14";
    assert_eq!(bridge.json(), json!({ "type": "notice", "message": message }));
    assert_ne!(wait_for_status(&socket, 1.0), [0.0; 3]);
    server.stop();
    let server = serve_benches(&stage, 30);
    let changed = bridge.json_until("the dragon has changed", |line| line["type"] == "changed").pop().expect("a line");
    let trackers = "trackers 0, 10 to 20 \"Bench 0\" to \"Bench 20\"";
    assert!(changed["settings"].as_str().expect("a text").contains(trackers), "{changed}");
    server.stop();
    // A restart with the same dragon changes nothing.
    let server = serve_benches(&stage, 30);
    wait_for(&socket, |tracker| tracker.status == 1.0);
    let run_ends = bridge.terminate().expect_clean();
    let last = run_ends.last_json();
    assert_eq!(last["type"], "summary", "{last}");
    server.stop();
}

#[test]
fn a_bridge_without_any_existing_bench_reports_it_and_sends_nothing() {
    let stage = Stage::new();
    let (_socket, target) = receiver();
    let server = serve_benches(&stage, 15);
    let args = ["bridge", "psn", "--to", &target, "--benches", "20..,30"];
    let bridge = stage.start(&args);
    let settings = bridge.complaint();
    assert!(
        settings.starts_with("PosiStageNet: unicast 127.0.0.1 port ") && settings.contains(", no trackers, "),
        "{settings}"
    );
    assert_eq!(bridge.complaint(), format!("sending to {target} at 60 Hz; Ctrl-C ends it"));
    assert_eq!(bridge.complaint(), "no bench is sent: --benches is 20.., the dragon's last bench is 14");
    let ended = bridge.terminate().expect_clean();
    assert!(ended.stdout.starts_with("0 frames (0 stale) in 0 packets of 0 bytes"), "{}", ended.stdout);
    server.stop();
}

#[test]
fn bridges_have_help_with_examples() {
    for bridge in ["psn", "osc"] {
        let ended = Process::start(program(&["bridge", bridge, "--help"])).end();
        assert!(ended.stdout.contains(&format!("bench-dragon bridge {bridge}")), "{}", ended.stdout);
    }
}
