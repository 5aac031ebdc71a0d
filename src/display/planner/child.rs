//! A process of this program that works for a page. It answers as on the command line, by the same functions and within the same
//! limits, on cores that a drag leaves free. It ends at once when it is cancelled.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rustix::param::page_size;
use rustix::process::{Pid, setpriority_process};

/// Time between two looks at the process.
const PERIOD: Duration = Duration::from_millis(20);
/// Most memory of the process, and most bytes of what it prints.
const MAX_MEMORY: u64 = 1 << 30;
const MAX_PRINTED: u64 = 4 << 20;
/// Its niceness: questions give way to a hand.
const NICE: i32 = 19;
/// Names of files in the folder of the process.
const PLAN: &str = "plan.toml";
const ANSWER: &str = "answer.toml";
const OUT: &str = "out";
const ERR: &str = "err";

/// What a process has printed and written.
#[derive(Debug)]
pub(super) struct Ended {
    pub(super) is_success: bool,
    pub(super) printed: String,
    /// Its messages, without the name of its file.
    pub(super) messages: String,
    /// The configuration that it has saved.
    pub(super) answer: Option<String>,
}

/// How far a process is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Progress {
    pub(super) elapsed: Duration,
    /// The share of the work that is done, if the process knows it.
    pub(super) share: Option<f64>,
}

/// The files that the process gets by their flags: the text's, and the answer's.
#[derive(Clone, Copy, Debug)]
pub(super) enum Files {
    Plan,
    PlanAndAnswer,
}

/// Reads a text with its drawings and maps as every command does, within the limits of time and memory.
///
/// # Errors
/// The reason, in one line.
pub(super) fn check(text: &str) -> Result<(), String> {
    let args = ["plan", "--check"].map(str::to_owned);
    match run(&args, text, None, |_| true) {
        Ok(Some(Ended { is_success: false, messages, .. })) => Err(messages),
        Ok(_) => Ok(()),
        Err(error) => Err(format!("reading it and its drawing or map has failed: {error}")),
    }
}

/// Runs this program for a text. `look` gets the progress, and returns whether the process goes on: `None` if it was cancelled.
///
/// # Errors
/// The process cannot be started, or needs more than is allowed.
pub(super) fn run(
    args: &[String],
    text: &str,
    files: impl Into<Option<Files>>,
    look: impl FnMut(Progress) -> bool,
) -> io::Result<Option<Ended>> {
    let folder = tempfile::Builder::new().prefix("bench-dragon-plan-").tempdir()?;
    let at = |name: &str| folder.path().join(name);
    fs::write(at(PLAN), text)?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(args);
    let files = files.into();
    if files.is_some() {
        command.arg("--config");
    }
    command.arg(at(PLAN));
    if let Some(Files::PlanAndAnswer) = files {
        command.arg("--save-config").arg(at(ANSWER));
    }
    command.args(["--report-progress", "--parent", &std::process::id().to_string()]).env("NO_COLOR", "1");
    command.stdin(Stdio::null()).stdout(File::create(at(OUT))?).stderr(File::create(at(ERR))?);
    // The kernel ends the process with this thread, which waits for it.
    let mut child = Guarded(command.spawn()?);
    let pid = Pid::from_child(&child.0);
    if files.is_some() {
        // Without a lower priority it is only slower for others.
        let _ = setpriority_process(Some(pid), NICE);
    }
    let Some(is_success) = watch(&mut child.0, folder.path(), look)? else { return Ok(None) };
    let (messages, _) = messages(&read(&at(ERR))?, &at(PLAN));
    let answer = fs::read_to_string(at(ANSWER)).ok();
    Ok(Some(Ended { is_success, printed: read(&at(OUT))?, messages, answer }))
}

/// A process that is killed and reaped if it is dropped before its end.
struct Guarded(Child);

impl Drop for Guarded {
    fn drop(&mut self) {
        // Both fail only for a process that has ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits for the end. Returns whether it was a success; `None` if the process shall not go on.
fn watch(child: &mut Child, folder: &Path, mut look: impl FnMut(Progress) -> bool) -> io::Result<Option<bool>> {
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status.success()));
        }
        if memory(child.id()) > MAX_MEMORY {
            return Err(io::Error::other(format!(
                "it takes more than {} MiB of memory, the most that is allowed",
                MAX_MEMORY >> 20
            )));
        }
        if fs::metadata(folder.join(OUT))?.len() > MAX_PRINTED {
            return Err(io::Error::other("the answer is too long for the page"));
        }
        let (_, share) = messages(&read(&folder.join(ERR))?, folder);
        if !look(Progress { elapsed: begun.elapsed(), share }) {
            return Ok(None);
        }
        thread::sleep(PERIOD);
    }
}

fn read(file: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    File::open(file)?.take(MAX_PRINTED).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The messages in what was printed on stderr, and the newest progress.
fn messages(printed: &str, plan: &Path) -> (String, Option<f64>) {
    let (mut words, mut share) = (Vec::new(), None);
    for line in printed.lines() {
        match line.strip_prefix("progress ") {
            Some(number) => share = number.parse().ok().or(share),
            None => words.push(line.strip_prefix("error: ").unwrap_or(line)),
        }
    }
    (words.join("\n").replace(&format!("{}: ", plan.display()), ""), share)
}

/// Memory of a process, in bytes; 0 if the kernel does not say.
fn memory(pid: u32) -> u64 {
    let pages = fs::read_to_string(format!("/proc/{pid}/statm")).ok();
    let resident = pages.and_then(|pages| pages.split(' ').nth(1)?.parse::<u64>().ok());
    resident.unwrap_or(0) * page_size() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_lose_the_name_of_a_file_that_nobody_knows_and_progress_is_no_message() {
        let printed = "progress 0.100\nerror: /tmp/x/plan.toml: [route] kind is \"path\"\nprogress 0.250\n";
        let (words, share) = messages(printed, Path::new("/tmp/x/plan.toml"));
        assert_eq!((&*words, share), ("[route] kind is \"path\"", Some(0.25)));
    }
}
