//! The Debian package: it is installed into an empty root, works there, and leaves nothing when it is removed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::process::geteuid;
use test_support::skip::{has_programs, skip};

use crate::c_compiler::{built_libraries, succeed};
use crate::stage::Stage;

const PACKAGE: &str = "bench-dragon";

/// A call of dpkg for a root folder.
fn dpkg(root: &Path, args: &[&str]) -> String {
    let mut command = Command::new("dpkg");
    command.args(["--force-script-chrootless", "--force-depends", "--root"]).arg(root).args(args);
    // dpkg looks for programs of administrators.
    command.env("PATH", format!("/usr/sbin:/sbin:{}", std::env::var("PATH").expect("a path")));
    succeed(command)
}

/// A root folder without packages.
fn empty_root(stage: &Stage) -> PathBuf {
    let root = stage.path("root");
    for folder in ["info", "updates", "triggers"] {
        fs::create_dir_all(root.join("var/lib/dpkg").join(folder)).expect("the folder is new");
    }
    for file in ["status", "available"] {
        fs::write(root.join("var/lib/dpkg").join(file), "").expect("the file is new");
    }
    root
}

/// All files of a folder, without those of dpkg itself.
fn files(root: &Path) -> Vec<String> {
    let mut command = Command::new("find");
    command.arg(root).args(["-path", "*/var/lib/dpkg", "-prune", "-o", "!", "-type", "d", "-printf", "/%P\\n"]);
    let mut files: Vec<String> = succeed(command).lines().map(str::to_owned).collect();
    files.sort();
    files
}

/// Makes the package in a folder of a test. Returns its path.
fn packed(stage: &Stage, folder: &str) -> String {
    let mut command = Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging/deb/build"));
    command.args(["--fast", "--program", env!("CARGO_BIN_EXE_bench-dragon"), "--libraries"]);
    command.arg(built_libraries()).arg(stage.path(folder));
    succeed(command).trim().to_owned()
}

#[test]
fn lintian_finds_no_error_and_no_warning() {
    if !has_programs(&["dpkg-deb", "lintian"]) {
        return;
    }
    let stage = Stage::new();
    let mut lintian = Command::new("lintian");
    lintian.args(["--allow-root", "--fail-on", "error,warning"]).arg(packed(&stage, "package"));
    assert_eq!(succeed(lintian), "");
}

#[test]
fn it_is_installed_into_an_empty_root_and_removed_without_a_rest() {
    if !has_programs(&["dpkg", "dpkg-deb", "objdump"]) {
        return;
    }
    if !geteuid().is_root() {
        return skip("dpkg installs as root only");
    }
    let stage = Stage::new();
    let [package, again] = ["one", "two"].map(|folder| packed(&stage, folder));
    assert!(fs::read(&package).expect("a package") == fs::read(again).expect("a package"), "two packages are alike");

    let root = empty_root(&stage);
    dpkg(&root, &["--install", &package]);
    let installed = files(&root);
    for file in [
        "/etc/bench-dragon/stage.toml",
        "/etc/security/limits.d/bench-dragon.conf",
        "/usr/bin/bench-dragon",
        "/usr/include/bench_dragon.h",
        "/usr/lib/libbench_dragon_c.so",
        "/usr/lib/pkgconfig/bench-dragon.pc",
        "/usr/lib/systemd/system/bench-dragon.service",
        "/usr/share/bash-completion/completions/bench-dragon",
        "/usr/share/doc/bench-dragon/copyright",
        "/usr/share/doc/bench-dragon/docs/how-it-works/real-time.md",
        "/usr/share/fish/vendor_completions.d/bench-dragon.fish",
        "/usr/share/man/man1/bench-dragon.1.gz",
        "/usr/share/zsh/vendor-completions/_bench-dragon",
    ] {
        assert!(installed.iter().any(|installed| installed == file), "{file} is missing in {installed:#?}");
    }
    let run = |args: &[&str]| {
        let mut command = Command::new(root.join("usr/bin/bench-dragon"));
        command.args(args);
        succeed(command)
    };
    assert_eq!(run(&["--version"]), format!("bench-dragon {}\n", env!("CARGO_PKG_VERSION")));
    let config = root.join("etc/bench-dragon/stage.toml");
    assert!(run(&["solve", "route", "--config", &config.to_string_lossy()]).contains("length"));
    let unit = fs::read_to_string(root.join("usr/lib/systemd/system/bench-dragon.service")).expect("a unit");
    let [program, document] = ["ExecStart=", "Documentation=file:"].map(|key| {
        let value = unit.lines().find_map(|line| line.strip_prefix(key)).expect("the unit has the key");
        value.split(' ').next().expect("a path").to_owned()
    });
    assert!(installed.contains(&program) && installed.contains(&document), "{program} {document}");
    if has_programs(&["systemd-sysusers"]) {
        let users = fs::read_to_string(root.join("etc/passwd")).expect("the package creates a user");
        assert!(users.lines().any(|line| line.starts_with("bench-dragon:")), "{users}");
    }

    dpkg(&root, &["--purge", PACKAGE]);
    let left: Vec<String> = files(&root);
    // The user of the service stays, as Debian wants it: its number must not be given to another.
    let of_users = |file: &String| ["passwd", "group", "shadow", "gshadow"].iter().any(|name| file.contains(name));
    let left: Vec<&String> = left.iter().filter(|file| !of_users(file) && *file != "/etc/.pwd.lock").collect();
    assert!(left.is_empty(), "{left:#?}");
}
