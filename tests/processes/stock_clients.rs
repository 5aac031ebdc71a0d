//! `docs/reference/stock-iceoryx2.md`: its program reads a show to its end, and its tables of services and limits are those of the bus.

use std::fs;
use std::path::Path;

use bench_dragon_ipc::service::{
    ALERTS, COMMAND_EVENT_BUFFER, COMMAND_EVENTS, COMMANDS, DESCRIPTION, FRAMES, MAX_ACTIVE_REQUESTS,
    MAX_BORROWED_FRAMES, MAX_READERS, OPERATOR_READERS, READERS, REPLAY, STATUS, frame_buffer,
};
use bench_dragon_ipc::{
    Alert, Command, CommandEvent, CommandReply, FrameHeader, HandleState, ReaderReport, ReplayStatus, Status, clear,
};
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};
use rustix::process::Signal;
use test_support::process::Process;
use test_support::pytest::python;

use crate::stage::Stage;

const PROGRAM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/stock_head.py");

fn text(path: impl AsRef<Path>) -> String {
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.as_ref().display()))
}

fn page() -> String {
    text(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/stock-iceoryx2.md"))
}

/// Returns the cells of a page's table rows after a heading, up to the next heading.
fn rows<'a>(page: &'a str, heading: &str) -> Vec<Vec<&'a str>> {
    let (_, section) = page.split_once(&format!("\n{heading}\n")).unwrap_or_else(|| panic!("there is no {heading}"));
    let section = section.split("\n#").next().expect("a section has a beginning");
    let rows = section.lines().filter_map(|line| line.strip_prefix('|')?.strip_suffix('|'));
    rows.map(|row| row.split('|').map(str::trim).collect()).collect()
}

fn detail<T: ZeroCopySend>() -> TypeDetail {
    TypeDetail::new::<T>(TypeVariant::FixedSize)
}

#[test]
fn the_stock_program_reads_a_show_to_its_end() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let mut client = python();
    client.arg(PROGRAM).arg(stage.domain().root().join("iceoryx2.toml"));
    let mut client = Process::start(client);
    let first = client.next_line().expect("a line for a frame");
    let words: Vec<&str> = first.split(' ').collect();
    let position: Vec<f64> = words[4..].iter().map(|word| word.parse().expect("a coordinate")).collect();
    let [x_m, y_m, z_m] = position[..] else { panic!("{first}") };
    // The paper's dragon begins on its spiral, 8.8 m from the centre.
    assert!(x_m.hypot(y_m) < 8.801 && z_m == 0.0, "{first}");
    assert!(client.next_line().is_some() && client.next_line().is_some());
    server.stop();
    client.end().expect_clean();
    // The server may end before the client, whose node then keeps the instance.
    clear(stage.domain()).expect("an instance without processes");
}

#[test]
fn the_stock_program_waits_for_a_server_and_ends_cleanly_by_a_signal() {
    for signal in [Signal::TERM, Signal::INT] {
        let stage = Stage::new();
        let config = stage.path("iceoryx2.toml");
        fs::write(&config, stage.run(&["iox2-config"]).expect_clean().stdout).expect("a file");
        let mut client = python();
        client.arg(PROGRAM).arg(config);
        let mut client = Process::start(client);
        assert_eq!(client.complaint(), "waiting: no server runs, start one with `bench-dragon serve`");
        let server = stage.serve(&["--rate", "20"]);
        assert!(client.next_line().is_some() && client.next_line().is_some());
        client.signal(signal);
        let ended = client.end();
        assert_eq!((ended.code(), ended.stderr.as_str()), (Some(0), ""));
        server.stop();
        clear(stage.domain()).expect("an instance without processes");
    }
}

#[test]
fn the_page_shows_the_program() {
    let program = text(PROGRAM);
    assert!(page().contains(&format!("```python\n{program}```\n")), "the page has the program as it is");
    assert_eq!(program.lines().filter(|line| !line.is_empty()).count(), 37, "the page states its length");
    let ours = program.lines().filter(|line| line.contains("import") && line.contains("bench_dragon"));
    assert_eq!(ours.count(), 0, "the program needs nothing of ours");
}

#[test]
fn the_page_has_every_service_of_the_bus() {
    let name = |detail: &TypeDetail| format!("`{}`", detail.type_name());
    let single = |payload: TypeDetail| (name(&payload), String::new());
    let slice = |payload: TypeDetail, header: TypeDetail| (name(&payload), name(&header));
    let mut on_bus: Vec<(&str, (String, String))> = vec![
        (FRAMES, slice(detail::<HandleState>(), detail::<FrameHeader>())),
        (DESCRIPTION, slice(detail::<u8>(), detail::<u64>())),
        (STATUS, single(detail::<Status>())),
        (ALERTS, single(detail::<Alert>())),
        (READERS, single(detail::<ReaderReport>())),
        (COMMAND_EVENTS, single(detail::<CommandEvent>())),
        (REPLAY, single(detail::<ReplayStatus>())),
    ];
    let exchange = [detail::<Command>(), detail::<CommandReply>()].map(|detail| name(&detail)).join(" to ");
    on_bus.push((COMMANDS, (exchange, String::new())));
    let page = page();
    let rows: Vec<_> =
        rows(&page, "## Services").into_iter().filter(|row| row.len() == 4 && row[1] != "event").collect();
    let on_page: Vec<_> =
        rows[2..].iter().map(|row| (row[0].trim_matches('`'), (row[2].to_owned(), row[3].to_owned()))).collect();
    assert_eq!(on_page, on_bus);
}

#[test]
fn the_page_has_the_limits_of_the_bus() {
    let page = page();
    let rows: Vec<_> = rows(&page, "## Services").into_iter().filter(|row| row.len() == 8).collect();
    let find =
        |name: &str| &rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("there is no {name}"))[1..];
    let places = format!("{MAX_READERS} + {OPERATOR_READERS}");
    assert_eq!(find("clients at a time"), [places.as_str(); 7]);
    let frames = [138, 139, 223, 100_000].map(|benches| frame_buffer(benches + 1));
    let unread = find("unread messages of a client");
    assert_eq!(unread[0], format!("{} to 138 benches, {} for 223, {} for 100,000", frames[0], frames[2], frames[3]));
    assert!(frames[0] > frames[1], "{frames:?}");
    assert_eq!(unread[5], COMMAND_EVENT_BUFFER.to_string());
    let held = find("messages held at a time");
    assert_eq!([held[0], held[3]], [MAX_BORROWED_FRAMES.to_string().as_str(); 2]);
    assert_eq!(held[6], format!("{MAX_ACTIVE_REQUESTS} requests in flight"));
}
