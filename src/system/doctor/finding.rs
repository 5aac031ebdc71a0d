//! What a check comes to.

use std::fmt;

use serde::Serialize;

/// How things stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As it should be.
    Ok,
    /// A show runs, and may run worse than it could.
    Warning,
    /// A show does not run.
    Problem,
    /// This machine, or this user's rights, do not let it be told.
    NotKnown,
}

impl fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Ok => "ok",
            Self::Warning => "warning",
            Self::Problem => "problem",
            Self::NotKnown => "not known",
        })
    }
}

/// What was found, what it means, and how to mend it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// How things stand.
    pub status: Verdict,
    /// What was found, as the system has it.
    pub value: String,
    /// What it means.
    pub message: String,
    /// How to mend it, where there is something to mend.
    pub remedy: Option<String>,
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
