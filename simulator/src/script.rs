//! The script of a scenario: what real processes can repeat of it, in real time.
//!
//! A script has the signals to the show's children and the commands of the operators, at their instants. It leaves out what only a
//! simulated kernel, bus or disk can do: clock readings that stand, lost and late messages, slow proofs, torn writes, full disks and
//! power losses.

use bench_dragon_ipc::Request;

use crate::fault::{FaultKind, Operator, Part, flurry};
use crate::scenario::Scenario;

/// A show for real processes.
#[derive(Clone, Debug)]
pub struct Script {
    /// Arguments of the command `show`, beside the configuration and the folder. The show waits for a stop.
    pub args: Vec<String>,
    /// Whether a restarted server walks on by itself.
    pub auto_resume: bool,
    /// Signals and commands, in the order of their instants. At the end, stopped parts have to be continued.
    pub steps: Vec<ScriptStep>,
    /// Number of faults that are left out.
    pub left_out: usize,
}

/// A step of a script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScriptStep {
    /// Instant from the first frame, in nanoseconds.
    pub at_ns: u64,
    /// What is done.
    pub action: ScriptAction,
}

/// A signal to a child of the show, or a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScriptAction {
    /// SIGKILL.
    Kill(Part),
    /// SIGSTOP.
    Stop(Part),
    /// SIGCONT.
    Continue(Part),
    /// An operator sends a command.
    Command(Operator, Request),
}

impl Scenario {
    /// The script of the scenario; `None` for a show with timecode.
    pub fn script(&self) -> Option<Script> {
        if self.flags.timecode {
            return None;
        }
        let mut args = vec!["--stay".to_owned()];
        args.extend(self.flags.held.then(|| "--held".to_owned()));
        args.extend(self.flags.auto_resume.then(|| "--auto-resume".to_owned()));
        args.extend(self.flags.until_s.map(|until_s| format!("--until={until_s}")));
        let mut script = Script { args, auto_resume: self.flags.auto_resume, steps: Vec::new(), left_out: 0 };
        for fault in &self.faults {
            script.add(fault.at_ns, fault.kind, self.times_s());
        }
        script.continue_late();
        script.steps.retain(|step| step.at_ns <= self.length_ns);
        script.steps.sort_by_key(|step| step.at_ns);
        Some(script)
    }
}

impl Script {
    fn add(&mut self, at_ns: u64, kind: FaultKind, seek_s: [f64; 2]) {
        let mut step = |at_ns, action| self.steps.push(ScriptStep { at_ns, action });
        match kind {
            FaultKind::Kill(part) => step(at_ns, ScriptAction::Kill(part)),
            FaultKind::KillInWrite(_) => step(at_ns, ScriptAction::Kill(Part::Recorder)),
            FaultKind::Stop(part, ns) => {
                step(at_ns, ScriptAction::Stop(part));
                step(at_ns + ns, ScriptAction::Continue(part));
            }
            // A stop ends the script.
            FaultKind::Command(_, Request::Stop) => self.left_out += 1,
            FaultKind::Command(operator, request) => step(at_ns, ScriptAction::Command(operator, request)),
            FaultKind::Flurry(desk, seed, count) => {
                let commands = flurry(seed, count, seek_s).filter(|request| *request != Request::Stop);
                commands.for_each(|request| step(at_ns, ScriptAction::Command(Operator::Desk(desk), request)));
            }
            _ => self.left_out += 1,
        }
    }

    /// Of stops that overlap, only the last end continues the part.
    fn continue_late(&mut self) {
        let mut stops: Vec<(Part, u64, u64)> = Vec::new();
        let (signals, others) = std::mem::take(&mut self.steps)
            .into_iter()
            .partition::<Vec<_>, _>(|step| matches!(step.action, ScriptAction::Stop(_) | ScriptAction::Continue(_)));
        for pair in signals.chunks_exact(2) {
            let (ScriptAction::Stop(part), [from_ns, to_ns]) = (pair[0].action, [pair[0].at_ns, pair[1].at_ns]) else {
                unreachable!("a stop is followed by its end")
            };
            match stops.iter_mut().rev().find(|(other, ..)| *other == part) {
                Some((_, _, end_ns)) if *end_ns >= from_ns => *end_ns = to_ns.max(*end_ns),
                _ => stops.push((part, from_ns, to_ns)),
            }
        }
        self.steps = others;
        for (part, from_ns, to_ns) in stops {
            self.steps.push(ScriptStep { at_ns: from_ns, action: ScriptAction::Stop(part) });
            self.steps.push(ScriptStep { at_ns: to_ns, action: ScriptAction::Continue(part) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;

    #[test]
    fn overlapping_stops_end_once_and_the_rest_keeps_its_order() {
        let stop = |at_ns, ns| Fault { at_ns, kind: FaultKind::Stop(Part::Server, ns) };
        let faults = vec![
            stop(10, 50),
            Fault { at_ns: 20, kind: FaultKind::Command(Operator::Tool, Request::Hold) },
            stop(30, 10),
            Fault { at_ns: 35, kind: FaultKind::PowerLoss },
            stop(100, 5),
        ];
        let seed =
            (1..100).find(|&seed| !Scenario::plain(seed, 0.0).flags.timecode).expect("some seeds have no timecode");
        let script = Scenario { faults, length_ns: 200, ..Scenario::plain(seed, 0.0) }.script().expect("no timecode");
        let steps: Vec<(u64, ScriptAction)> = script.steps.iter().map(|step| (step.at_ns, step.action)).collect();
        let (stop, go_on) = (ScriptAction::Stop(Part::Server), ScriptAction::Continue(Part::Server));
        let hold = ScriptAction::Command(Operator::Tool, Request::Hold);
        assert_eq!(steps, [(10, stop), (20, hold), (60, go_on), (100, stop), (105, go_on)]);
        assert_eq!(script.left_out, 1);
    }
}
