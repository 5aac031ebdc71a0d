//! Who is in a domain. Every membership holds a shared lock (`flock`) on one file of the domain's directory, `members.lock`.
//! The first to join and the last to leave remove what killed processes have left, and what iceoryx2 itself never removes.
//!
//! Such a lock belongs to an open file: two memberships of one process hold one each. The kernel drops it with the file,
//! however the process ends.
//!
//! # Why the last one to leave is always found
//!
//! 1. A membership outlasts all that its process has opened on the bus through it: [`Member`](crate::service::Member) and
//!    [`Frame`](crate::Frame) drop their node, ports and samples before their share of it. So a process that has no lock has no
//!    node.
//! 2. A member that leaves tries for the exclusive lock, without waiting. The kernel does not convert a lock in one step: it
//!    drops the shared one, then looks for other holders. So a refused try has given the shared lock up too. Of members that
//!    try at the same time, the one that looks last finds no lock of the others, unless one of them has been granted it.
//! 3. A refused try means that another open file holds the lock at that moment. If its process lives, that membership has its
//!    own step 2 still to come, or has been granted the lock: this member is not the last, and has finished.
//! 4. If its process is ending, it has no step 2 to come: a killed process does nothing any more, but holds its lock until the
//!    kernel closes its files. The member waits for that, and tries again.
//! 5. A granted try may be on a file that another member has removed, together with the domain. Then nothing is left to do;
//!    the path may even belong to a new domain. So the file is compared with the path before anything is removed.
//! 6. Otherwise nobody holds the lock, and by step 1 no member has a node. A node that lives is that of a client without our
//!    lock, such as a stock iceoryx2 one: the domain stays for it, and the next to join finds what is left.
//! 7. Otherwise nobody is there, and the domain is removed while the lock is held. A process that joins meanwhile waits for
//!    the lock, finds by the comparison of step 5 that its file was removed, and opens a new one.
//!
//! So of any members that leave, the last one removes the domain, also where others were killed before.
//!
//! # Joining
//!
//! A member that joins takes the shared lock, tries for the exclusive one, sweeps if it is alone, and takes the shared lock
//! again. Between two of these it holds none, and another may remove the domain: the comparison of step 5 comes last.

use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::node::NodeView as _;
use iceoryx2::prelude::{CallbackProgression, Node, NodeState};

use crate::domain::Domain;
use crate::domain_error::DomainError;
use crate::lock_file::{is_at, lock_at};
use crate::lock_holders::{self, Holders};
use crate::service::Service;
use crate::sweep::{SHARED_MEMORY, dissolve, sweep};

/// How long a member that leaves waits for processes that are ending, and one that joins for a sweep: far longer than either
/// takes.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long it waits for holders that it cannot see.
const PATIENCE_UNSEEN: Duration = Duration::from_millis(20);
const TRY_PERIOD: Duration = Duration::from_millis(1);

/// One membership; given up when it is dropped.
#[derive(Debug)]
pub(crate) struct Membership {
    domain: Domain,
    file: File,
}

/// Who else is in a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OtherMembers {
    /// Nobody; this member holds the exclusive lock.
    Nobody,
    /// Somebody who will leave after this member.
    Living,
    /// Somebody who is ending.
    Ending,
    /// Somebody who cannot be seen.
    Unseen,
    /// The domain has been removed.
    Removed,
}

impl Membership {
    /// Joins a domain whose directory is there. Waits only while another process sweeps, at most ten seconds.
    pub(crate) fn join(domain: &Domain) -> Result<Self, DomainError> {
        // Before there is a file: a missing directory would not appear by trying again.
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
        Ok(Self { domain: domain.clone(), file })
    }

    /// Steps 2 to 7. Whatever stays is swept by the next process to join.
    fn leave(&self) {
        let begun = Instant::now();
        loop {
            let patience = match others(&self.file, &self.domain) {
                OtherMembers::Nobody => {
                    let _ = dissolve(&self.domain, &lock_path(&self.domain));
                    return;
                }
                OtherMembers::Living | OtherMembers::Removed => return,
                OtherMembers::Ending => PATIENCE,
                OtherMembers::Unseen => PATIENCE_UNSEEN,
            };
            if begun.elapsed() > patience {
                return;
            }
            thread::sleep(TRY_PERIOD);
        }
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        self.leave();
    }
}

fn lock_path(domain: &Domain) -> PathBuf {
    domain.root().join("members.lock")
}

/// Takes the shared lock. A process that sweeps holds the exclusive one for some milliseconds, unless it is stopped.
fn share(file: &File, path: &Path) -> Result<(), DomainError> {
    let begun = Instant::now();
    loop {
        match file.try_lock_shared() {
            Ok(()) => return Ok(()),
            Err(TryLockError::WouldBlock) if begun.elapsed() < PATIENCE => thread::sleep(TRY_PERIOD),
            Err(TryLockError::WouldBlock) => {
                let pid = lock_holders::pids(file).ok().and_then(|pids| pids.first().copied());
                return Err(DomainError::Held { path: path.to_owned(), pid });
            }
            Err(TryLockError::Error(error)) => return Err(DomainError::Io { path: path.to_owned(), error }),
        }
    }
}

/// Who else is in the domain. Tries for the exclusive lock; where it is refused, the shared one is lost.
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

/// Step 6: who has a node that lives.
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
        // A signal came in between, for example: look again, but not for ever.
        Err(_) => OtherMembers::Unseen,
    }
}
