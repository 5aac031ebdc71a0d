//! The findings of the checks, and their judgement.

use clap::builder::styling::{AnsiColor, Style};
use serde::{Deserialize, Serialize};

use crate::output::Counted;
use crate::output::report::{self, Weight};

/// The findings of all checks.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Examination {
    pub(super) checks: Vec<Examined>,
    /// The removed nodes and files, one line each.
    pub(super) fixed: Vec<String>,
    /// Whether no check found a problem.
    pub(super) healthy: bool,
}

/// A check and its finding.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Examined {
    pub(super) name: String,
    #[serde(flatten)]
    pub(super) finding: Finding,
}

/// The judgement of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Verdict {
    Ok,
    /// A show runs, but may be disturbed.
    Warning,
    /// A show does not run.
    Problem,
    /// The machine does not report the fact, or this user has no right to read it.
    NotKnown,
}

/// The result of a check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Finding {
    pub(super) status: Verdict,
    /// The fact, as the system reports it.
    pub(super) value: String,
    /// The meaning of the fact.
    pub(super) message: String,
    /// The remedy for a warning or a problem.
    pub(super) remedy: Option<String>,
}

impl Examination {
    pub(super) fn new(checks: Vec<Examined>, fixed: Vec<String>) -> Self {
        let healthy = checks.iter().all(|check| check.finding.status != Verdict::Problem);
        Self { checks, fixed, healthy }
    }

    /// The findings in a sentence: whether a show may begin.
    pub(super) fn verdict(&self) -> report::Verdict {
        let count = |status| self.checks.iter().filter(|check| check.finding.status == status).count() as u64;
        let [ok, warnings, problems, unknown] =
            [Verdict::Ok, Verdict::Warning, Verdict::Problem, Verdict::NotKnown].map(count);
        let (weight, word) = match (problems, warnings) {
            (0, 0) => (Weight::Good, "Ready"),
            (0, _) => (Weight::Attention, "Ready, with warnings"),
            _ => (Weight::Danger, "Not ready"),
        };
        let (problems, warnings) = (Counted(problems, "problem"), Counted(warnings, "warning"));
        let words = format!("{word}: {problems}, {warnings}, {ok} ok, {unknown} not known.");
        report::Verdict { weight, words }
    }
}

impl Verdict {
    /// The verdict's word and its style in the report.
    pub(super) fn shown(self) -> (&'static str, Style) {
        match self {
            Self::Ok => ("ok", AnsiColor::Green.on_default()),
            Self::Warning => ("warning", AnsiColor::Yellow.on_default()),
            Self::Problem => ("problem", AnsiColor::Red.on_default().bold()),
            Self::NotKnown => ("not known", Style::new().dimmed()),
        }
    }
}

impl Finding {
    pub(super) fn ok(value: impl Into<String>, message: impl Into<String>) -> Self {
        Self { status: Verdict::Ok, value: value.into(), message: message.into(), remedy: None }
    }

    pub(super) fn not_known(message: impl Into<String>) -> Self {
        Self { status: Verdict::NotKnown, value: String::new(), message: message.into(), remedy: None }
    }

    pub(super) fn warning(value: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (value, message, remedy) = (value.into(), message.into(), Some(remedy.into()));
        Self { status: Verdict::Warning, value, message, remedy }
    }

    pub(super) fn problem(value: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { status: Verdict::Problem, ..Self::warning(value, message, remedy) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_leaves_a_show_ready_and_a_problem_does_not() {
        let verdict = |findings: &[Finding]| {
            let examined = |finding: &Finding| Examined { name: "x".to_owned(), finding: finding.clone() };
            Examination::new(findings.iter().map(examined).collect(), Vec::new()).verdict()
        };
        let (ok, unknown) = (Finding::ok("1", "fine"), Finding::not_known("hidden"));
        let (warning, problem) = (Finding::warning("2", "slow", "wait"), Finding::problem("3", "broken", "fix"));
        let good = verdict(&[ok.clone(), unknown.clone()]);
        assert_eq!((good.weight, &*good.words), (Weight::Good, "Ready: 0 problems, 0 warnings, 1 ok, 1 not known."));
        let attention = verdict(&[ok.clone(), warning.clone()]);
        assert_eq!(attention.weight, Weight::Attention);
        assert_eq!(attention.words, "Ready, with warnings: 0 problems, 1 warning, 1 ok, 0 not known.");
        let danger = verdict(&[ok, warning, problem, unknown]);
        assert_eq!((danger.weight, &danger.words[..9]), (Weight::Danger, "Not ready"));
    }
}
