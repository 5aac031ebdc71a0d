//! Lists the processes and files of a domain from outside. A census joins, creates and removes nothing, so it does not affect
//! a running show. It tries the source's lock only where the holder is not a process of this PID namespace. [`clear`]
//! removes, under the domain's locks, everything that no living process owns.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use iceoryx2::node::NodeState;

use super::bus_error::BusError;
use super::dead_nodes::{NodeEntry, list as list_nodes, remove_dead_nodes};
use super::domain_error::DomainError;
use super::membership::Membership;
use super::place::Domain;
use super::service_layout::{ServiceLayout, service_layouts};
use super::shortage::SHARED_MEMORY;
use super::source_lock::{self, SourceLock};
use super::sweep::foreign_owner;

/// Contents of a domain at one moment. They may have changed since.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Process id of the source, where one runs in this PID namespace.
    pub source: Option<u32>,
    /// Whether a source runs, also in another PID namespace, such as a container.
    pub has_source: bool,
    /// Nodes of running processes.
    pub living: Vec<NodeEntry>,
    /// Nodes of processes that were killed. The next process to join removes them.
    pub dead: Vec<NodeEntry>,
    /// Number of nodes that this user may not inspect, so that it is unknown whether they live.
    pub unknown: usize,
    /// Service files that are not finished. A running source is creating them; without a source, a killed one left them.
    /// Clients fail on them; a new source removes them first.
    pub half_made: Vec<PathBuf>,
    /// All files and directories of the domain on this machine.
    pub entries: Vec<PathBuf>,
    /// Files of other users in shared memory whose names begin with the domain's prefix. They do not affect the domain.
    pub foreign: Vec<ForeignFile>,
    /// Layouts of the existing services.
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

/// Entries and files that [`clear`] removed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cleared {
    /// Entries of killed processes.
    pub nodes: Vec<NodeEntry>,
    /// Files and directories.
    pub paths: Vec<PathBuf>,
}

impl Census {
    /// Lists the contents of a domain.
    ///
    /// # Errors
    /// As [`Domain::check_directory`], except [`DomainError::Missing`]: without a directory the census is that of an
    /// empty domain.
    pub fn take(domain: &Domain) -> Result<Self, DomainError> {
        let (entries, foreign) = entries(domain);
        match domain.check_directory() {
            Ok(()) => {}
            Err(DomainError::Missing { .. }) => return Ok(Self { entries, foreign, ..Self::default() }),
            Err(error) => return Err(error),
        }
        let source = SourceLock::holder(domain);
        let mut census = Self {
            source,
            has_source: source.is_some() || SourceLock::is_held(domain),
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

    /// Whether no process is in the domain, so that killed processes left all of its entries.
    pub fn is_deserted(&self) -> bool {
        !self.has_source && self.living.is_empty() && self.unknown == 0
    }
}

/// Removes from a domain everything that no living process owns, and returns it. Entries of killed processes are always
/// removed, half-made services where no source runs, and everything where no process is in the domain.
///
/// The domain's own locks decide which processes live, so a process that joins at the same time loses nothing. While this
/// function looks for half-made services, a source that starts receives [`BusError::SourceRunning`].
///
/// # Errors
/// [`BusError::Domain`] where the directory is not usable or a file cannot be removed, [`BusError::TooFewFiles`] where
/// the limit of open files is too low.
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
            // The running source is creating these files.
            Err(BusError::SourceRunning { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    domain
        .set_fallback_configuration()
        .map_err(|error| DomainError::Io { path: domain.iceoryx2_toml_path(), error })?;
    cleared.nodes = remove_dead_nodes(domain, |_| true)?;
    drop(membership);
    if before.is_deserted() {
        // This process was the only member, so leaving has removed everything.
        cleared.nodes = before.dead;
        cleared.paths = before.entries.into_iter().filter(|path| !path.exists()).collect();
    }
    Ok(cleared)
}

/// Returns all shared memory with the domain's prefix and the domain's directory with its contents; separately, the files
/// of other users with that prefix.
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
