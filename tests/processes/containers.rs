//! The container image, as far as it can be tested without one: its processes in roots of their own, which share what
//! `docs/reference/containers.md` says and nothing else.

use std::fs;
use std::os::unix::fs::{PermissionsExt as _, chown};
use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::process::geteuid;
use serde_json::Value;
use test_support::executable::write_executable;
use test_support::process::Process;
use test_support::skip::{has_programs, is_possible, skip};

use crate::c_compiler::succeed;
use crate::http::get;
use crate::record::await_frames;
use crate::stage::Stage;

/// The user of the image, and the folder of the bus in it.
const USER: u32 = 1000;
const RUN: &str = "/run/dragon";
const PROGRAM: &str = "usr/local/bin/bench-dragon";

fn text(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a file of the repository")
}

/// Roots that share `/dev/shm`, the processes, the network and the folder of the bus.
struct Pod {
    stage: Stage,
    root: PathBuf,
}

impl Pod {
    /// A root with the program, the libraries that it needs, and the folders of the image.
    fn new() -> Self {
        let stage = Stage::new();
        let root = stage.path("root");
        let copy = |from: &str, to: &str| {
            let to = root.join(to.trim_start_matches('/'));
            fs::create_dir_all(to.parent().expect("a folder")).expect("the folder is new");
            write_executable(to, fs::read(from).expect("a file of this machine"));
        };
        copy(env!("CARGO_BIN_EXE_bench-dragon"), PROGRAM);
        let mut ldd = Command::new("ldd");
        ldd.arg(env!("CARGO_BIN_EXE_bench-dragon"));
        for library in succeed(ldd).split_whitespace().filter(|word| word.starts_with('/')) {
            copy(library, library);
        }
        for folder in ["dev/shm", "proc", RUN.trim_start_matches('/'), "recordings"] {
            fs::create_dir_all(root.join(folder)).expect("the folder is new");
        }
        fs::write(root.join("dev/null"), "").expect("the folder is there");
        for folder in [RUN.trim_start_matches('/'), "recordings"] {
            chown(root.join(folder), Some(USER), Some(USER)).expect("this user is root");
            fs::set_permissions(root.join(folder), fs::Permissions::from_mode(0o700)).expect("a mode");
        }
        fs::set_permissions(stage.path(""), fs::Permissions::from_mode(0o755)).expect("a mode");
        Self { stage, root }
    }

    /// Starts the program in a root as the image does.
    fn start(&self, args: &[&str]) -> Process {
        let script = r#"root=$1; shift
            mount --bind /dev/shm "$root/dev/shm" && mount --bind /dev/null "$root/dev/null" && mount -t proc proc "$root/proc" &&
            exec env -i PATH="$PATH" XDG_RUNTIME_DIR=/run/dragon chroot --userspec=1000:1000 "$root" /usr/local/bin/bench-dragon "$@""#;
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-c", script, "sh"]).arg(&self.root).args(args);
        command.args(["--instance", self.stage.domain().instance().as_str()]);
        Process::start(command)
    }
}

#[test]
fn serve_view_and_record_share_a_show_from_roots_of_their_own() {
    if !has_programs(&["unshare", "chroot", "ldd"]) || !is_possible(&["unshare", "--mount"]) {
        return;
    }
    if !geteuid().is_root() {
        return skip("only root may start a process in a root of its own");
    }
    let pod = Pod::new();
    let mut server = pod.start(&["serve", "--rate", "60", "--format", "json"]);
    assert_eq!(server.json()["type"], "started");
    let mut view = pod.start(&["view", "--listen", "127.0.0.1:0", "--format", "json"]);
    let address = view.json()["address"].as_str().and_then(|address| address.parse().ok()).expect("an address");
    let recorder = pod.start(&["record", "/recordings/show.mcap"]);
    await_frames(&pod.root.join("recordings/show.mcap"));
    let mut frame = get(address, "/frame");
    while frame.status == 503 {
        frame = get(address, "/frame");
    }
    assert_eq!(frame.status, 200, "{frame:?}");
    let status: Value = pod.start(&["ctl", "status", "--format", "json"]).end().last_json();
    assert_eq!(status["link"], "live", "{status}");
    for process in [recorder, view, server] {
        process.terminate().expect_clean();
    }
    let prefix = format!("bd_{USER}_{}_", pod.stage.domain().instance());
    let left: Vec<_> = fs::read_dir("/dev/shm").expect("the folder").flatten().map(|entry| entry.file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().starts_with(&prefix)), "{left:?}");
}

#[test]
fn the_image_has_the_user_and_the_folder_of_the_page_and_every_command_exists() {
    let image = text("packaging/container/Containerfile");
    for line in ["USER dragon", "ENTRYPOINT [\"bench-dragon\"]", &format!("ENV XDG_RUNTIME_DIR={RUN}")] {
        assert!(image.lines().any(|known| known == line), "{line} in {image}");
    }
    assert!(image.contains(&format!("useradd --uid {USER} ")) && image.contains(&format!(" /{PROGRAM}\n")), "{image}");
    for copied in ["LICENSE-MIT", "LICENSE-APACHE"] {
        assert!(image.contains(copied) && !text(copied).is_empty(), "{copied}");
    }
    let page = text("docs/reference/containers.md");
    let of_page = page.lines().filter(|line| line.starts_with("podman run")).map(|line| {
        let (_, command) = line.split_once(" bench-dragon ").expect("the image's name");
        command.split(' ').map(str::to_owned).collect::<Vec<_>>()
    });
    let compose = text("packaging/container/compose.yaml");
    let of_compose = compose.lines().filter_map(|line| line.trim().strip_prefix("command: [")?.strip_suffix(']'));
    let of_compose = of_compose.map(|line| line.split(", ").map(|word| word.trim_matches('"').to_owned()).collect());
    let commands: Vec<Vec<String>> = of_page.chain(of_compose).collect();
    assert_eq!(commands.len(), 7, "{commands:?}");
    let stage = Stage::new();
    for mut command in commands {
        command.push("--help".to_owned());
        stage.run(&command).expect_clean();
    }
}
