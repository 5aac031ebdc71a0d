//! The child processes of a show, found in `/proc`.

use std::fs;

use rustix::process::{Pid, Signal, kill_process};

use crate::eventually::eventually;

/// Waits for a child of the show that runs a command, other than the one with the id `before`. Returns its process id.
pub fn await_child(show: u32, command: &str, before: Option<u32>) -> u32 {
    eventually(&format!("the show has a {command} other than {before:?}"), || {
        children(show).into_iter().find(|(pid, name)| name == command && Some(*pid) != before)
    })
    .0
}

/// Returns the show's running children with their commands.
pub fn children(show: u32) -> Vec<(u32, String)> {
    let processes = fs::read_dir("/proc").expect("Linux has this file").flatten();
    processes
        .filter_map(|process| {
            let pid = process.file_name().to_str()?.parse().ok()?;
            // The file is missing if the process has just ended.
            let line = fs::read(process.path().join("cmdline")).ok()?;
            let args: Vec<String> =
                line.split(|&byte| byte == 0).map(|arg| String::from_utf8_lossy(arg).into()).collect();
            let is_ours = args.windows(2).any(|pair| pair[0] == "--parent" && pair[1] == show.to_string());
            is_ours.then(|| (pid, args[1].clone()))
        })
        .collect()
}

/// Kills a child of a show.
pub fn kill(child: u32) {
    send(child, Signal::KILL).expect("the process runs");
}

/// Sends a signal to a child of a show.
///
/// # Errors
/// The child has ended, and its show has waited for it.
pub fn send(child: u32, signal: Signal) -> rustix::io::Result<()> {
    kill_process(Pid::from_raw(child.cast_signed()).expect("a process id is not 0"), signal)
}
