//! Errors between a process and the bus.

use core::fmt;
use std::io;
use std::time::Duration;

use super::domain_error::DomainError;
use super::shortage::shortage;
use crate::wire::services::MAX_BORROWED_FRAMES;
use crate::wire::{CommandReply, Refusal, Request};

/// Reason for which a process cannot use the bus.
#[derive(Debug)]
#[non_exhaustive]
pub enum BusError {
    /// No source publishes on this instance. [`BusError::is_absent`] returns `true`, so a client may wait.
    NoServer {
        /// The instance.
        instance: String,
    },
    /// The server has not replied in time. It may have executed the command nevertheless.
    NoAnswer {
        /// The instance.
        instance: String,
        /// Time for which the client waited.
        waited: Duration,
    },
    /// The server has refused the command.
    Refused {
        /// The command.
        request: Request,
        /// The reason.
        refusal: Refusal,
        /// The server's reply.
        reply: CommandReply,
    },
    /// Another source publishes on this instance.
    SourceRunning {
        /// The instance.
        instance: String,
        /// Process id of the other source; `None` where this process cannot see it, as from another container.
        pid: Option<u32>,
    },
    /// Another `show` supervises this instance.
    ShowRunning {
        /// The instance.
        instance: String,
        /// Process id of the other show; `None` where this process cannot see it, as from another container.
        pid: Option<u32>,
    },
    /// Another guard watches over this instance.
    GuardRunning {
        /// The instance.
        instance: String,
        /// Process id of the other guard; `None` where this process cannot see it, as from another container.
        pid: Option<u32>,
    },
    /// The instance's directory is not usable.
    Domain(DomainError),
    /// The service exists with another layout, or was made by another iceoryx2 version.
    VersionMismatch {
        /// The service.
        service: &'static str,
    },
    /// The service exists, and this user may not open it.
    PermissionDenied {
        /// The service.
        service: &'static str,
    },
    /// `/dev/shm` has less space than the ports need.
    SharedMemoryFull {
        /// Required free space in bytes.
        needed: u64,
    },
    /// `/dev/shm` cannot be used.
    SharedMemoryUnusable {
        /// The operating system's reason.
        error: io::Error,
    },
    /// This process may not open as many files as it needs.
    TooFewFiles {
        /// Number of additional files that the process needs.
        needed: usize,
    },
    /// A process was killed while it created the service. The unfinished service blocks all clients.
    HalfMade {
        /// The service.
        service: &'static str,
    },
    /// A source cannot create the service: its last user is removing it and is stopped.
    Blocked {
        /// The service.
        service: &'static str,
    },
    /// The service has its greatest allowed number of clients.
    TooManyClients {
        /// The service.
        service: &'static str,
    },
    /// The client's name is not 1 to 128 printable ASCII characters.
    InvalidName {
        /// The name.
        name: String,
    },
    /// This reader holds [`MAX_BORROWED_FRAMES`] frames.
    TooManyFrames,
    /// The client was closed, perhaps by another thread.
    Closed {
        /// The instance.
        instance: String,
    },
    /// The client was opened in a parent process, before this process was forked.
    Inherited {
        /// The instance.
        instance: String,
    },
    /// Any other error: the resource that is short, or iceoryx2's name of the error.
    Failed {
        /// The service or the operation.
        service: &'static str,
        /// The reason.
        reason: String,
    },
}

impl BusError {
    /// Whether there is nothing to open yet, so that waiting makes sense. The next server creates the services and
    /// removes half-made ones.
    pub fn is_absent(&self) -> bool {
        matches!(self, Self::NoServer { .. } | Self::HalfMade { .. })
    }

    /// Creates the error for a failure that iceoryx2 only names. The text reports a shortage of the machine or the
    /// process if one is found.
    pub fn failed(service: &'static str, reason: impl fmt::Debug) -> Self {
        let reason = shortage().unwrap_or_else(|| format!("iceoryx2 reports {reason:?}"));
        Self::Failed { service, reason }
    }
}

impl fmt::Display for BusError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoServer { instance } => {
                write!(
                    formatter,
                    "no server runs on instance {instance:?}: start the show, or by hand \
                     `bench-dragon serve --config FILE --held --instance {instance}`"
                )
            }
            Self::NoAnswer { instance, waited } => write!(
                formatter,
                "the server on instance {instance:?} has not answered within {} s: it may have taken the command",
                waited.as_secs_f64()
            ),
            Self::Refused { request, refusal, .. } => formatter.write_str(&refusal.explain(request)),
            Self::SourceRunning { instance, pid } => {
                already_runs(formatter, "server", instance, *pid, ", or choose another --instance")
            }
            Self::ShowRunning { instance, pid } => {
                already_runs(formatter, "show", instance, *pid, ", or choose another --instance")
            }
            Self::GuardRunning { instance, pid } => already_runs(formatter, "guard", instance, *pid, " first"),
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
                "/dev/shm has less than the {:.1} MB free that this process needs: free some or mount it larger",
                *needed as f64 * 1e-6
            ),
            Self::SharedMemoryUnusable { error } if error.kind() == io::ErrorKind::FileTooLarge => {
                write!(
                    formatter,
                    "the file size limit is too low for shared memory ({error}): raise the limit, `ulimit -f unlimited`"
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
                "{service} was left half made by a server that was killed: start the show again, which removes it"
            ),
            Self::Blocked { service } => write!(
                formatter,
                "{service} is being removed by a client that makes no progress: resume or kill it; a stopped process has \
                 state T in `ps`"
            ),
            Self::TooManyClients { service } => {
                write!(formatter, "{service} has as many clients as it allows: stop one of them")
            }
            Self::InvalidName { name } => {
                write!(formatter, "name is {name:?}, must be 1 to 128 printable ASCII characters")
            }
            Self::TooManyFrames => write!(
                formatter,
                "{MAX_BORROWED_FRAMES} frames are held, the most that a reader may hold: release one, or keep copies"
            ),
            Self::Closed { instance } => write!(formatter, "the client of instance {instance:?} is closed"),
            Self::Inherited { instance } => {
                write!(formatter, "the client of instance {instance:?} was opened in another process: open one here")
            }
            Self::Failed { service, reason } => write!(formatter, "{service}: {reason}"),
        }
    }
}

/// Writes that another process of this kind has the instance, and where to stop it.
fn already_runs(
    formatter: &mut fmt::Formatter<'_>,
    kind: &str,
    instance: &str,
    pid: Option<u32>,
    or_else: &str,
) -> fmt::Result {
    write!(formatter, "a {kind} already runs on instance {instance:?}, ")?;
    match pid {
        Some(pid) => write!(formatter, "pid {pid}: stop it{or_else}"),
        None => {
            write!(formatter, "where this process cannot see it, perhaps in another container: stop it there{or_else}")
        }
    }
}

impl core::error::Error for BusError {}

impl From<DomainError> for BusError {
    fn from(error: DomainError) -> Self {
        Self::Domain(error)
    }
}
