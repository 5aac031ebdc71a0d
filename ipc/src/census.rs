//! Who and what is in a domain, found out from outside: a census joins nothing, makes nothing, locks nothing and removes
//! nothing, so a running show does not notice it. [`clear`] removes, under the domain's locks, what no living process
//! owns.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use iceoryx2::node::{NodeState, NodeView};

use crate::dead_nodes::{list as list_nodes, remove_dead_nodes};
use crate::domain::Domain;
use crate::domain_error::DomainError;
use crate::error::BusError;
use crate::membership::Membership;
use crate::service_layout::{ServiceLayout, service_layouts};
use crate::source_lock::{self, SourceLock};
use crate::sweep::{SHARED_MEMORY, foreign_owner};

/// What a look at a domain has found. The domain may have changed since.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Process id of the source, where one runs.
    pub source: Option<u32>,
    /// Nodes of running processes.
    pub living: Vec<NodeEntry>,
    /// Nodes of processes that were killed. The next process to join removes them.
    pub dead: Vec<NodeEntry>,
    /// Nodes of which this user cannot tell whether they live.
    pub unknown: usize,
    /// Service files that were begun and not finished: by the source, where one runs, else by one that was killed. Clients
    /// fail at them; a new source removes them first.
    pub half_made: Vec<PathBuf>,
    /// Everything of the domain that is on the machine.
    pub entries: Vec<PathBuf>,
    /// Files of other users in shared memory whose names begin as the domain's do. They are in nobody's way.
    pub foreign: Vec<ForeignFile>,
    /// How the services that are there are laid out.
    pub services: Vec<ServiceLayout>,
}

/// A file of another user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ForeignFile {
    /// Its path.
    pub path: PathBuf,
    /// Its owner.
    pub owner: u32,
}

/// A process's entry in a domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeEntry {
    /// The name that it joined under; empty where its entry cannot be read.
    pub name: String,
    /// Its process id, where its entry can be read.
    pub pid: Option<u32>,
}

/// What [`clear`] has removed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cleared {
    /// Entries of killed processes.
    pub nodes: Vec<NodeEntry>,
    /// Files and directories.
    pub paths: Vec<PathBuf>,
}

impl Census {
    /// Looks at a domain.
    ///
    /// # Errors
    /// As [`Domain::check_directory`], but for a directory that is missing: then nobody is there.
    pub fn take(domain: &Domain) -> Result<Self, DomainError> {
        let (entries, foreign) = entries(domain);
        match domain.check_directory() {
            Ok(()) => {}
            Err(DomainError::Missing { .. }) => return Ok(Self { entries, foreign, ..Self::default() }),
            Err(error) => return Err(error),
        }
        let mut census = Self {
            source: SourceLock::holder(domain),
            half_made: source_lock::half_made(domain).unwrap_or_default(),
            entries,
            foreign,
            services: service_layouts(domain),
            ..Self::default()
        };
        for node in list_nodes(domain) {
            match node {
                NodeState::Alive(node) => census.living.push(NodeEntry::of(&node)),
                NodeState::Dead(node) => census.dead.push(NodeEntry::of(&node)),
                NodeState::Inaccessible(_) | NodeState::Undefined(_) => census.unknown += 1,
            }
        }
        Ok(census)
    }

    /// Whether nobody is in the domain, so that all of its entries are what killed processes have left.
    pub fn is_deserted(&self) -> bool {
        self.source.is_none() && self.living.is_empty() && self.unknown == 0
    }
}

impl NodeEntry {
    pub(crate) fn of(node: &impl NodeView) -> Self {
        let details = node.details().as_ref();
        Self {
            name: details.map_or_else(String::new, |details| details.name().to_string()),
            pid: details.and_then(|details| u32::try_from(details.process_id().value()).ok()),
        }
    }
}

/// Removes from a domain what no living process owns, and says what that was: the entries of killed processes; where no
/// source runs, services that were left half made; where nobody is, everything.
///
/// The domain's own locks decide who lives, so a process that joins meanwhile loses nothing. While this looks for half-made
/// services a source that starts is told that another one runs.
///
/// # Errors
/// What is wrong with the directory, or what cannot be removed.
pub fn clear(domain: &Domain) -> Result<Cleared, BusError> {
    let before = Census::take(domain)?;
    if before.entries.is_empty() {
        return Ok(Cleared::default());
    }
    domain.create_directory()?;
    let mut cleared = Cleared::default();
    let membership = Membership::join(domain)?;
    if !before.half_made.is_empty() {
        match SourceLock::take(domain) {
            Ok(lock) => cleared.paths.extend_from_slice(lock.cleared()),
            // Then the files are its own.
            Err(BusError::SourceRunning { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    domain
        .set_fallback_configuration()
        .map_err(|error| DomainError::Io { path: domain.iceoryx2_toml_path(), error })?;
    cleared.nodes = remove_dead_nodes(domain)?;
    drop(membership);
    if before.is_deserted() {
        // Whoever was alone has swept all of it away.
        cleared.nodes = before.dead;
        cleared.paths = before.entries.into_iter().filter(|path| !path.exists()).collect();
    }
    Ok(cleared)
}

/// Everything that bears the domain's prefix in shared memory, and the domain's directory with what is in it; beside it the
/// files of other users that bear the prefix.
fn entries(domain: &Domain) -> (Vec<PathBuf>, Vec<ForeignFile>) {
    let prefix = domain.prefix();
    let (mut entries, mut foreign) = (Vec::new(), Vec::new());
    for path in list(Path::new(SHARED_MEMORY)) {
        if !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&prefix)) {
            continue;
        }
        match foreign_owner(&path, domain) {
            Some(owner) => foreign.push(ForeignFile { path, owner }),
            None => entries.push(path),
        }
    }
    if !matches!(fs::symlink_metadata(domain.root()), Err(error) if error.kind() == ErrorKind::NotFound) {
        entries.extend(list(domain.root()));
        entries.push(domain.root().to_owned());
    }
    (entries, foreign)
}

fn list(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).map(|entries| entries.flatten().map(|entry| entry.path()).collect()).unwrap_or_default()
}
