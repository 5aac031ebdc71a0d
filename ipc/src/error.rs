//! What can go wrong between a process and the bus.

use core::fmt;
use std::io;
use std::time::Duration;

use crate::domain_error::DomainError;
use crate::shortage::shortage;

/// Why the bus could not be joined.
#[derive(Debug)]
#[non_exhaustive]
pub enum BusError {
    /// Nothing is published on this instance. Clients wait for it with [`BusError::is_absent`].
    NoServer {
        /// The instance.
        instance: String,
    },
    /// The server has not answered in time. It may have taken what it was told all the same.
    NoAnswer {
        /// The instance.
        instance: String,
        /// How long it was waited for.
        waited: Duration,
    },
    /// Another source publishes on this instance.
    SourceRunning {
        /// The instance.
        instance: String,
        /// The other source's process id, as it wrote it; empty in the instant before it has.
        pid: String,
    },
    /// Another guard watches over this instance.
    GuardRunning {
        /// The instance.
        instance: String,
        /// The other guard's process id, as it wrote it; empty in the instant before it has.
        pid: String,
    },
    /// The instance's directory is not usable.
    Domain(DomainError),
    /// The service is there, with another layout or from another iceoryx2 version.
    VersionMismatch {
        /// The service.
        service: &'static str,
    },
    /// The service is there, and this user may not open it.
    PermissionDenied {
        /// The service.
        service: &'static str,
    },
    /// `/dev/shm` has less space than the ports need.
    SharedMemoryFull {
        /// What is needed, in bytes.
        needed: u64,
    },
    /// `/dev/shm` cannot be used at all.
    SharedMemoryUnusable {
        /// The operating system's reason.
        error: io::Error,
    },
    /// This process may not open as many files as it needs.
    TooFewFiles {
        /// How many more it needs.
        needed: usize,
    },
    /// A process was killed while it made the service, and what is left of it blocks everyone.
    HalfMade {
        /// The service.
        service: &'static str,
    },
    /// A source cannot make the service, because a process that was the last to use it is removing it, and is stopped.
    Blocked {
        /// The service.
        service: &'static str,
    },
    /// As many clients as the service allows are connected.
    TooManyClients {
        /// The service.
        service: &'static str,
    },
    /// Anything else: what is lacking, or iceoryx2's word for it.
    Failed {
        /// The service, or what was to be done.
        service: &'static str,
        /// The reason.
        reason: String,
    },
}

impl BusError {
    /// Whether there is just nothing to open yet, so that waiting makes sense: the next server makes it, and clears away
    /// what a killed one has left half made.
    pub fn is_absent(&self) -> bool {
        matches!(self, Self::NoServer { .. } | Self::HalfMade { .. })
    }

    /// An error for which iceoryx2 has only a name: says what the machine or this process is short of, where that is found.
    pub fn failed(service: &'static str, reason: impl fmt::Debug) -> Self {
        let reason = shortage().unwrap_or_else(|| format!("iceoryx2 reports {reason:?}"));
        Self::Failed { service, reason }
    }
}

impl fmt::Display for BusError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoServer { instance } => {
                write!(formatter, "no server runs on instance {instance:?}: start one with `bench-dragon serve`")
            }
            Self::NoAnswer { instance, waited } => write!(
                formatter,
                "the server on instance {instance:?} has not answered within {} s: it may have taken the command",
                waited.as_secs_f64()
            ),
            Self::SourceRunning { instance, pid } => write!(
                formatter,
                "a server already runs on instance {instance:?}, pid {pid}: stop it, or choose another --instance"
            ),
            Self::GuardRunning { instance, pid } => {
                write!(formatter, "a guard already runs on instance {instance:?}, pid {pid}: there can be only one")
            }
            Self::Domain(error) => error.fmt(formatter),
            Self::VersionMismatch { service } => write!(
                formatter,
                "{service} has another layout than this program's: run the same version of bench-dragon on both sides"
            ),
            Self::PermissionDenied { service } => {
                write!(formatter, "permission denied on {service}: run as the user who runs the server")
            }
            Self::SharedMemoryFull { needed } => write!(
                formatter,
                "/dev/shm has less than the {:.1} MB free that this needs: free some or mount it larger",
                *needed as f64 * 1e-6
            ),
            Self::SharedMemoryUnusable { error } if error.kind() == io::ErrorKind::FileTooLarge => {
                write!(
                    formatter,
                    "a file may not be as large as shared memory has to be ({error}): `ulimit -f unlimited`"
                )
            }
            Self::SharedMemoryUnusable { error } => write!(
                formatter,
                "/dev/shm cannot be written ({error}): mount it, `mount -t tmpfs -o mode=1777 tmpfs /dev/shm`"
            ),
            Self::TooFewFiles { needed } => write!(
                formatter,
                "this process may not open the {needed} more files that it needs: raise the limit, `ulimit -n 1024`"
            ),
            Self::HalfMade { service } => write!(
                formatter,
                "{service} was left half made by a server that was killed: start one with `bench-dragon serve`, which \
                 removes it"
            ),
            Self::Blocked { service } => write!(
                formatter,
                "{service} is being removed by a client that does not go on: continue or kill it; a stopped process has \
                 state T in `ps`"
            ),
            Self::TooManyClients { service } => {
                write!(formatter, "{service} has as many clients as it allows: stop one of them")
            }
            Self::Failed { service, reason } => write!(formatter, "{service}: {reason}"),
        }
    }
}

impl core::error::Error for BusError {}

impl From<DomainError> for BusError {
    fn from(error: DomainError) -> Self {
        Self::Domain(error)
    }
}
