//! The outcome of a show: why it ended, for programs and in one sentence for people.

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::ShowState;
use serde::Serialize;

use super::Show;
use super::children::ChildRole;
use crate::cli::monitor::lines::{BorderStop, ContactReport};
use crate::display::observe::of_formation;
use crate::source::server::StoppedBy;

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
    Contact(ContactReport),
    /// The guard held the dragon permanently, which ends a rehearsal.
    Guard {
        held_at_s: f64,
        is_margin_kept: bool,
        /// The border of the stage before which it stopped.
        #[serde(skip_serializing_if = "Option::is_none")]
        border: Option<BorderStop>,
    },
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

impl Ending {
    /// A contact, if this is the planned end of a show that the contact would have ended before.
    fn or_earlier(self, contact: Self) -> Self {
        if matches!(self, Self::EndOfRun { .. } | Self::Until { .. }) { contact } else { self }
    }
}

impl From<Ending> for Outcome {
    fn from(ending: Ending) -> Self {
        let text = match &ending {
            Ending::Contact(contact) => touched(contact),
            Ending::Guard { held_at_s, is_margin_kept, border } => {
                let time = Fixed::<6>(*held_at_s);
                let limit = border.as_ref().map_or_else(
                    || "margin_m is not proved to be kept".to_owned(),
                    |stop| format!("{} comes nearer to {} than clear_m", stop.who(), stop.border),
                );
                if *is_margin_kept {
                    format!("The guard held the dragon permanently at {time} s: beyond, {limit}.")
                } else {
                    format!(
                        "The guard does not let the dragon walk from {time} s: {limit} there. Start or seek elsewhere."
                    )
                }
            }
            Ending::EndOfRun { time_s } => {
                format!("The dragon reached the end of its run at {} s.", Fixed::<3>(*time_s))
            }
            Ending::Until { time_s } => {
                format!("The show reached its end time, {} s.", Fixed::<3>(*time_s))
            }
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

/// A contact in one sentence.
pub(super) fn touched(contact: &ContactReport) -> String {
    let who = contact.who();
    let (first, rest) = who.split_at(1);
    // A name begins as it is written.
    let first = if contact.named.is_some() { first.to_owned() } else { first.to_uppercase() };
    format!("{first}{rest} touched at {} s.", Fixed::<6>(contact.time_s))
}

/// The first sign that a show is over. The server may report more of it at its own end.
pub(super) enum Over {
    /// The server has ended, or is ending by itself.
    Server,
    /// The show itself ends it.
    Show(Ending),
}

impl Show<'_> {
    /// The first sign that the show is over; `None` while it goes on.
    pub(super) fn over(&self) -> Option<Over> {
        if self.is_stopped {
            return Some(Over::Server);
        }
        if !self.ends_by_itself() {
            return None;
        }
        let known = &self.reports.totals.summary;
        let guard = known.guard.as_ref().map(|at| Ending::Guard {
            held_at_s: at.held_at_s,
            is_margin_kept: at.is_margin_kept,
            border: at.border.clone(),
        });
        let end = self.seen.header.and_then(|header| match header.show_state() {
            Some(ShowState::Ended) => Some(Over::Server),
            Some(ShowState::Finished) => Some(Over::Show(Ending::EndOfRun { time_s: header.show_time_s() })),
            _ => None,
        });
        self.contact().or(guard).map(Over::Show).or(end)
    }

    /// Whether a contact, the guard's hold or the end of the run ends the show. A timecode may move back from the end.
    fn ends_by_itself(&self) -> bool {
        !self.is_performance && self.args.run.timecode.source.is_none()
    }

    /// The contact, if the monitor has found one.
    fn contact(&self) -> Option<Ending> {
        self.reports.totals.summary.contact.clone().map(Ending::Contact)
    }

    /// The outcome of a show whose server and monitor have ended. A contact comes before the end of a rehearsal, even if the
    /// monitor found it later. `over` is the first sign that it was over; without one, a signal ended it.
    pub(super) fn outcome(&self, played: &anyhow::Result<()>, over: Option<Over>) -> Outcome {
        let failed = |error: &anyhow::Error| {
            let (process, reason) = ("show".to_owned(), format!("{error:#}"));
            self.failure.clone().unwrap_or(Ending::Failed { process, reason, restarts: 0 })
        };
        let ending = match (played, over) {
            (Err(error), _) => failed(error),
            (Ok(()), Some(Over::Show(ending))) => ending,
            (Ok(()), Some(Over::Server)) => self.server_ending(),
            (Ok(()), None) => self.stop.signal().map_or(Ending::ServerEnded, |signal| Ending::Signal { signal }),
        };
        let contact = self.contact().filter(|_| self.ends_by_itself());
        let outcome = Outcome::from(contact.map_or(ending.clone(), |contact| ending.or_earlier(contact)));
        let is_formation = self.config.named().is_some();
        if is_formation { Outcome { text: of_formation(&outcome.text), ..outcome } } else { outcome }
    }

    /// Whether a server that has ended in order may not end the show: a performance ends by a command or a signal to the show.
    pub(super) fn needs_server(&self) -> bool {
        let by_command = self.reports.stopped_by.as_ref().is_some_and(|by| !by.is_signal());
        self.is_performance && !by_command && !self.stop.is_set()
    }

    /// Sends the outcome to the page, which shows it as long as it is open.
    pub(super) fn send_outcome(&mut self, outcome: &Outcome) {
        let line = serde_json::to_string(outcome).expect("numbers and strings are JSON");
        self.children.write_last_line(ChildRole::View, &line);
    }

    /// The ending of a show whose server has ended in order.
    fn server_ending(&self) -> Ending {
        match (self.reports.stopped_by.clone(), self.stop.signal()) {
            // A service manager signals the show and its server at once.
            (Some(by), Some(signal)) if by.is_signal() => return Ending::Signal { signal },
            (Some(StoppedBy { sender, pid }), _) => return Ending::Stopped { sender, pid },
            (None, _) => {}
        }
        let Some(header) = self.seen.header else { return Ending::ServerEnded };
        let time_s = header.show_time_s();
        let until_s = self.args.run.pace.until.filter(|until_s| time_s + NANOSECOND_S >= *until_s);
        match (until_s, header.show_state()) {
            (Some(_), _) => Ending::Until { time_s },
            (None, Some(ShowState::Ended)) => Ending::EndOfRun { time_s },
            (None, _) => Ending::ServerEnded,
        }
    }
}

/// Resolution of a frame's show time, in seconds.
const NANOSECOND_S: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_that_the_monitor_found_late_comes_before_a_planned_end_alone() {
        let contact = Ending::Contact(ContactReport { time_s: 412.473_838, benches: [0, 8], named: None });
        for (ending, is_contact) in [
            (Ending::EndOfRun { time_s: 430.0 }, true),
            (Ending::Until { time_s: 430.0 }, true),
            (Ending::Stopped { sender: "ctl".to_owned(), pid: None }, false),
            (Ending::Signal { signal: "SIGINT" }, false),
        ] {
            let settled = ending.clone().or_earlier(contact.clone());
            assert_eq!(settled, if is_contact { contact.clone() } else { ending });
        }
    }

    #[test]
    fn an_outcome_has_its_kind_and_one_sentence() {
        let process = || "serve".to_owned();
        for (ending, kind, text) in [
            (
                Ending::Contact(ContactReport { time_s: 412.473_838, benches: [0, 8], named: None }),
                "contact",
                "Benches 0 and 8 touched at 412.473838 s.",
            ),
            (
                Ending::Stopped { sender: "ctl".to_owned(), pid: Some(7) },
                "stopped",
                "A command of ctl (process 7) stopped the show.",
            ),
            (
                Ending::Failed {
                    process: process(),
                    reason: "ended with signal: 9 (SIGKILL)".to_owned(),
                    restarts: 12,
                },
                "failed",
                "The show failed: serve ended with signal: 9 (SIGKILL), after 12 restarts.",
            ),
            (Ending::EndOfRun { time_s: 60.0 }, "end_of_run", "The dragon reached the end of its run at 60.000 s."),
        ] {
            let outcome = serde_json::to_value(Outcome::from(ending)).expect("an outcome is JSON");
            assert_eq!((&outcome["kind"], &outcome["text"]), (&kind.into(), &text.into()), "{outcome}");
        }
    }
}
