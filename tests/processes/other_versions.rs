//! A bus of another version of the program, and recordings of one: every command reports the mismatch and the remedy.

use std::path::Path;

use bench_dragon::recording::{Recorder, RecorderSettings};
use bench_dragon_ipc::service::{COMMANDS, FRAMES, Member, Role};
use bench_dragon_ipc::{Domain, FrameHeader, HandleState};
use iceoryx2::prelude::{Node, NodeBuilder, ServiceName, SignalHandlingMode, ZeroCopySend, ipc};

use crate::stage::Stage;

/// A handle of a later version.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("bench_dragon.HandleState.v2")]
struct OtherHandle {
    position_m: [f64; 3],
    heading: [f64; 4],
}

/// A command of a later version.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("bench_dragon.Command.v3")]
struct OtherCommand {
    kind: u64,
}

fn node(domain: &Domain) -> Node<ipc::Service> {
    let builder = NodeBuilder::new().config(&domain.iceoryx2_config());
    builder.signal_handling_mode(SignalHandlingMode::Disabled).create().expect("the node can be created")
}

fn name(service: &str) -> ServiceName {
    ServiceName::new(service).expect("a valid name")
}

fn mismatch(service: &str) -> String {
    format!(
        "error: {service} has another layout than this program's: run the same version of bench-dragon on both sides\n"
    )
}

#[test]
fn frames_of_another_layout_are_reported_by_every_reader_and_by_a_source() {
    let stage = Stage::new();
    let member = Member::join(stage.domain(), "other", Role::Source { handle_count: 2 }).expect("a member");
    let node = node(stage.domain());
    let frames = node.service_builder(&name(FRAMES)).publish_subscribe::<[OtherHandle]>();
    let frames = frames.user_header::<FrameHeader>().create().expect("the service can be created");
    // All other services are those of this version.
    let description = member.description().expect("the service can be created");
    let alerts = (member.alerts().expect("the service"), member.alert_events().expect("the service"));
    for command in [&["monitor"][..], &["record", "a.mcap"], &["echo"], &["hz"], &["latency"], &["serve"]] {
        let ended = stage.run(command);
        assert_eq!((ended.code(), ended.stderr), (Some(1), mismatch(FRAMES)), "{command:?}");
    }
    drop((alerts, description, frames, node, member));
}

#[test]
fn commands_of_another_layout_are_reported_by_ctl() {
    let stage = Stage::new();
    let member = Member::join(stage.domain(), "other", Role::Source { handle_count: 2 }).expect("a member");
    let node = node(stage.domain());
    let commands = node.service_builder(&name(COMMANDS)).request_response::<OtherCommand, u64>();
    let commands = commands.create().expect("the service can be created");
    for order in [&["ctl", "hold"][..], &["ctl", "stop"]] {
        let ended = stage.run(order);
        assert_eq!((ended.code(), ended.stderr), (Some(1), mismatch(COMMANDS)), "{order:?}");
    }
    drop((commands, node, member));
}

/// Records one frame of a dragon with one bench, with this description.
fn write_recording(path: &Path, toml: &str) {
    let mut recorder = Recorder::start(RecorderSettings::new(path, 0)).expect("a recorder");
    let header = FrameHeader { run_id: 7, bench_count: 1, ..Default::default() }.of_one_dragon();
    recorder.describe(7, toml).expect("the configuration");
    recorder.frame(&header, &[HandleState::default(); 2]).expect("a frame");
    recorder.finish().expect("a finished recording");
}

#[test]
fn an_unreadable_description_or_one_of_another_dragon_is_reported() {
    let stage = Stage::new();
    for (toml, code, error) in [
        (
            "[dragon]\nbenches = 1\nlegs = 4\n",
            2,
            "error: the description on the bus: line 3, `legs = 4`: unknown field `legs`",
        ),
        ("[dragon]\nbenches = 2\n", 1, "error: the description on the bus has 2 benches, the frames have 1"),
    ] {
        let name = format!("{code}.mcap");
        write_recording(&stage.path(&name), toml);
        let mut replay = stage.start(&["replay", &name, "--readers", "1", "--format", "json"]);
        assert_eq!(replay.json()["type"], "started");
        let monitor = stage.run(&["monitor"]);
        assert_eq!((monitor.code(), monitor.stderr.lines().count()), (Some(code), 1), "{}", monitor.stderr);
        assert!(monitor.stderr.starts_with(error), "{}", monitor.stderr);
        replay.end().expect_clean();
    }
}
