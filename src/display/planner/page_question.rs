//! A question of the page: a text, perhaps with an edit of it, a plan time, and the saved version to compare with.

use serde::Deserialize;

use super::edit::Edit;

/// A question. Its answers have its number.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PageQuestion {
    pub(super) number: u64,
    /// The configuration; without it, the one of the last answer.
    #[serde(default)]
    pub(super) text: Option<String>,
    #[serde(default)]
    pub(super) edit: Option<Edit>,
    /// Plan time of the dragons that are drawn; without it, the first contact, or the end.
    #[serde(default)]
    pub(super) at_s: Option<f64>,
    /// The saved version, drawn beside the plan from now on; an empty text ends that.
    #[serde(default)]
    pub(super) saved: Option<String>,
}

impl PageQuestion {
    /// This question in the place of an older one that was not answered. Texts that are new in the older one stay new.
    pub(super) fn after(self, older: Self) -> Self {
        let saved = self.saved.or(older.saved);
        if self.text.is_some() {
            return Self { saved, ..self };
        }
        Self { text: older.text, edit: older.edit, saved, ..self }
    }
}
