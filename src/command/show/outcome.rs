//! The outcome of a show: why it ended, for programs and in one sentence for people.

use serde::Serialize;

/// Why a show ended. `summary.json` and the page have it, with its sentence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Outcome {
    #[serde(flatten)]
    pub(super) ending: Ending,
    /// The ending in one sentence.
    pub(super) text: String,
}

/// The ending of a show. Times are show times in seconds.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(super) enum Ending {
    /// Benches touched, which ends a rehearsal.
    Contact { time_s: f64, benches: [u32; 2] },
    /// The guard held the dragon permanently, which ends a rehearsal.
    Guard { held_at_s: f64 },
    /// The dragon reached the end of its run, which ends a rehearsal.
    EndOfRun { time_s: f64 },
    /// The show reached the time of `--until`, which ends a rehearsal.
    Until { time_s: f64 },
    /// A command, or a signal to the server's process, stopped the server. The process id is null if it is unknown.
    Stopped { sender: String, pid: Option<u32> },
    /// A signal to the show itself.
    Signal { signal: &'static str },
    /// The server ended in order, without a known reason.
    ServerEnded,
    /// A process without which the show cannot go on was given up, or the show itself failed.
    Failed { process: String, reason: String, restarts: u32 },
}

impl From<Ending> for Outcome {
    fn from(ending: Ending) -> Self {
        let text = match &ending {
            Ending::Contact { time_s, benches: [a, b] } => format!("Benches {a} and {b} touched at {time_s:.6} s."),
            Ending::Guard { held_at_s } => {
                format!("The guard held the dragon permanently at {held_at_s:.6} s: ahead, benches come too near.")
            }
            Ending::EndOfRun { time_s } => format!("The dragon reached the end of its run at {time_s:.3} s."),
            Ending::Until { time_s } => format!("The show reached its end time, {time_s:.3} s."),
            Ending::Stopped { sender, .. } if sender == "signal" => {
                "A signal to the server's process stopped the show.".to_owned()
            }
            Ending::Stopped { sender, pid: Some(pid) } => {
                format!("A command of {sender} (process {pid}) stopped the show.")
            }
            Ending::Stopped { sender, pid: None } => format!("A command of {sender} stopped the show."),
            Ending::Signal { signal } => format!("{signal} ended the show."),
            Ending::ServerEnded => "The server ended by itself.".to_owned(),
            Ending::Failed { process, reason, restarts: 0 } if process == "show" => {
                format!("The show failed: {reason}.")
            }
            Ending::Failed { process, reason, restarts: 0 } => format!("The show failed: {process} {reason}."),
            Ending::Failed { process, reason, restarts } => {
                format!("The show failed: {process} {reason}, after {restarts} restarts.")
            }
        };
        Self { ending, text }
    }
}
