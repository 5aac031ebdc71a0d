//! The table `[stage]`, not yet checked.

use bench_dragon_geometry::outline::Outline;
use serde::{Deserialize, Serialize};

use super::ConfigError;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct StageTable {
    /// Corners of the stage, in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    outline: Option<Vec<[f64; 2]>>,
}

impl StageTable {
    pub(super) fn is_empty(&self) -> bool {
        self.outline.is_none()
    }

    /// The outline of the stage, if there is one.
    ///
    /// # Errors
    /// The outline is not a simple polygon.
    pub(super) fn outline(&self) -> Result<Option<Outline>, ConfigError> {
        let outline = self.outline.as_deref().map(Outline::new).transpose();
        outline.map_err(|error| ConfigError(format!("[stage] outline {error}")))
    }
}
