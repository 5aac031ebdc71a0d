//! The program's own clients on the far bus, unchanged.

use bench_dragon::recording::FrameReader;
use bench_dragon_ipc::{Alert, AlertKind, AlertSubscriber};
use serde_json::Value;
use test_support::eventually::eventually;

use super::bridges::Bridge;
use crate::reader::Reader;
use crate::stage::Stage;

#[test]
fn echo_hz_and_record_work_on_the_far_bus() {
    let (near, far) = (Stage::new(), Stage::new());
    // At this rate the bus keeps ten seconds for the near reader, which reads after the end of the far commands.
    let server = near.serve(&["--rate", "20", "--readers", "3"]);
    let sender = Bridge::sending(&near, &[]);
    let recorder = near.start(&["record", "near.mcap"]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let mut reader = Reader::join(&near);
    receiver.until("receiving");
    let far_recorder = far.start(&["record", "far.mcap", "--format", "json"]);
    let echoed = far.run(&["echo", "--count", "20", "--format", "json"]).expect_clean().json_lines();
    let hz = far.run(&["hz", "--seconds", "1", "--format", "json"]).expect_clean().last_json();
    assert_eq!((&hz["lost"], &hz["restarts"]), (&0.into(), &0.into()), "{hz}");
    let last = echoed.last().and_then(|line| line["tick"].as_u64()).expect("a tick");
    let shots = reader.read_to_tick(last);
    assert_eq!(echoed.len(), 20);
    for line in &echoed {
        let tick = line["tick"].as_u64().expect("a tick") as usize;
        assert_eq!(line["sim_time_ns"], shots[tick].header.show_time_ns);
        assert_eq!(line["head_travel_m"], shots[tick].header.head_travel_m);
    }
    let summary = far_recorder.terminate().expect_clean().last_json();
    assert_eq!(summary["lost"], 0, "{summary}");
    server.stop();
    receiver.stop();
    sender.stop();
    recorder.terminate();

    let frames = |stage: &Stage, name: &str| -> Vec<_> {
        let reader = FrameReader::open(&stage.path(name)).expect("a recording");
        reader.map(|frame| frame.expect("a readable frame")).collect()
    };
    let (original, copy) = (frames(&near, "near.mcap"), frames(&far, "far.mcap"));
    assert!(!copy.is_empty());
    for frame in &copy {
        let there = &original[frame.header.tick as usize];
        assert_eq!((there.header.tick, there.header.show_time_ns), (frame.header.tick, frame.header.show_time_ns));
        assert_eq!(there.handles, frame.handles);
    }
}

#[test]
fn monitors_on_both_sides_report_the_same_contact_and_the_far_bus_gets_both_alerts() {
    let (near, far) = (Stage::new(), Stage::new());
    // The show is nearly stopped until all processes have joined.
    let server = near.serve(&["--rate", "100", "--time-scale", "0.001"]);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let run_id = receiver.until("receiving")["run_id"].clone();
    let alerts = AlertSubscriber::open(far.domain(), "test").expect("the bridge has created the services");
    let mut reader = Reader::join(&far);
    let mut monitors = [&near, &far].map(|stage| stage.start(&["monitor", "--format", "json", "--progress", "0.05"]));
    for monitor in &mut monitors {
        monitor.json_until("the monitor has measured a clearance", |line| {
            line["type"] == "progress" && line["clearance_m"].is_number()
        });
    }
    near.run(&["ctl", "seek", "412.47"]).expect_clean();
    let is_contact = |line: &Value| line["kind"] == "contact";
    let [here, there] = monitors
        .each_mut()
        .map(|monitor| monitor.json_until("the monitor reports a contact", is_contact).pop().expect("a contact"));
    for value in ["time_s", "benches", "point_m", "clearance_m"] {
        assert_eq!(here[value], there[value], "{value}");
    }
    // The far bus gets two alerts: from the monitor there, and from the near monitor through the bridge.
    let contact = || alerts.receive().expect("the bus is readable").filter(|alert| kind(alert) == AlertKind::Contact);
    for _ in 0..2 {
        let alert = eventually("an alert of the contact", contact);
        assert_eq!((run_id.as_u64(), there["tick"].as_u64()), (Some(alert.run_id), Some(alert.tick)));
        assert_eq!(there["time_s"], alert.show_time_ns as f64 * 1e-9);
    }
    let at_contact = reader.read_to_tick(there["tick"].as_u64().expect("a tick"));
    assert!(
        at_contact.last().expect("at least one frame").header.show_time_s()
            >= there["time_s"].as_f64().expect("a time")
    );
    for monitor in monitors {
        monitor.terminate().expect_clean();
    }
    server.stop();
    let received = receiver.stop();
    assert!(received["alerts"].as_u64() >= Some(1), "{received}");
    sender.stop();
}

fn kind(alert: &Alert) -> AlertKind {
    alert.alert_kind().expect("a kind that this version knows")
}
