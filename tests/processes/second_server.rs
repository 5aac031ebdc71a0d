//! An instance has one server.

use std::process::Command;

use test_support::process::Process;
use test_support::skip::is_possible;

use crate::reader::{Reader, assert_accounted_for};
use crate::stage::Stage;

#[test]
fn a_second_server_is_refused_with_the_pid_of_the_first() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let mut reader = Reader::join(&stage);
    let before = reader.next();

    let refused = stage.run(&["serve"]);
    let instance = stage.domain().instance();
    let expected = format!(
        "error: a server already runs on instance \"{instance}\", pid {}: stop it, or choose another --instance\n",
        server.process.pid()
    );
    assert_eq!((refused.code(), refused.stderr, refused.stdout), (Some(1), expected, String::new()));

    let mut shots = vec![before];
    shots.extend(reader.read_to_tick(shots[0].header.tick + 20));
    assert_accounted_for(&shots, reader.lost());
    drop(reader);
    server.stop();
}

#[test]
fn a_second_server_or_guard_in_another_pid_namespace_names_no_process_of_that_namespace() {
    let launcher = ["unshare", "--pid", "--fork", "--mount-proc"];
    if !is_possible(&launcher) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--guarded"]);
    let guard = stage.start(&["monitor", "--guard"]);
    Reader::join(&stage).read_until("the guard lets the head walk", |header| header.head_travel_m > 0.0);
    let instance = stage.domain().instance();
    let unseen = format!(
        "already runs on instance \"{instance}\", where this process cannot see it, perhaps in another container"
    );
    let cases: [(&[&str], String); 2] = [
        (&["serve"], format!("error: a server {unseen}: stop it there, or choose another --instance\n")),
        (&["monitor", "--guard"], format!("error: a guard {unseen}: stop it there first\n")),
    ];
    for (args, expected) in cases {
        let elsewhere = stage.command(args);
        let mut command = Command::new(launcher[0]);
        command.args(&launcher[1..]).arg(elsewhere.get_program()).args(elsewhere.get_args());
        let refused = Process::start(command).end();
        assert_eq!((refused.code(), refused.stderr), (Some(1), expected));
    }
    guard.terminate().expect_clean();
    server.stop();
}

#[test]
fn servers_on_two_instances_run_side_by_side() {
    let (first, second) = (Stage::new(), Stage::new());
    let servers = [first.serve(&[]), second.serve(&[])];
    for (stage, server) in [&first, &second].into_iter().zip(&servers) {
        assert_eq!(Reader::join(stage).next().header.run_id, server.run_id);
    }
    for server in servers {
        server.stop();
    }
}
