//! The metrics of a show as a scraper reads them. `tests/python/test_metrics.py` reads them with a stock client.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::net::SocketAddr;

use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::eventually::{eventually, eventually_from};
use test_support::process::{Ended, Process};
use test_support::pytest;

use crate::http::{Reply, ask, get};
use crate::reader::Reader;
use crate::stage::Stage;

/// A show in which benches come near, touch and part within three seconds after it is resumed. A reader that does not read
/// loses some of its frames.
const SHOW: [&str; 9] = ["--rate", "200", "--start-at", "410", "--until", "413", "--readers", "4", "--paused"];

/// A running exporter.
pub(crate) struct Exporter {
    process: Process,
    address: SocketAddr,
}

impl Exporter {
    pub(crate) fn start(stage: &Stage) -> Self {
        let mut process = stage.start(&["metrics", "--listen", "127.0.0.1:0", "--format", "json"]);
        let listening = process.json();
        assert_eq!(listening["type"], "listening");
        let address = listening["address"].as_str().and_then(|address| address.parse().ok()).expect("an address");
        assert_eq!(listening["url"], format!("http://{address}/metrics"));
        Self { process, address }
    }

    pub(crate) fn scrape(&self) -> String {
        get(self.address, "/metrics").body
    }

    pub(crate) fn stop(self) {
        self.process.terminate().expect_clean();
    }

    /// Returns the first scrape with samples of all these metrics.
    fn scrape_with(&self, names: &[&str]) -> String {
        let has = |text: &str, name: &str| text.lines().any(|line| line.starts_with(&format!("bench_dragon_{name}")));
        eventually_from(&format!("there are samples of {names:?}"), || {
            let text = self.scrape();
            if names.iter().all(|name| has(&text, name)) { Ok(text) } else { Err(text) }
        })
    }
}

fn assert_refused(reply: &Reply, status: u16) {
    assert_eq!(reply.status, status, "{reply:?}");
    assert_eq!(reply.body.lines().count(), 1, "{reply:?}");
}

#[test]
fn a_stock_client_reads_the_values_that_the_processes_of_a_finished_show_report() {
    let stage = Stage::new();
    let exporter = Exporter::start(&stage);
    let monitor = stage.start_waiting(&["monitor", "--format", "json"]);
    let recorder = stage.start_waiting(&["record", "a.mcap", "--format", "json"]);
    let server = stage.serve(&SHOW);
    let mut slow = Reader::join(&stage);
    slow.next();
    let during =
        exporter.scrape_with(&["forecast_contact_time", "clearance_meters", "reader_frames_total{reader=\"record"]);
    stage.run(&["ctl", "resume"]).expect_clean();
    let served = server.summary();
    slow.read_unread();
    let lost_by_slow = slow.lost();
    assert!(lost_by_slow > 0, "six hundred frames are more than a reader's buffer holds");
    drop(slow);
    let recorded = recorder.terminate().expect_clean().last_json();
    let monitored = monitor.terminate().expect_clean();
    let watched = monitored.last_json();
    fs::write(stage.path("during.prom"), during).expect("a file");
    let free = scrape_of_guarded_show(&["--config", "turn.toml"], "forecast_free_time");
    fs::write(stage.path("guarded.prom"), free).expect("a file");
    let stopped = scrape_of_guarded_show(&["--start-at", "300"], "forecast_guard_stop_wall");
    fs::write(stage.path("stopped.prom"), stopped).expect("a file");
    let loose =
        scrape_of_guarded_show(&["--config", "loose.toml", "--start-at", "300"], "forecast_possible_contact_time");
    fs::write(stage.path("loose.prom"), loose).expect("a file");
    let expected = json!({
        "run_id": served["run_id"],
        "ticks": served["frames"],
        "overruns": served["overruns"],
        "show_time": served["sim_time_s"],
        "alerts": alerts_by_kind(&monitored),
        "lost": { "test": lost_by_slow, "record": recorded["lost"], "monitor": watched["lost"] },
        "read": { "record": recorded["frames"], "monitor": watched["frames"] },
        "bytes": { "record": recorded["bytes"] },
    });
    fs::write(stage.path("expected.json"), expected.to_string()).expect("a file");
    let url = format!("http://{}/metrics", exporter.address);
    let variables =
        [("BENCH_DRAGON_METRICS", OsStr::new(&url)), ("BENCH_DRAGON_METRICS_FOLDER", stage.path(".").as_os_str())]
            .map(|(name, value)| (name, value.to_owned()));
    pytest::run("test_metrics.py", &variables.each_ref().map(|(name, value)| (*name, value.as_os_str())));
    exporter.process.terminate().expect_clean();
}

/// Returns a scrape of a guarded show, with samples of a forecast. `turn.toml` is a show without contact, `loose.toml` one with loose
/// hinges.
fn scrape_of_guarded_show(args: &[&str], forecast: &str) -> String {
    let stage = Stage::new();
    fs::write(stage.path("turn.toml"), "[route]\nkind = \"turnaround\"\n").expect("a file");
    let loose = "[dragon]\npole_diameter_m = 0.05\n[monitor]\nmargin_m = 0.01\n";
    fs::write(stage.path("loose.toml"), loose).expect("a file");
    let server = stage.serve(&[args, &["--guarded", "--rate", "50"]].concat());
    let guard = stage.start(&["monitor", "--guard", "--format", "json"]);
    let exporter = Exporter::start(&stage);
    let scrape = exporter.scrape_with(&[forecast, "guard_granted_travel", "tick_duration_seconds_count"]);
    for process in [exporter.process, guard] {
        process.terminate().expect_clean();
    }
    server.stop();
    scrape
}

fn alerts_by_kind(monitored: &Ended) -> BTreeMap<String, u64> {
    let lines = monitored.json_lines();
    let kinds = lines.iter().filter(|line| line["type"] == "alert").filter_map(|line| line["kind"].as_str());
    let mut counts = BTreeMap::new();
    for kind in kinds {
        *counts.entry(kind.to_owned()).or_default() += 1;
    }
    assert!(counts.contains_key("contact"), "{counts:?}");
    counts
}

#[test]
fn a_scraper_sees_the_end_and_the_restart_of_a_server() {
    let stage = Stage::new();
    let exporter = Exporter::start(&stage);
    let holds = |scrape: &str, line: &str| scrape.lines().any(|told| told == line);
    let until = |line: &str| {
        eventually_from(&format!("a scrape has {line:?}"), || {
            let scrape = exporter.scrape();
            if holds(&scrape, line) { Ok(()) } else { Err(scrape) }
        });
    };
    assert!(holds(&exporter.scrape(), "bench_dragon_up 0"), "no server runs yet");
    let first = stage.serve(&["--rate", "50"]);
    until("bench_dragon_up 1");
    first.stop();
    until("bench_dragon_up 0");
    let second = stage.serve(&["--rate", "50"]);
    until("bench_dragon_up 1");
    until("bench_dragon_source_restarts_total 1");
    let info =
        format!("bench_dragon_run_info{{version=\"{}\",run_id=\"{}\"}} 1", env!("CARGO_PKG_VERSION"), second.run_id);
    until(&info);
    second.process.signal(Signal::STOP);
    until("bench_dragon_up 0");
    second.process.signal(Signal::CONT);
    until("bench_dragon_up 1");
    exporter.process.signal(Signal::INT);
    exporter.process.end().expect_clean();
    second.stop();
}

#[test]
fn other_paths_and_pages_of_other_origins_are_refused() {
    let stage = Stage::new();
    let mut process = stage.start(&["metrics", "--listen", "127.0.0.1:0", "--allow-host", "booth.example"]);
    let told = process.next_line().expect("where it listens");
    let address = told.strip_prefix("listening on http://").and_then(|rest| rest.strip_suffix("/metrics"));
    let address: SocketAddr = address.and_then(|address| address.parse().ok()).unwrap_or_else(|| panic!("{told}"));
    let metrics = get(address, "/metrics");
    assert_eq!(metrics.status, 200);
    assert!(metrics.head.contains("content-type: text/plain; version=0.0.4"), "{}", metrics.head);
    let front = get(address, "/");
    assert_eq!((front.status, front.body.as_str()), (200, "The metrics are at /metrics\n"));
    assert_refused(&get(address, "/page"), 404);
    assert_refused(&ask(address, "POST", "/metrics", &format!("Host: {address}\r\nContent-Length: 0\r\n")), 405);
    assert_refused(&ask(address, "GET", "/metrics", "Host: evil.example\r\n"), 403);
    let foreign = format!("Host: {address}\r\nOrigin: http://evil.example\r\n");
    assert_refused(&ask(address, "GET", "/metrics", &foreign), 403);
    assert_eq!(ask(address, "GET", "/metrics", "Host: booth.example:9223\r\n").status, 200);
    let taken = stage.run(&["metrics", "--listen", &address.to_string()]);
    assert_eq!((taken.code(), taken.stderr.lines().count()), (Some(1), 1), "{}", taken.stderr);
    assert!(taken.stderr.starts_with(&format!("error: cannot listen on {address}: ")), "{}", taken.stderr);
    let bad = stage.run(&["metrics", "--listen", "9223"]);
    assert_eq!((bad.code(), bad.stderr.lines().count()), (Some(2), 1), "{}", bad.stderr);
    process.terminate().expect_clean();
}

#[test]
fn a_view_serves_the_same_metrics() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let mut view = stage.start(&["view", "--listen", "127.0.0.1:0", "--format", "json"]);
    let listening: Value = view.json();
    let address = listening["address"].as_str().and_then(|address| address.parse().ok()).expect("an address");
    eventually("the view reports that the source is up", || {
        get(address, "/metrics").body.contains("\nbench_dragon_up 1\n").then_some(())
    });
    let names = |text: &str| -> Vec<String> {
        text.lines().filter_map(|line| Some(line.strip_prefix("# TYPE ")?.to_owned())).collect()
    };
    let exporter = Exporter::start(&stage);
    let settled = ["forecast_contact_time", "tick_lateness", "reader_frames_total{reader=\"metrics"];
    let wanted = names(&exporter.scrape_with(&settled));
    eventually("the view has the metrics of the exporter", || {
        (names(&get(address, "/metrics").body) == wanted).then_some(())
    });
    for process in [exporter.process, view] {
        process.terminate().expect_clean();
    }
    server.stop();
}
