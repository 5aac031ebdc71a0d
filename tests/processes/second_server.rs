//! An instance has one server.

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
