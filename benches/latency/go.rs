//! Latency of GO: from the instant at which it is sent until a reader on the bus has the first moving frame.
//!
//! The server plays at 1 kHz a plan that waits. Each turn seeks the wait, sends GO, and seeks it again. GO comes from a client of the bus
//! (as `ctl` sends it), from the page by HTTP and by its stream, and as a packet of Open Sound Control to `bridge osc`. They take
//! turns. GO comes at any instant of a period, so the server's own share is from nearly nothing to a period. *Ticks* count from
//! the tick from which the server has accepted GO to that of the first moving frame.

use std::any::Any;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{TcpStream, UdpSocket};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::{CommandClient, CommandEventReader, Domain, FrameSubscriber, Request, ShowState};

use crate::shared::{self, Figures, Program, quantile};

/// First argument of a bench that measures this alone.
pub(crate) const GO: &str = "go";
/// Turns of each contestant.
const TURNS: usize = 120;
const RATE_HZ: &str = "1000";
/// Time in which two GOs are one, and some more.
const APART: Duration = Duration::from_millis(320);
const TIMEOUT: Duration = Duration::from_secs(10);
/// Show time of the cue that waits.
const WAIT_S: f64 = 10.0;
const PLAN: &str =
    "cues = [{ name = \"gate\", at_s = 10, wait = true }]\n[dragon]\nbenches = 223\n[head]\naccel_mps2 = 0.5\n";

/// A change on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Seen {
    Waits,
    Moves { tick: u64, read_ns: u64 },
}

/// A way to send GO.
struct Contestant {
    name: &'static str,
    title: &'static str,
    /// Connects, as far as its user is connected before GO.
    prepare: Box<dyn Fn() -> SendGo>,
}

/// Sends GO. Returns the connection, which is closed after the turn. The client of the bus returns when it has the reply.
type SendGo = Box<dyn FnOnce() -> Box<dyn Any>>;

/// Plays all turns, writes the figures of the bench `latency_go`, and prints them.
pub(crate) fn measure() {
    let domain = shared::domain(&format!("latency-go-{}", std::process::id()));
    let plan = tempfile::Builder::new().suffix(".toml").tempfile().expect("a file");
    fs::write(plan.path(), PLAN).expect("a file can be written");
    let config = plan.path().to_str().expect("temporary folders have plain names");
    let mut server = Program::start(&domain, &["serve", "--rate", RATE_HZ, "--config", config]);
    server.until("started");
    let mut view = Program::start(&domain, &["view", "--listen", "127.0.0.1:0"]);
    let mut bridge =
        Program::start(&domain, &["bridge", "osc", "--listen", "127.0.0.1:0", "--allow", "127.0.0.1", "--full"]);
    let page = view.line();
    let listening = bridge.line();
    let contestants = contestants(&domain, &page, &listening);
    let client = CommandClient::open(&domain, "bench").expect("the server runs");
    let events = CommandEventReader::open(&domain, "bench").expect("the server runs");
    let watch = Watch::begin(&domain);
    let seen = &watch.seen;
    let mut all: Vec<(Vec<f64>, Vec<f64>)> = vec![(Vec::new(), Vec::new()); contestants.len()];
    for turn in 0..TURNS * contestants.len() {
        let index = (turn + turn / contestants.len()) % contestants.len();
        client.call(Request::Seek { show_time_s: WAIT_S }, TIMEOUT).expect("a seek to the wait");
        while seen.recv_timeout(TIMEOUT).expect("the show waits") != Seen::Waits {}
        while events.receive().expect("the bus is readable").is_some() {}
        let send = (contestants[index].prepare)();
        let sent_ns = monotonic_ns();
        let _connection = send();
        let Seen::Moves { tick, read_ns } = seen.recv_timeout(TIMEOUT).expect("GO moves the show") else {
            panic!("the show waits already")
        };
        let accepted = accepted_tick(&events);
        all[index].0.push((read_ns - sent_ns) as f64 * 1e-3);
        all[index].1.push(tick as f64 - accepted as f64);
        thread::sleep(APART);
    }
    report(&contestants, &mut all);
}

/// The tick from which the server has accepted GO.
fn accepted_tick(events: &CommandEventReader) -> u64 {
    let begun = Instant::now();
    while begun.elapsed() < TIMEOUT {
        match events.receive().expect("the bus is readable") {
            Some(event) if event.request() == Some(Request::Go) => {
                event.outcome().expect("GO is accepted where the show waits");
                return event.tick;
            }
            Some(_) => {}
            None => thread::yield_now(),
        }
    }
    panic!("the server has reported no GO within {TIMEOUT:?}")
}

/// A thread that reads the bus. It leaves the bus before this value is gone, so that the bench leaves nothing behind.
struct Watch {
    /// The changes.
    seen: Receiver<Seen>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    fn begin(domain: &Domain) -> Self {
        let (sender, seen) = mpsc::channel();
        let (domain, is_over) = (domain.clone(), Arc::<AtomicBool>::default());
        let over = Arc::clone(&is_over);
        Self { seen, is_over, thread: Some(thread::spawn(move || look(&domain, &sender, &over))) }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.is_over.store(true, Relaxed);
        // A panic of the thread has been printed, and ended the turns.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn look(domain: &Domain, seen: &Sender<Seen>, is_over: &AtomicBool) {
    let mut frames = FrameSubscriber::open(domain, "bench").expect("the server runs");
    let mut waits = false;
    while !is_over.load(Relaxed) {
        let Ok(frame) = frames.receive() else { return };
        let Some(frame) = frame else {
            thread::yield_now();
            continue;
        };
        let header = frame.header();
        let read_ns = monotonic_ns();
        let is_waiting = header.show_state() == Some(ShowState::Waiting);
        let moves = waits && !is_waiting;
        if moves {
            assert!(header.head_speed_mps > 0.0, "the first frame after a wait moves: {header:?}");
        }
        let change = match (waits, is_waiting) {
            (false, true) => Seen::Waits,
            (true, false) => Seen::Moves { tick: header.tick, read_ns },
            _ => continue,
        };
        waits = is_waiting;
        if seen.send(change).is_err() {
            return;
        }
    }
}

fn contestants(domain: &Domain, page: &serde_json::Value, listening: &serde_json::Value) -> [Contestant; 4] {
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    let address = text(&page["address"]);
    let token = text(&page["url"]).split_once("#token=").expect("the page has a token").1.to_owned();
    let client = Rc::new(CommandClient::open(domain, "bench-go").expect("the server runs"));
    let bus = move || {
        let client = Rc::clone(&client);
        let send = move || Box::new(client.call(Request::Go, TIMEOUT).expect("GO is accepted")) as Box<dyn Any>;
        Box::new(send) as SendGo
    };
    let body = r#"{"command":"go"}"#;
    let post = format!(
        "POST /command HTTP/1.1\r\nHost: {address}\r\nX-Bench-Dragon-Token: {token}\r\nContent-Type: application/json\r\n\
         Content-Length: {}\r\n\r\n{body}",
        body.len()
    );
    let to = address.clone();
    let http = move || sending(connect(&to), post.clone().into_bytes());
    // A text of a client, whose mask changes nothing.
    let message = [&[0x81, 0x80 | body.len() as u8, 0, 0, 0, 0], body.as_bytes()].concat();
    let stream = move || sending(page_stream(&address, &token), message.clone());
    let listener = text(&listening["listen"]);
    let osc = move || {
        let desk = UdpSocket::bind("127.0.0.1:0").expect("a port");
        desk.connect(&listener).expect("an address");
        let send = move || {
            desk.send(b"/dragon/go\0\0,\0\0\0").expect("loopback takes it");
            Box::new(desk) as Box<dyn Any>
        };
        Box::new(send) as SendGo
    };
    [
        Contestant { name: "bus", title: "client of the bus", prepare: Box::new(bus) },
        Contestant { name: "http", title: "page, HTTP", prepare: Box::new(http) },
        Contestant { name: "stream", title: "page, stream", prepare: Box::new(stream) },
        Contestant { name: "osc", title: "OSC packet", prepare: Box::new(osc) },
    ]
}

fn sending(mut stream: TcpStream, bytes: Vec<u8>) -> SendGo {
    Box::new(move || {
        stream.write_all(&bytes).expect("the view reads");
        Box::new(stream)
    })
}

fn connect(address: &str) -> TcpStream {
    let stream = TcpStream::connect(address).expect("the view listens");
    stream.set_nodelay(true).expect("a socket");
    stream.set_read_timeout(Some(TIMEOUT)).expect("a timeout");
    stream
}

/// Opens a stream as a page does.
fn page_stream(address: &str, token: &str) -> TcpStream {
    let mut stream = connect(address);
    // The example key of RFC 6455.
    let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: bench-dragon.view.v1, ";
    write!(stream, "GET /stream HTTP/1.1\r\nHost: {address}\r\n{upgrade}bench-dragon.token.{token}\r\n\r\n")
        .expect("the view reads");
    let mut status = [0; 13];
    stream.read_exact(&mut status).expect("a reply");
    assert_eq!(&status, b"HTTP/1.1 101 ", "{}", String::from_utf8_lossy(&status));
    stream
}

fn report(contestants: &[Contestant], all: &mut [(Vec<f64>, Vec<f64>)]) {
    let mut figures = Figures::of("latency_go");
    for (Contestant { name, title, .. }, (micros, ticks)) in contestants.iter().zip(all) {
        micros.sort_by(f64::total_cmp);
        ticks.sort_by(f64::total_cmp);
        let [p50, p99] = [0.5, 0.99].map(|share| quantile(micros, share));
        let most_ticks = ticks[ticks.len() - 1];
        assert!(most_ticks <= 2.0, "{name}: GO took {most_ticks} ticks");
        println!("{title}: p50 {p50:.0}, p99 {p99:.0} µs; at most {most_ticks} ticks after the accepted one");
        figures.set(&format!("{name}_p50_us"), p50);
        figures.set(&format!("{name}_p99_us"), p99);
        figures.set(&format!("{name}_most_ticks"), most_ticks);
    }
    figures.write();
}
