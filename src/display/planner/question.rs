//! A question of the page: a text, perhaps with an edit of it, and a plan time.

use serde::Deserialize;

use super::edit::Edit;

/// A question. Its answers have its number.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Question {
    pub(super) number: u64,
    /// The configuration; without it, the one of the last answer.
    #[serde(default)]
    pub(super) text: Option<String>,
    #[serde(default)]
    pub(super) edit: Option<Edit>,
    /// Plan time of the dragons that are drawn; without it, the first contact, or the end.
    #[serde(default)]
    pub(super) at_s: Option<f64>,
}

impl Question {
    /// This question in the place of an older one that was not answered. A text that is new in the older one stays new.
    pub(super) fn after(self, older: Self) -> Self {
        if self.text.is_some() {
            return self;
        }
        Self { text: older.text, edit: older.edit, ..self }
    }
}
