//! Removes the nodes of killed processes while other processes are in the domain.
//!
//! iceoryx2 0.10 removes a dead node in many steps, and a process can be killed between any two of them. iceoryx2 itself
//! cannot recover from two of the resulting states. A port without its tag keeps its entry in the service permanently;
//! such entries finally prevent new servers from starting. A node without its monitoring file is not found again. In
//! addition, iceoryx2 waits one second per service for another process that is removing a node, even if that process is
//! stopped.
//!
//! So iceoryx2's own clean-ups are disabled ([`Domain::iceoryx2_config`]), and each member that joins removes dead nodes
//! here:
//!
//! 1. The member takes the exclusive lock of a journal, one file per dead node. If another process holds the lock, that
//!    process is removing the node, or is stopped while it does; the member continues without it. The kernel drops the
//!    lock of a killed process.
//! 2. The member writes the node's port tags into the journal before it removes anything.
//! 3. iceoryx2 removes the node.
//! 4. The member removes the journal.
//!
//! An unlocked journal belongs to a process that was killed between steps 2 and 4. The next member restores the missing
//! tags and monitoring files and continues with step 3. iceoryx2 skips everything that is already removed.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use iceoryx2::node::{NodeCleanupFailure, NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, Node};

use super::domain_error::DomainError;
use super::half_made_segments::settle;
use super::lock_file::{if_there, is_at};
use super::place::Domain;
use crate::wire::services::Service;

/// Last line of a completely written journal.
const END: &str = "end";
/// Length limit of a journal in bytes. It allows some thousand tags; a node has tens.
const MAX_JOURNAL_LEN: u64 = 1 << 20;
/// Modes of iceoryx2's files.
const READ_ONLY: u32 = 0o400;
const READ_WRITE: u32 = 0o600;

/// Entry of a process in a domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeEntry {
    /// Name under which the process joined; empty where its entry cannot be read.
    pub name: String,
    /// Process id, where the entry can be read.
    pub pid: Option<u32>,
}

impl NodeEntry {
    pub(crate) fn of(node: &impl NodeView) -> Self {
        let details = node.details().as_ref();
        Self {
            name: details.map_or_else(String::new, |details| details.name().to_string()),
            pid: details.and_then(|details| u32::try_from(details.process_id().value()).ok()),
        }
    }

    /// Whether this is a process whose end an operator must see: a source, a monitor, a recorder, a bridge, or a supervisor.
    pub(crate) fn is_part_of_show(&self) -> bool {
        ["serve", "replay", "monitor", "record", "bridge-", "show"].iter().any(|part| self.name.starts_with(part))
    }
}

/// Removes the dead nodes that are to be removed and that no other process is removing. Returns the removed ones.
///
/// # Errors
/// [`DomainError::Io`] where the domain's directory cannot be written.
pub(crate) fn remove_dead_nodes(
    domain: &Domain,
    is_removed: impl Fn(&NodeEntry) -> bool,
) -> Result<Vec<NodeEntry>, DomainError> {
    settle(domain);
    remove_each(domain, is_removed).map_err(|error| DomainError::Io { path: domain.root().to_owned(), error })
}

fn remove_each(domain: &Domain, is_removed: impl Fn(&NodeEntry) -> bool) -> io::Result<Vec<NodeEntry>> {
    for id in ids_of_journals(domain)? {
        // Opening a journal restores the node's missing files, so that the node is listed. Only one journal is locked at
        // a time, so a stopped process blocks at most one node.
        drop(Journal::open(domain, &id)?);
    }
    let mut removed = Vec::new();
    for state in list(domain) {
        let NodeState::Dead(node) = state else { continue };
        let (id, entry) = (node.id().value().to_string(), NodeEntry::of(&node));
        if !is_removed(&entry) {
            continue;
        }
        let Some(journal) = Journal::open(domain, &id)? else { continue };
        match node.try_remove_stale_resources() {
            Ok(()) => removed.push(entry),
            Err(NodeCleanupFailure::ResourcesAlreadyCleanedUp) => {}
            // The journal remains, and the next member tries again.
            Err(_) => continue,
        }
        journal.finish()?;
    }
    Ok(removed)
}

/// Returns all nodes of a domain.
pub(crate) fn list(domain: &Domain) -> Vec<NodeState<Service>> {
    let mut nodes = Vec::new();
    // Listing fails only where the directory of nodes does not exist.
    let _ = Node::<Service>::list(&domain.iceoryx2_config(), |node| {
        nodes.push(node);
        CallbackProgression::Continue
    });
    nodes
}

fn ids_of_journals(domain: &Domain) -> io::Result<Vec<String>> {
    let prefix = journal_prefix(domain);
    let mut ids = Vec::new();
    for entry in fs::read_dir(domain.root())? {
        let name = entry?.file_name();
        ids.extend(name.to_str().and_then(|name| name.strip_prefix(&prefix)).map(str::to_owned));
    }
    Ok(ids)
}

/// By the domain's prefix, so that it is swept away with the domain.
fn journal_prefix(domain: &Domain) -> String {
    format!("{}cleaning-", domain.prefix())
}

/// Journal of one dead node. While it exists, only this process removes that node.
struct Journal {
    path: PathBuf,
    // Closing the file drops the lock.
    _file: File,
    node: NodeFiles,
}

impl Journal {
    /// Does steps 1 and 2, and restores the files that a killed process had removed. Returns `None` if another process
    /// removes the node, or has just removed it.
    fn open(domain: &Domain, id: &str) -> io::Result<Option<Self>> {
        let path = domain.root().join(format!("{}{id}", journal_prefix(domain)));
        let mut options = OpenOptions::new();
        let mut file = options.read(true).write(true).create(true).truncate(false).mode(READ_WRITE).open(&path)?;
        if file.try_lock().is_err() || !is_at(&file, &path)? {
            return Ok(None);
        }
        let node = NodeFiles::of(domain, id);
        let mut text = String::new();
        (&file).take(MAX_JOURNAL_LEN).read_to_string(&mut text)?;
        let tags: Vec<&str> = text.lines().collect();
        if let Some((&END, tags)) = tags.split_last() {
            node.restore(tags)?;
        } else {
            // Nothing has been removed yet.
            file.set_len(0)?;
            io::Seek::rewind(&mut file)?;
            let tags: String = node.port_tags()?.into_iter().map(|tag| tag + "\n").collect();
            file.write_all(format!("{tags}{END}\n").as_bytes())?;
        }
        let journal = Self { path, _file: file, node };
        if journal.node.is_removed()? {
            journal.finish()?;
            return Ok(None);
        }
        Ok(Some(journal))
    }

    /// Does step 4, and removes the files that a killed process may have left of a removed node.
    fn finish(self) -> io::Result<()> {
        self.node.remove_rest()?;
        if_there(fs::remove_file(self.path)).map(drop)
    }
}

/// iceoryx2's files of one node.
struct NodeFiles {
    /// The node's own directory, with its details and its tags.
    directory: PathBuf,
    details: PathBuf,
    /// Monitoring files, in the order of creation. Other processes use them to detect whether the node's process lives.
    context: PathBuf,
    owner_lock: PathBuf,
    monitor: PathBuf,
}

impl NodeFiles {
    fn of(domain: &Domain, id: &str) -> Self {
        let (nodes, prefix) = (domain.root().join("nodes"), domain.prefix());
        let monitor = |suffix: &str| nodes.join(format!("{prefix}{id}.node_monitor{suffix}"));
        let directory = nodes.join(id);
        Self {
            details: directory.join(format!("{prefix}node.details")),
            directory,
            context: monitor("_context"),
            owner_lock: monitor("_owner_lock"),
            monitor: monitor(""),
        }
    }

    /// Whether iceoryx2 has removed everything of the node. The details are removed last, except the directory and the
    /// monitoring files.
    fn is_removed(&self) -> io::Result<bool> {
        Ok(!self.details.try_exists()?)
    }

    fn port_tags(&self) -> io::Result<Vec<String>> {
        let Some(entries) = if_there(fs::read_dir(&self.directory))? else { return Ok(Vec::new()) };
        let mut tags = Vec::new();
        for entry in entries {
            let name = entry?.file_name();
            tags.extend(name.to_str().filter(|name| name.ends_with(".port_tag")).map(str::to_owned));
        }
        Ok(tags)
    }

    /// Restores the removed files of a node that still exists.
    fn restore(&self, tags: &[&str]) -> io::Result<()> {
        /// Process id that iceoryx2 reads from the context file: 16 bytes. Zeros are the id of no process.
        const NO_PROCESS: [u8; 16] = [0; 16];
        if self.is_removed()? {
            return Ok(());
        }
        for tag in tags {
            make(&self.directory.join(tag), &[], READ_ONLY)?;
        }
        make(&self.context, &NO_PROCESS, READ_ONLY)?;
        make(&self.owner_lock, &[], READ_WRITE)?;
        make(&self.monitor, &[], READ_WRITE)
    }

    /// Removes the remaining files of a removed node.
    fn remove_rest(&self) -> io::Result<()> {
        for path in [&self.monitor, &self.owner_lock, &self.context] {
            if_there(fs::remove_file(path))?;
        }
        if_there(fs::remove_dir_all(&self.directory)).map(drop)
    }
}

/// Creates a file, unless it exists.
fn make(path: &Path, content: &[u8], mode: u32) -> io::Result<()> {
    match OpenOptions::new().write(true).create_new(true).mode(mode).open(path) {
        Ok(mut file) => file.write_all(content),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
        Err(error) => Err(error),
    }
}
