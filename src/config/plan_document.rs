//! A configuration of one dragon or of several.

use std::path::Path;

use super::document::{Document, parse, read};
use super::{ConfigDocument, ConfigError, FormationDocument};

/// A checked document of one dragon, or a configuration of several.
#[derive(Clone, Debug)]
pub enum PlanDocument {
    /// A document with the short form for one dragon.
    OneDragon(Box<ConfigDocument>),
    /// A document with `[[dragons]]`.
    Formation(FormationDocument),
}

impl PlanDocument {
    /// Reads a file, or uses the paper's dragon without a file. Then `set_flags` overrides values. `placing_steps`: as for
    /// [`ConfigDocument::with_placing_steps`].
    ///
    /// # Errors
    /// A file cannot be read, a value is not valid, a drawing has no path, or a dragon of several does not fit on its route.
    pub fn load(
        path: Option<&Path>,
        set_flags: impl FnOnce(&mut Document),
        placing_steps: Option<u64>,
    ) -> Result<Self, ConfigError> {
        let mut tables = path.map_or_else(|| Ok(Document::default()), |path| parse(&read(path)?))?;
        set_flags(&mut tables);
        let folder = path.and_then(Path::parent).unwrap_or(Path::new(""));
        if tables.dragons.is_some() {
            return FormationDocument::build(tables, folder, placing_steps).map(Self::Formation);
        }
        let document = ConfigDocument::of_tables(tables, folder)?;
        let document = placing_steps.into_iter().fold(document, ConfigDocument::with_placing_steps);
        Ok(Self::OneDragon(Box::new(document)))
    }
}
