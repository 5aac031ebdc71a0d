//! The connections between bridges, and their access control.

use std::fs;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::Command;

use rustix::net::sockopt::set_socket_reuseaddr;
use rustix::net::{AddressFamily, SocketType, bind, getsockname, socket};
use test_support::process::Process;
use test_support::skip::has_programs;

use super::bridges::{ANY_PORT, Bridge};
use crate::reader::Reader;
use crate::stage::Stage;

/// Creates an authority, and certificates of both sides, in a folder.
fn make_certificates(folder: &Path) {
    let openssl = |line: &str| {
        let mut command = Command::new("openssl");
        command.args(line.split_whitespace()).current_dir(folder);
        let ended = Process::start(command).end();
        assert!(ended.status.success(), "{line}: {}", ended.stderr);
    };
    let key = "req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";
    openssl(&format!("{key} -x509 -days 2 -subj /CN=authority -keyout ca.key -out ca.pem"));
    fs::write(folder.join("names"), "subjectAltName=DNS:localhost,IP:127.0.0.1\n").expect("a file");
    for side in ["near", "far"] {
        openssl(&format!("{key} -subj /CN={side} -keyout {side}.key -out {side}.csr"));
        let signed =
            format!("x509 -req -days 2 -in {side}.csr -CA ca.pem -CAkey ca.key -extfile names -out {side}.pem");
        openssl(&signed);
    }
}

/// Returns an endpoint to which a bridge can connect before another bridge listens there. The socket reserves the port. A
/// listener can bind it too, since both allow the reuse of the address. No process listens there before.
fn reserved_endpoint() -> (OwnedFd, String) {
    let socket = socket(AddressFamily::INET, SocketType::STREAM, None).expect("a socket");
    set_socket_reuseaddr(&socket, true).expect("an option");
    bind(&socket, &SocketAddr::from((Ipv4Addr::LOCALHOST, 0))).expect("a port");
    let address = getsockname(&socket).expect("a bound socket has an address");
    let address = SocketAddr::try_from(address).expect("the address is an IPv4 address");
    (socket, format!("tcp/{address}"))
}

#[test]
fn tls_of_zenohs_configuration_admits_only_certified_peers() {
    if !has_programs(&["openssl"]) {
        return;
    }
    let (near, far) = (Stage::new(), Stage::new());
    let folder = near.path("");
    make_certificates(&folder);
    let write = |name: &str, tls: String| {
        let text = format!("{{ // zenoh's own\n transport: {{ link: {{ tls: {{ {tls} }} }} }} }}");
        fs::write(folder.join(name), text).expect("a file");
        folder.join(name).display().to_string()
    };
    let path = |name: &str| folder.join(name).display().to_string();
    let (ca, near_key, near_pem) = (path("ca.pem"), path("near.key"), path("near.pem"));
    let (far_key, far_pem) = (path("far.key"), path("far.pem"));
    let listening = write(
        "near.json5",
        format!(
            "root_ca_certificate: '{ca}', listen_private_key: '{near_key}', listen_certificate: '{near_pem}', \
             enable_mtls: true"
        ),
    );
    let connecting = write(
        "far.json5",
        format!(
            "root_ca_certificate: '{ca}', connect_private_key: '{far_key}', connect_certificate: '{far_pem}', \
             enable_mtls: true"
        ),
    );
    let nameless = write("nameless.json5", format!("root_ca_certificate: '{ca}'"));

    let server = near.serve(&["--rate", "50"]);
    let mut sender = Bridge::start(&near, &["--config", &listening, "--listen", "tls/127.0.0.1:0"]);
    sender.until("sending");
    assert!(sender.endpoint.starts_with("tls/"), "{}", sender.endpoint);

    let stranger = Stage::new();
    let to = ["--receive", "--connect", &sender.endpoint];
    let mut refused = Bridge::start(&stranger, &[&to[..], &["--config", &nameless]].concat());
    assert_eq!(refused.until("silent")["reason"], "no_connection");

    let mut receiver = Bridge::start(&far, &[&to[..], &["--config", &connecting]].concat());
    receiver.until("receiving");
    Reader::join(&far).next();
    assert_eq!(refused.process.terminate().last_json()["frames"], 0, "who has no certificate has seen nothing");
    server.stop();
    assert!(receiver.stop()["frames"].as_u64() > Some(0));
    sender.process.terminate();
}

#[test]
fn a_peer_that_starts_later_is_found() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let (_reserved, endpoint) = reserved_endpoint();
    for mode in ["peer", "client"] {
        let mut receiver =
            far.start(&super::bridges::arguments(&["--receive", "--connect", &endpoint, "--mode", mode]));
        let sender = Bridge::start(&near, &["--listen", &endpoint]);
        receiver.json_until("the bridge receives", |line| line["type"] == "receiving");
        assert_eq!(receiver.terminate().last_json()["type"], "received", "{mode}");
        sender.stop();
    }
    server.stop();
}

#[test]
fn a_sending_bridge_reports_whether_a_peer_is_connected() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let (_reserved, endpoint) = reserved_endpoint();
    let mut sender = Bridge::start(&near, &["--connect", &endpoint]);
    let alone = sender.until("alone");
    assert_eq!(alone["connects"], serde_json::json!([endpoint]));
    let mut receiver = Bridge::start(&far, &["--receive", "--listen", &endpoint]);
    let unheard = sender.until("connected")["unheard"].as_u64().expect("a count");
    receiver.until("receiving");
    Reader::join(&far).next();
    receiver.stop();
    let told = sender.until("alone");
    assert_eq!(told["connects"], alone["connects"]);
    server.stop();
    let sent = sender.stop();
    assert!(unheard > 0 && sent["unheard"].as_u64() > Some(unheard), "{sent}");
    assert!(sent["frames"].as_u64() > Some(0), "{sent}");
}

#[test]
fn a_client_without_a_peer_ends_at_a_signal() {
    let stage = Stage::new();
    let (_reserved, endpoint) = reserved_endpoint();
    let receiver = stage.start(&super::bridges::arguments(&["--receive", "--mode", "client", "--connect", &endpoint]));
    assert_eq!(receiver.complaint(), format!("waiting for a peer at {endpoint}"));
    let ended = receiver.terminate();
    assert_eq!((ended.code(), ended.stdout.as_str()), (Some(0), ""));
}

#[test]
fn impossible_links_are_refused_in_one_line() {
    let stage = Stage::new();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let endpoint = format!("tcp/127.0.0.1:{}", taken.local_addr().expect("a bound socket").port());
    fs::write(stage.path("odd.json5"), "{ lisen: {} }").expect("a file");
    let cases: [(&[&str], i32, &str); 9] = [
        (
            &["--listen", &endpoint],
            1,
            &format!("error: cannot open the zenoh session: Can not create a new TCP listener bound to {endpoint}"),
        ),
        (&["--config", "none.json5"], 2, "error: cannot read none.json5: No such file or directory (os error 2)"),
        (&["--config", "odd.json5"], 2, "error: odd.json5 is not a zenoh configuration: "),
        (
            &["--mode", "client"],
            2,
            "error: a client needs an endpoint to connect to: set --connect ENDPOINT, or connect.endpoints in the configuration file",
        ),
        (
            &["--connect", "udp/127.0.0.1:1"],
            2,
            "error: invalid value 'udp/127.0.0.1:1' for '--connect <ENDPOINT>': must be an endpoint such as tcp/10.0.0.5:7447 or tls/stage.example:7447",
        ),
        (&["--key", "a/*"], 2, "error: invalid value 'a/*' for '--key <PREFIX>': must be words separated by /"),
        (&["--every", "0"], 2, "error: invalid value '0' for '--every <N>': must be from 1 to "),
        (&["--every", "2", "--rate", "10"], 2, "error: the argument '--every <N>' cannot be used with '--rate <HZ>'"),
        (
            &["--receive", "--allow-commands"],
            2,
            "error: the argument '--receive' cannot be used with '--allow-commands'",
        ),
    ];
    for (args, code, error) in cases {
        let ended = stage.run(&[&["bridge", "zenoh"], args].concat());
        assert_eq!((ended.code(), ended.stderr.lines().count()), (Some(code), 1), "{args:?}: {}", ended.stderr);
        assert!(ended.stderr.starts_with(error), "{args:?}: {}", ended.stderr);
    }
}

#[test]
fn an_instance_has_one_source_and_a_receiving_bridge_is_one() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let refused = stage.run(&["bridge", "zenoh", "--receive", "--listen", ANY_PORT, "--format", "json"]);
    assert_eq!(refused.code(), Some(1));
    assert!(refused.stderr.starts_with("error: a server already runs on instance "), "{}", refused.stderr);
    server.stop();
}
