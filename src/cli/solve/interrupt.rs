//! Ctrl-C while a question is answered: the searches end, and the answer is what they have found so far.

use std::path::Path;
use std::sync::OnceLock;

use anyhow::ensure;
use bench_dragon_geometry::dragon::Question;
use signal_hook::consts::SIGINT;
use signal_hook::flag;

use crate::output::terminal_text::Printable;
use crate::system::whole_file;

/// The question of this process.
static ASKED: OnceLock<Question> = OnceLock::new();

/// The question of this process. From the first call on, Ctrl-C cancels it, and a second Ctrl-C ends the process at once.
pub(super) fn question() -> &'static Question {
    ASKED.get_or_init(|| {
        let question = Question::default();
        // If the handlers cannot be set, Ctrl-C ends the process as before.
        let _ = flag::register_conditional_default(SIGINT, question.flag())
            .and_then(|_| flag::register(SIGINT, question.flag()));
        question
    })
}

/// Whether Ctrl-C has cancelled the question.
pub(super) fn is_cancelled() -> bool {
    ASKED.get().is_some_and(Question::is_cancelled)
}

/// The hint behind the reason of an early end. There is none after Ctrl-C.
pub(super) fn allows_more() -> &'static str {
    if is_cancelled() { "" } else { "; --work allows more" }
}

/// Why a part of an answer is unknown, for answers that have no reason of their own.
pub(super) fn early_end() -> &'static str {
    if is_cancelled() { "cancelled" } else { "the search takes too much work; --work allows more" }
}

/// Fails if the question was cancelled: a file is for a whole answer.
pub(super) fn require_whole(path: &Path) -> anyhow::Result<()> {
    ensure!(!is_cancelled(), "cancelled: {} is not written", Printable(path));
    Ok(())
}

/// Writes a file of a whole answer. Fails if the question was cancelled.
pub(super) fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    require_whole(path)?;
    whole_file::write(path, bytes)
}
