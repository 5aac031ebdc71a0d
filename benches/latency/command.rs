//! Latency of a command: from the instant before it is sent until its reply has been read.
//!
//! Our server answers at its next tick, at 1 kHz, to a client of the bus (`CommandClient`, as `ctl` is one). Beside it, bare iceoryx2
//! request-response as in its own examples: a server that answers on the same schedule, and one that looks for requests in a busy
//! loop, the physical limit. The bare client polls in a busy loop; ours sleeps between looks. Contestants take turns, and a command
//! comes at any instant of a period.

use std::io::{self, BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use bench_dragon::source::server::schedule::Schedule;
use bench_dragon::system::clock::{monotonic_ns, sleep_precisely, sleep_until};
use bench_dragon_ipc::{CommandClient, Request};
use iceoryx2::port::client::Client;
use iceoryx2::prelude::{Node, ipc};
use iceoryx2::service::port_factory::request_response;

use crate::frame_source::RATE_HZ;
use crate::shared::{self, Figures, Program, quantile};
use crate::transport::bare;

/// First argument of a bench that measures this alone.
pub(crate) const COMMAND: &str = "command";
/// First argument of a bare server.
pub(crate) const ANSWER: &str = "answer";
/// Commands of each contestant.
const TURNS: usize = 1000;
const TIMEOUT: Duration = Duration::from_secs(10);
/// Second argument of a bare server: how it looks for requests.
const AT_TICKS: &str = "at-ticks";
const BUSY: &str = "busy";

type Service = ipc::Service;
/// A request, and its answer: the request's number.
type Commands = request_response::PortFactory<Service, u64, (), u64, ()>;

/// A contestant: its name, its title, and how it sends a command and waits for the reply.
type Contestant<'a> = (&'static str, &'static str, Box<dyn FnMut(u64) + 'a>);

/// Plays all turns, writes the figures of the bench `latency_command`, and prints them.
pub(crate) fn measure() {
    let domain = shared::domain(&format!("latency-command-{}", std::process::id()));
    let mut server = Program::start(&domain, &["serve", "--rate", &RATE_HZ.to_string()]);
    server.until("started");
    let client = CommandClient::open(&domain, "bench").expect("the server runs");
    let ours = |_| {
        let speed = Request::Speed { speed_mps: 1.0 };
        client.call(speed, TIMEOUT).expect("the speed is in its range");
    };
    let (at_ticks, busy) = (Answerer::start(AT_TICKS), Answerer::start(BUSY));
    let mut contestants: [Contestant<'_>; 3] = [
        ("ours", "bench-dragon", Box::new(ours)),
        ("bare_at_ticks", "bare iceoryx2, at ticks", Box::new(|number| at_ticks.ask(number))),
        ("bare_busy", "bare iceoryx2, busy server", Box::new(|number| busy.ask(number))),
    ];
    let mut all = [const { Vec::new() }; 3];
    let mut random = fastrand::Rng::with_seed(1);
    for turn in 0..TURNS * contestants.len() {
        let index = (turn + turn / contestants.len()) % contestants.len();
        thread::sleep(Duration::from_micros(random.u64(0..1000)));
        let sent_ns = monotonic_ns();
        contestants[index].2(turn as u64);
        all[index].push((monotonic_ns() - sent_ns) as f64 * 1e-3);
    }
    let mut figures = Figures::of("latency_command");
    for ((name, title, _), micros) in contestants.iter().zip(&mut all) {
        micros.sort_by(f64::total_cmp);
        let [p50, p99, p999] = [0.5, 0.99, 0.999].map(|share| quantile(micros, share));
        println!("{title}: p50 {p50:.0}, p99 {p99:.0}, p99.9 {p999:.0} \u{b5}s from a command to its reply");
        for (percentile, value) in [("p50", p50), ("p99", p99), ("p999", p999)] {
            figures.set(&format!("{name}_{percentile}_us"), value);
        }
    }
    figures.set("ours_vs_bare_at_ticks_p50", quantile(&all[0], 0.5) / quantile(&all[1], 0.5));
    figures.write();
}

/// A bare server in a process of its own, and a client of it.
struct Answerer {
    // Dropped in this order: the client before its node, and the server last.
    client: Client<Service, u64, (), u64, ()>,
    _node: Node<Service>,
    process: Child,
    /// The server ends with it.
    stdin: Option<ChildStdin>,
    _domain: bare::Domain,
}

impl Answerer {
    fn start(habit: &str) -> Self {
        let domain = bare::Domain::new();
        let mut command = Command::new(std::env::current_exe().expect("this bench is a file"));
        let mut process = command
            .args([ANSWER, domain.place(), habit])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("this bench can be started again");
        let mut ready = BufReader::new(process.stdout.take().expect("stdout is piped"));
        ready.read_line(&mut String::new()).expect("the server prints a line");
        let stdin = process.stdin.take();
        let node = bare::node(Path::new(domain.place()));
        let client = commands(&node).client_builder().create().expect("the only client");
        Self { client, _node: node, process, stdin, _domain: domain }
    }

    /// Sends a request, and waits for its answer in a busy loop.
    fn ask(&self, number: u64) {
        let pending = self.client.send_copy(number).expect("the server is connected");
        let begun_ns = monotonic_ns();
        loop {
            if let Some(answer) = pending.receive().expect("the server's memory is readable") {
                assert_eq!(*answer.payload(), number, "an answer is that of its request");
                return;
            }
            assert!(monotonic_ns() - begun_ns < TIMEOUT.as_nanos() as u64, "no answer within {TIMEOUT:?}");
            thread::yield_now();
        }
    }
}

impl Drop for Answerer {
    fn drop(&mut self) {
        drop(self.stdin.take());
        assert!(self.process.wait().expect("a child can be waited for").success(), "the server ends in order");
    }
}

/// Answers requests until stdin ends.
pub(crate) fn answer(place: &str, habit: &str) {
    let node = bare::node(Path::new(place));
    let server = commands(&node).server_builder().create().expect("the only server");
    println!("answering");
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            // The end of stdin, with or without an error, ends the server.
            let _ = io::copy(&mut io::stdin(), &mut io::sink());
            is_over.store(true, Ordering::Relaxed);
        });
        sleep_precisely();
        let mut schedule = Schedule::new(monotonic_ns(), RATE_HZ);
        while !is_over.load(Ordering::Relaxed) {
            if habit == AT_TICKS {
                while !sleep_until(schedule.due_ns()) {}
                schedule.advance(monotonic_ns());
            } else {
                thread::yield_now();
            }
            while let Some(request) = server.receive().expect("the client's memory is readable") {
                request.send_copy(*request.payload()).expect("the client waits");
            }
        }
    });
}

fn commands(node: &Node<Service>) -> Commands {
    node.service_builder(&"commands".try_into().expect("a valid name"))
        .request_response::<u64, u64>()
        .open_or_create()
        .expect("both sides request the same settings")
}
