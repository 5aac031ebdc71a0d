//! The exit statuses of the program, and the errors that cause them.

use std::error::Error;
use std::io::{self, ErrorKind};
use std::process::ExitCode;

use bench_dragon_ipc::{BusError, DomainError};

use crate::cli::flags::BadInput;
use crate::config::ConfigError;
use crate::recording::export::ExportError;
use crate::recording::{NothingFound, RecordError, RepairError};
use crate::source::replay::ReplayError;

/// Bad arguments or configuration.
pub(super) const BAD_INPUT: u8 = 2;
/// A recording that cannot be verified.
pub(super) const UNVERIFIABLE: u8 = 2;
/// A contact, if `--fail-on-contact` is given.
pub(super) const CONTACT: u8 = 3;
/// A question that Ctrl-C has cancelled, as in shells.
pub(super) const CANCELLED: u8 = 130;
/// A recorder whose disk is full.
pub(super) const DISK_FULL: u8 = 4;

pub(super) fn of_error(error: &anyhow::Error) -> ExitCode {
    if is_disk_full(error) {
        ExitCode::from(DISK_FULL)
    } else if error.chain().any(is_bad_input) {
        ExitCode::from(BAD_INPUT)
    } else {
        ExitCode::FAILURE
    }
}

/// Whether a recording ended because its disk is full.
pub(super) fn is_disk_full(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| cause.downcast_ref().is_some_and(RecordError::is_disk_full))
}

fn is_bad_input(cause: &(dyn Error + 'static)) -> bool {
    use NothingFound::NothingThere;
    cause.is::<BadInput>()
        || cause.is::<ConfigError>()
        || matches!(cause.downcast_ref(), Some(DomainError::RootPath { .. }))
        || matches!(cause.downcast_ref(), Some(BusError::Domain(DomainError::RootPath { .. })))
        || matches!(cause.downcast_ref(), Some(RecordError::Exists { .. } | RecordError::Create { .. }))
        || matches!(cause.downcast_ref(), Some(ReplayError::Nothing(NothingThere { .. })))
        || matches!(cause.downcast_ref(), Some(ExportError::Nothing(NothingThere { .. }) | ExportError::TooMuch { .. }))
        || matches!(
            cause.downcast_ref(),
            Some(RepairError::Read { .. } | RepairError::Foreign { .. } | RepairError::Damaged { .. })
        )
}

/// Whether the reader of our output has closed it, as `head` does. This is not a failure.
pub(super) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let is_broken = |error: &io::Error| error.kind() == ErrorKind::BrokenPipe;
    error.chain().any(|cause| cause.downcast_ref().is_some_and(is_broken))
}
