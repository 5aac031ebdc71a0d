//! A configuration of one dragon or of several.

use std::path::Path;

use super::document::{Document, parse, read_document};
use super::{Config, ConfigDocument, ConfigError, FormationDocument};

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
        let mut tables = path.map_or_else(|| Ok(Document::default()), |path| parse(&read_document(path)?))?;
        set_flags(&mut tables);
        let folder = path.and_then(Path::parent).unwrap_or(Path::new(""));
        Self::of_tables(tables, folder, placing_steps)
    }

    /// Parses the text of a description.
    ///
    /// # Errors
    /// The text or a value is not valid, or a dragon of several does not fit on its route.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        let tables = parse(text)?;
        if tables.dragons.is_none() {
            return ConfigDocument::check(tables).map(|document| Self::OneDragon(Box::new(document)));
        }
        FormationDocument::build(tables, Path::new(""), None).map(Self::Formation)
    }

    /// The same with a limit of steps for placing each dragon, as for [`load`](Self::load).
    ///
    /// # Errors
    /// As for [`from_toml`](Self::from_toml).
    pub fn from_toml_within(text: &str, placing_steps: u64) -> Result<Self, ConfigError> {
        Self::of_tables(parse(text)?, Path::new(""), Some(placing_steps))
    }

    /// Parses the text of a file in a folder, as [`load`](Self::load) reads the file.
    ///
    /// # Errors
    /// As for [`load`](Self::load).
    pub fn of_file_text(text: &str, folder: &Path) -> Result<Self, ConfigError> {
        Self::of_tables(parse(text)?, folder, None)
    }

    /// Places the dragon on its route, and computes how far it can walk. Those of a formation have been placed.
    ///
    /// # Errors
    /// The route is not valid, or the dragon does not fit on it.
    pub fn build(self) -> Result<Config, ConfigError> {
        match self {
            Self::OneDragon(document) => document.build(),
            Self::Formation(formation) => Ok(Config::of_formation(formation)),
        }
    }

    fn of_tables(tables: Document, folder: &Path, placing_steps: Option<u64>) -> Result<Self, ConfigError> {
        if tables.dragons.is_some() {
            return FormationDocument::build(tables, folder, placing_steps).map(Self::Formation);
        }
        let document = ConfigDocument::of_tables(tables, folder)?;
        let document = placing_steps.into_iter().fold(document, ConfigDocument::with_placing_steps);
        Ok(Self::OneDragon(Box::new(document)))
    }
}
