//! Checks whether systemd removes this user's shared memory when the user logs out.
//!
//! By default (`RemoveIPC=` in logind.conf(5)) logind removes it for users that are not system users, after their last session
//! has ended. It does so even if a system unit still runs a server as that user. A user that lingers stays logged in.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::{Finding, Target};

/// Folders with logind's configuration. A file in an earlier folder replaces files of the same name in later folders.
const FOLDERS: [&str; 4] = ["etc/systemd", "run/systemd", "usr/local/lib/systemd", "usr/lib/systemd"];
/// The first user id that does not belong to a system user.
const FIRST_USER: u32 = 1000;

/// Whether this user's shared memory stays after a logout.
pub(super) fn shared_memory_at_logout(_: &Target) -> Finding {
    examine_root(Path::new("/"), rustix::process::getuid().as_raw())
}

/// Does the check for a user of the system whose files are under `root`.
fn examine_root(root: &Path, uid: u32) -> Finding {
    let has_logind = FOLDERS.iter().any(|folder| root.join(folder).join("systemd-logind").exists());
    let passwd = fs::read_to_string(root.join("etc/passwd")).unwrap_or_default();
    let lingers = user_name(&passwd, uid).is_some_and(|name| root.join("var/lib/systemd/linger").join(name).exists());
    judge(has_logind.then(|| removes_ipc(&configuration(root))), uid, lingers)
}

/// The texts of logind's configuration, in the order in which they apply: the main file, then drop-ins by their names.
fn configuration(root: &Path) -> Vec<String> {
    let read = |path: &Path| fs::read_to_string(path).ok();
    let main = FOLDERS.iter().find_map(|folder| read(&root.join(folder).join("logind.conf")));
    let mut drop_ins = BTreeMap::new();
    for folder in FOLDERS.iter().rev() {
        let entries = fs::read_dir(root.join(folder).join("logind.conf.d")).into_iter().flatten().flatten();
        for path in entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|end| end == "conf")) {
            // A link to /dev/null replaces a file of that name by an empty one.
            drop_ins.insert(path.file_name().map(ToOwned::to_owned), read(&path).unwrap_or_default());
        }
    }
    main.into_iter().chain(drop_ins.into_values()).collect()
}

/// The value of `RemoveIPC` in these texts, which are in the order in which they apply. The default is yes.
fn removes_ipc(texts: &[String]) -> bool {
    let mut removes = true;
    for text in texts {
        let mut section = "";
        for line in text.lines().map(str::trim) {
            if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
                section = name;
            }
            let Some((key, value)) = line.split_once('=') else { continue };
            if section != "Login" || key.trim() != "RemoveIPC" {
                continue;
            }
            removes = match value.trim().to_ascii_lowercase().as_str() {
                "1" | "yes" | "y" | "true" | "t" | "on" => true,
                "0" | "no" | "n" | "false" | "f" | "off" => false,
                // systemd ignores other values.
                _ => removes,
            };
        }
    }
    removes
}

/// A user's name in the text of /etc/passwd.
fn user_name(passwd: &str, uid: u32) -> Option<&str> {
    passwd.lines().find_map(|line| {
        let mut fields = line.split(':');
        let (name, id) = (fields.next()?, fields.nth(1)?);
        (id.parse() == Ok(uid)).then_some(name)
    })
}

/// Judges the facts. `removes` is `None` if there is no logind.
fn judge(removes: Option<bool>, uid: u32, lingers: bool) -> Finding {
    match removes {
        None => Finding::ok("no logind", "no systemd-logind: shared memory stays when a user logs out"),
        Some(false) => Finding::ok("RemoveIPC=no", "shared memory stays when a user logs out"),
        Some(true) if uid < FIRST_USER => {
            Finding::ok("RemoveIPC=yes", format!("shared memory of a system user, such as {uid}, stays at logout"))
        }
        Some(true) if lingers => Finding::ok("RemoveIPC=yes", "this user lingers, so its shared memory stays"),
        Some(true) => Finding::warning(
            "RemoveIPC=yes",
            "systemd removes this user's shared memory when the user logs out: a show that still runs loses its bus",
            "set RemoveIPC=no in /etc/systemd/logind.conf and restart systemd-logind, or `loginctl enable-linger`, or run \
             the show as a system user",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::doctor::finding::Verdict;

    fn removes(texts: &[&str]) -> bool {
        removes_ipc(&texts.iter().map(|&text| text.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn the_last_value_in_the_login_section_applies() {
        assert!(removes(&[]), "systemd's default");
        assert!(removes(&["[Login]\n#RemoveIPC=no\n;RemoveIPC=no\n"]), "comments");
        assert!(!removes(&["[Login]\nRemoveIPC = no\n"]));
        assert!(!removes(&["[Login]\nRemoveIPC=yes\n", "[Login]\nKillUserProcesses=yes\nRemoveIPC=off\n"]));
        assert!(removes(&["[Login]\nRemoveIPC=no\n", "[Login]\nRemoveIPC=1\n"]));
        assert!(removes(&["[Other]\nRemoveIPC=no\n", "RemoveIPC=no\n"]), "another section");
        assert!(!removes(&["[Login]\nRemoveIPC=no\nRemoveIPC=maybe\n"]), "an ignored value");
    }

    #[test]
    fn only_an_ordinary_user_who_does_not_linger_is_warned() {
        for (removes, uid, lingers, expected) in [
            (Some(true), 1000, false, Verdict::Warning),
            (Some(true), 1000, true, Verdict::Ok),
            (Some(true), 999, false, Verdict::Ok),
            (Some(true), 0, false, Verdict::Ok),
            (Some(false), 1000, false, Verdict::Ok),
            (None, 1000, false, Verdict::Ok),
        ] {
            assert_eq!(judge(removes, uid, lingers).status, expected, "{removes:?} {uid} {lingers}");
        }
    }

    #[test]
    fn the_configuration_is_read_as_systemd_reads_it() {
        let root = tempfile::tempdir().expect("a folder");
        let write = |path: &str, text: &str| {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        };
        let status = || examine_root(root.path(), 1000).status;
        assert_eq!(status(), Verdict::Ok, "no logind");
        write("usr/lib/systemd/systemd-logind", "");
        assert_eq!(status(), Verdict::Warning);
        write("usr/lib/systemd/logind.conf.d/50-ipc.conf", "[Login]\nRemoveIPC=no\n");
        assert_eq!(status(), Verdict::Ok);
        write("etc/systemd/logind.conf", "[Login]\nRemoveIPC=yes\n");
        assert_eq!(status(), Verdict::Ok, "drop-ins come after the main file");
        write("etc/systemd/logind.conf.d/50-ipc.conf", "");
        assert_eq!(status(), Verdict::Warning, "a file of the same name in /etc replaces the other one");
        write("run/systemd/logind.conf.d/40-early.conf", "[Login]\nRemoveIPC=no\n");
        assert_eq!(status(), Verdict::Ok);
        write("run/systemd/logind.conf.d/60-late.conf", "[Login]\nRemoveIPC=yes\n");
        assert_eq!(status(), Verdict::Warning);
        write("etc/passwd", "root:x:0:0::/root:/bin/sh\nstage:x:1000:1000::/home/stage:/bin/sh\n");
        write("var/lib/systemd/linger/stage", "");
        assert_eq!(status(), Verdict::Ok, "the user lingers");
    }
}
