//! The module of Bitfocus Companion: built with Companion's tools, and run by a host that speaks Companion's protocol.

use std::env;
use std::fs;
use std::io::Write as _;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command};

use bench_dragon_ipc::ShowState;
use serde_json::{Value, json};
use test_support::process::Process;
use test_support::skip::skip;

use crate::bridge_steering::listen;
use crate::reader::Reader;
use crate::stage::Stage;

/// Builds the module in a stage's folder, as `npm run package` does. Skips the test if its packages are not installed.
pub(crate) fn build(stage: &Stage) -> Option<PathBuf> {
    let node = env::var_os("BENCH_DRAGON_NODE").map(PathBuf::from);
    let Some(node) = node.filter(|folder| folder.join("node_modules/@companion-module/tools").exists()) else {
        skip("tests/run has not installed the packages of tests/node");
        return None;
    };
    let folder = stage.path("companion");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging/companion"), &folder);
    let packages = node.join("node_modules").canonicalize().expect("a folder");
    symlink(&packages, folder.join("node_modules")).expect("a link");
    let mut tools = Command::new(packages.join(".bin/companion-module-build"));
    tools.current_dir(&folder);
    let ended = Process::start(tools).end();
    assert_eq!(ended.code(), Some(0), "{}{}", ended.stdout, ended.stderr);
    assert!(folder.join("bench-dragon-0.1.0.tgz").exists(), "{}", ended.stdout);
    Some(folder.join("pkg"))
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder").flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        match (path.is_dir(), name == "node_modules") {
            (_, true) => {}
            (true, _) => copy(&path, &to.join(name)),
            (false, _) => drop(fs::copy(&path, to.join(name)).expect("a file can be copied")),
        }
    }
}

/// Companion with a connection to a bridge.
pub(crate) struct Companion {
    process: Process,
    buttons: ChildStdin,
}

impl Companion {
    pub(crate) fn start(module: &Path, address: &str, secret: &str) -> Self {
        let (host, port) = address.rsplit_once(':').expect("an address and a port");
        let mut command = Command::new("node");
        command.arg("tests/node/companion_host.cjs").arg(module).args([host, port, secret]);
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        let (process, buttons) = Process::start_with_stdin(command);
        Self { process, buttons }
    }

    pub(crate) fn press(&mut self, action: &str, options: &Value) {
        writeln!(self.buttons, "{}", json!([action, options])).expect("the host reads its orders");
    }

    /// Waits for a line.
    #[track_caller]
    pub(crate) fn expect(&mut self, line: &Value) {
        self.process.json_until(&format!("{line} is printed"), |printed| printed == line);
    }

    pub(crate) fn end(self) {
        drop(self.buttons);
        self.process.end();
    }
}

#[test]
fn buttons_of_companion_steer_a_show_and_light_by_its_state() {
    let stage = Stage::new();
    let Some(module) = build(&stage) else { return };
    let server = stage.serve(&["--rate", "50", "--held"]);
    let mut reader = Reader::join(&stage);
    let secret = "night-of-dragons";
    let (bridge, address) = listen(&stage, &["--allow", "127.0.0.1", "--full", "--secret", secret]);
    let mut companion = Companion::start(&module, &address, secret);
    companion.expect(&json!(["presets", "hold", "release", "pause", "resume", "go", "stop"]));
    companion.expect(&json!(["status", "ok"]));
    companion.expect(&json!(["light", "ready", true]));
    companion.press("release", &json!({}));
    companion.expect(&json!(["light", "running", true]));
    reader.read_until("the show runs", |header| header.show_state() == Some(ShowState::Running));
    companion.press("speed", &json!({ "value": 0.75 }));
    companion.expect(&json!(["variable", "reply", "speed: accepted"]));
    reader.read_until("the head walks at the speed of the button", |header| header.head_speed_mps == 0.75);
    companion.press("hold", &json!({}));
    companion.expect(&json!(["variable", "state", "held"]));
    companion.expect(&json!(["light", "held", true]));
    reader.read_until("the show is held", |header| header.show_state() == Some(ShowState::Held));
    companion.press("resume", &json!({}));
    companion.expect(&json!(["light", "refused", true]));
    companion.press("seek", &json!({ "value": 30 }));
    companion.expect(&json!(["light", "refused", false]));
    reader.read_until("the show is where the button has sought", |header| header.show_time_s() == 30.0);
    // The last state of a bridge that ends is silent.
    bridge.terminate().expect_clean();
    companion.expect(&json!(["light", "silent", true]));
    companion.expect(&json!(["status", "connection_failure"]));
    companion.end();
    server.stop();
}

#[test]
fn a_module_with_a_wrong_secret_knows_nothing_of_the_show() {
    let stage = Stage::new();
    let Some(module) = build(&stage) else { return };
    let server = stage.serve(&["--rate", "50"]);
    let (bridge, address) = listen(&stage, &["--allow", "127.0.0.1", "--secret", "night-of-dragons"]);
    let mut companion = Companion::start(&module, &address, "another-secret");
    companion.press("hold", &json!({}));
    companion.expect(&json!(["status", "connection_failure"]));
    companion.expect(&json!(["light", "silent", true]));
    companion.end();
    let counts = bridge.terminate().expect_clean().last_json();
    assert!(counts["accepted"] == 0 && counts["strangers"].as_u64() >= Some(2), "{counts}");
    server.stop();
}
