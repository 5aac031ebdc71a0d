//! Removing the nodes of killed processes while others are in the domain.
//!
//! iceoryx2 0.10 removes a dead node in many steps, and a process can be killed between any two of them. Two of its states
//! cannot be finished by iceoryx2 itself: a port whose tag is gone and whose entry in the service is not keeps that entry for
//! ever, and so, in the end, keeps new servers out; and a node without its monitoring file is not found again. A node that
//! another process cleans up is waited for, a second in each service, also where that process is stopped.
//!
//! So iceoryx2's own clean-ups are turned off ([`Domain::iceoryx2_config`]), and a member that joins removes dead nodes here:
//!
//! 1. It takes the exclusive lock of a journal, a file for each dead node. Where another process has it, that one cleans up,
//!    or is stopped in it: this member goes on without. The kernel drops the lock of one that is killed.
//! 2. It writes the node's port tags into the journal, before anything is removed.
//! 3. iceoryx2 removes the node.
//! 4. It removes the journal.
//!
//! A journal that nobody has locked is of a process that was killed between 2 and 4. The next member makes the tags and the
//! monitoring files that are missing again, and begins at 3: iceoryx2 passes over what has been removed already.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use iceoryx2::node::{NodeCleanupFailure, NodeState, NodeView as _};
use iceoryx2::prelude::{CallbackProgression, Node};

use crate::census::NodeEntry;
use crate::domain::Domain;
use crate::domain_error::DomainError;
use crate::half_made_segments::settle;
use crate::lock_file::{if_there, is_at};
use crate::service::Service;

/// The last line of a journal that has been written to its end.
const END: &str = "end";
/// Longest journal that is read: some thousand tags, where a node has tens.
const MAX_JOURNAL_LEN: u64 = 1 << 20;
/// Who may read and write iceoryx2's files.
const READ_ONLY: u32 = 0o400;
const READ_WRITE: u32 = 0o600;

/// Removes all dead nodes that nobody else is removing. Returns those that are gone.
///
/// # Errors
/// What cannot be written in the domain's directory.
pub(crate) fn remove_dead_nodes(domain: &Domain) -> Result<Vec<NodeEntry>, DomainError> {
    settle(domain);
    remove_all(domain).map_err(|error| DomainError::Io { path: domain.root().to_owned(), error })
}

fn remove_all(domain: &Domain) -> io::Result<Vec<NodeEntry>> {
    for id in ids_of_journals(domain)? {
        // Only to make again what is missing, so that the node is listed. One journal at a time is locked: whoever is stopped
        // keeps others from one node at most.
        drop(Journal::open(domain, &id)?);
    }
    let mut removed = Vec::new();
    for state in list(domain) {
        let NodeState::Dead(node) = state else { continue };
        let (id, entry) = (node.id().value().to_string(), NodeEntry::of(&node));
        let Some(journal) = Journal::open(domain, &id)? else { continue };
        match node.try_remove_stale_resources() {
            Ok(()) => removed.push(entry),
            Err(NodeCleanupFailure::ResourcesAlreadyCleanedUp) => {}
            // The journal stays, and the next member tries again.
            Err(_) => continue,
        }
        journal.finish()?;
    }
    Ok(removed)
}

/// All nodes of a domain.
pub(crate) fn list(domain: &Domain) -> Vec<NodeState<Service>> {
    let mut nodes = Vec::new();
    // Where they cannot be listed there is no directory of them.
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

/// The journal of one dead node. This process alone removes that node until it is dropped.
struct Journal {
    path: PathBuf,
    // Closing the file drops the lock.
    _file: File,
    node: NodeFiles,
}

impl Journal {
    /// Steps 1 and 2, after whatever is needed to begin again. `None` where another process removes the node, or where it
    /// has just been removed.
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

    /// Step 4, with the files that a killed process may have left of a node that is gone.
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
    /// The files by which others see whether the node's process lives, in the order in which they are made.
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

    /// Whether iceoryx2 has removed all that belongs to the node: its details are the last, but for the directory and the
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

    /// Makes what has been removed of a node that is still there again.
    fn restore(&self, tags: &[&str]) -> io::Result<()> {
        /// iceoryx2 reads a process's number of so many bytes; zeros are that of no process.
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

    /// Removes what is left of a node that is gone.
    fn remove_rest(&self) -> io::Result<()> {
        for path in [&self.monitor, &self.owner_lock, &self.context] {
            if_there(fs::remove_file(path))?;
        }
        if_there(fs::remove_dir_all(&self.directory)).map(drop)
    }
}

/// Makes a file, unless it is there.
fn make(path: &Path, content: &[u8], mode: u32) -> io::Result<()> {
    match OpenOptions::new().write(true).create_new(true).mode(mode).open(path) {
        Ok(mut file) => file.write_all(content),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
        Err(error) => Err(error),
    }
}
