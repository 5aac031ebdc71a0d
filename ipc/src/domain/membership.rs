//! Membership of a domain. Every membership holds a shared lock (`flock`) on one file of the domain's directory,
//! `members.lock`. The first member to join and the last to leave remove everything that killed processes have left, and
//! everything that iceoryx2 itself never removes.
//!
//! The lock belongs to an open file, so two memberships of one process hold one lock each. The kernel drops the lock with
//! the file, also if the process is killed.
//!
//! # Why the last member to leave is always found
//!
//! 1. A membership outlasts everything that its process has opened on the bus through it.
//!    [`Member`](crate::service::Member) and [`Frame`](crate::Frame) drop their node, ports and samples before their
//!    share of it. So a process without a lock has no node.
//! 2. A leaving member tries for the exclusive lock, without waiting. The kernel does not convert a lock in one step: it
//!    drops the shared lock, then looks for other holders. So after a refused attempt the shared lock is dropped too. If
//!    several members try at the same time, the last attempt finds no lock of the others. The exception is a member that
//!    has obtained the exclusive lock.
//! 3. A refused attempt means that another open file holds the lock at that moment. If its process lives, its membership
//!    still has to do step 2, or has obtained the lock. Then this member is not the last, and has finished.
//! 4. If the holder's process is ending, it never does step 2. A killed process does nothing any more, but holds its lock
//!    until the kernel closes its files. This member waits for that, and tries again.
//! 5. A successful attempt may lock a file that another member has removed, together with the domain. Then nothing is
//!    left to do; the path may even belong to a new domain. So the file is compared with the path before anything is
//!    removed.
//! 6. Otherwise no other open file holds the lock, and by step 1 no other member has a node. A living node then belongs to
//!    a client without our lock, such as a stock iceoryx2 client. The domain is kept for it, and the next process to join
//!    finds the remains.
//! 7. Otherwise no other member is in the domain, and it is removed while the lock is held. A process that joins at the same
//!    time waits for the lock. By the comparison of step 5 it finds that its file was removed, and opens a new one.
//!
//! So the last of all leaving members removes the domain, even if others were killed before.
//!
//! # Joining
//!
//! A joining member takes the shared lock, tries for the exclusive one, sweeps if it is alone, and takes the shared lock
//! again. Between two of these steps it holds no lock, and another process may remove the domain. So the comparison of
//! step 5 comes last.

use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::mem;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::node::NodeView as _;
use iceoryx2::prelude::{CallbackProgression, Node, NodeState};

use super::domain_error::DomainError;
use super::forks::{ClosedInChildren, Process};
use super::lock_file::{is_at, lock_at};
use super::lock_holders::{self, Holders};
use super::place::Domain;
use super::shortage::SHARED_MEMORY;
use super::sweep::{dissolve, sweep};
use crate::wire::services::Service;

/// Timeout of a leaving member for processes that are ending, and of a joining member for a sweep: much longer than
/// either takes.
const END_TIMEOUT: Duration = Duration::from_secs(10);
/// Timeout of a leaving member for holders that this process cannot see.
const UNSEEN_TIMEOUT: Duration = Duration::from_millis(20);
const TRY_PERIOD: Duration = Duration::from_millis(1);

/// One membership; ends when it is dropped.
#[derive(Debug)]
pub(crate) struct Membership {
    domain: Domain,
    file: Option<File>,
    process: Process,
    in_children: Option<ClosedInChildren>,
}

/// Other processes in a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OtherMembers {
    /// None; this member holds the exclusive lock.
    Nobody,
    /// At least one lives, and will leave after this member.
    Living,
    /// At least one is ending.
    Ending,
    /// There are some, but this process cannot see which.
    Unseen,
    /// The domain has been removed.
    Removed,
}

impl Membership {
    /// Joins a domain whose directory exists. Waits only while another process sweeps, at most ten seconds.
    pub(crate) fn join(domain: &Domain) -> Result<Self, DomainError> {
        // Checked before the lock file is created: retries would not make a missing directory appear.
        fs::metadata(SHARED_MEMORY).map_err(|error| DomainError::Io { path: SHARED_MEMORY.into(), error })?;
        let path = lock_path(domain);
        let join = |file: &mut File| {
            share(file, &path)?;
            if others(file, domain) == OtherMembers::Nobody {
                sweep(domain)?;
            }
            share(file, &path)
        };
        let failed = |error| DomainError::Io { path: path.clone(), error };
        let file = lock_at(&path, failed, join).map_err(|error| match error {
            DomainError::Io { error, .. } if error.kind() == ErrorKind::NotFound => {
                DomainError::Missing { path: domain.root().to_owned() }
            }
            error => error,
        })?;
        let (process, in_children) = (Process::this(), ClosedInChildren::new(&file));
        Ok(Self { domain: domain.clone(), file: Some(file), process, in_children: Some(in_children) })
    }

    /// The domain.
    pub(crate) fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Does steps 2 to 7. The next process to join sweeps any remains.
    fn leave(&self, file: &File) {
        let begun = Instant::now();
        loop {
            let timeout = match others(file, &self.domain) {
                OtherMembers::Nobody => {
                    let _ = dissolve(&self.domain, &lock_path(&self.domain));
                    return;
                }
                OtherMembers::Living | OtherMembers::Removed => return,
                OtherMembers::Ending => END_TIMEOUT,
                OtherMembers::Unseen => UNSEEN_TIMEOUT,
            };
            if begun.elapsed() > timeout {
                return;
            }
            thread::sleep(TRY_PERIOD);
        }
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        let (file, in_children) = (self.file.take(), self.in_children.take());
        if self.process.is_this() {
            if let Some(file) = &file {
                self.leave(file);
            }
        } else {
            // A forked child is no member, and has closed the file.
            mem::forget((file, in_children));
        }
    }
}

fn lock_path(domain: &Domain) -> PathBuf {
    domain.root().join("members.lock")
}

/// Takes the shared lock. A sweeping process holds the exclusive lock for some milliseconds, unless it is stopped.
fn share(file: &File, path: &Path) -> Result<(), DomainError> {
    let begun = Instant::now();
    loop {
        match file.try_lock_shared() {
            Ok(()) => return Ok(()),
            Err(TryLockError::WouldBlock) if begun.elapsed() < END_TIMEOUT => thread::sleep(TRY_PERIOD),
            Err(TryLockError::WouldBlock) => {
                let pid = lock_holders::pids(file).ok().and_then(|pids| pids.first().copied());
                return Err(DomainError::Held { path: path.to_owned(), pid });
            }
            Err(TryLockError::Error(error)) => return Err(DomainError::Io { path: path.to_owned(), error }),
        }
    }
}

/// Returns which other processes are in the domain. Tries for the exclusive lock; a refused attempt drops the shared one.
fn others(file: &File, domain: &Domain) -> OtherMembers {
    match file.try_lock() {
        Ok(()) => match is_at(file, &lock_path(domain)) {
            Ok(true) => owners_of_nodes(domain),
            Ok(false) => OtherMembers::Removed,
            Err(_) => OtherMembers::Living,
        },
        Err(_) => match Holders::of(file) {
            Holders::Living => OtherMembers::Living,
            Holders::Ending => OtherMembers::Ending,
            Holders::Unseen => OtherMembers::Unseen,
        },
    }
}

/// Step 6: returns whether other processes have a living node.
fn owners_of_nodes(domain: &Domain) -> OtherMembers {
    let mut others = OtherMembers::Nobody;
    let listed = Node::<Service>::list(&domain.iceoryx2_config(), |state| {
        let living = match &state {
            NodeState::Alive(node) => {
                let pid = node.details().as_ref().and_then(|details| details.process_id().value().try_into().ok());
                !pid.is_some_and(lock_holders::is_ending)
            }
            NodeState::Inaccessible(_) => true,
            NodeState::Dead(_) | NodeState::Undefined(_) => return CallbackProgression::Continue,
        };
        others = if living { OtherMembers::Living } else { OtherMembers::Ending };
        if living { CallbackProgression::Stop } else { CallbackProgression::Continue }
    });
    match listed {
        Ok(()) => others,
        // A signal may have interrupted the listing. The caller retries for a limited time.
        Err(_) => OtherMembers::Unseen,
    }
}
