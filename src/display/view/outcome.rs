//! The outcome of the show, which its supervisor reports to the view before both end.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tokio::sync::watch;
use tokio::time::timeout;

/// Longest wait of a closing view for the outcome.
const PATIENCE: Duration = Duration::from_secs(1);

/// Why the show ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShowOutcome {
    /// Kind of the ending, as in `summary.json`.
    pub kind: String,
    /// The ending in one sentence.
    pub text: String,
}

impl ShowOutcome {
    /// The outcome of a show whose process ended without reporting one.
    pub fn unreported() -> Self {
        Self { kind: "killed".to_owned(), text: "The process of the show was killed.".to_owned() }
    }

    /// Encodes the outcome for a page.
    pub(super) fn message(&self) -> Value {
        json!({ "type": "outcome", "kind": self.kind, "text": self.text })
    }
}

/// The outcome as far as a view knows it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum KnownOutcome {
    /// No supervisor reports one.
    #[default]
    Unreported,
    /// The supervisor will report it.
    Awaited,
    Known(ShowOutcome),
}

/// Returns the outcome for a closing stream. Waits a moment if it has yet to arrive.
pub(super) async fn last(outcome: &mut watch::Receiver<KnownOutcome>) -> Option<ShowOutcome> {
    let known = timeout(PATIENCE, outcome.wait_for(|outcome| *outcome != KnownOutcome::Awaited)).await;
    match known.ok()?.ok().as_deref()? {
        KnownOutcome::Known(outcome) => Some(outcome.clone()),
        KnownOutcome::Unreported | KnownOutcome::Awaited => None,
    }
}
