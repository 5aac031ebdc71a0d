//! iceoryx2's many reasons for which a service cannot be had, sorted by what one does about them.

use core::fmt::Debug;

use iceoryx2::service::builder::event::{EventCreateError, EventOpenError};
use iceoryx2::service::builder::publish_subscribe::{PublishSubscribeCreateError, PublishSubscribeOpenError};
use iceoryx2::service::builder::request_response::{RequestResponseCreateError, RequestResponseOpenError};

/// What is wrong with a service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// It is not there.
    Absent,
    /// Another process is taking it away or making it at this moment.
    InFlux,
    /// A signal came in between: the next try may do.
    Interrupted,
    /// Its layout, pattern or iceoryx2 version is another one.
    Mismatch,
    /// This user may not use it.
    Denied,
    /// The process that was making it has not finished.
    HalfMade,
    /// It has as many members as it allows.
    Full,
    /// Anything else.
    Other,
}

/// An error of iceoryx2 that can be sorted.
pub(crate) trait Sorted: Debug {
    /// What it comes down to.
    fn trouble(&self) -> Trouble;
}

/// Sorts an error by the names of its variants, which the patterns share but for a few.
macro_rules! sort {
    ($error:ty { $($trouble:ident: $($variant:ident)|+;)+ }) => {
        impl Sorted for $error {
            fn trouble(&self) -> Trouble {
                match self {
                    $($(Self::$variant)|+ => Trouble::$trouble,)+
                    _ => Trouble::Other,
                }
            }
        }
    };
}

sort!(PublishSubscribeOpenError {
    Absent: DoesNotExist;
    InFlux: IsMarkedForDestruction;
    Interrupted: Interrupt;
    Mismatch: IncompatibleTypes | IncompatibleMessagingPattern | VersionMismatch;
    Denied: InsufficientPermissions;
    HalfMade: HangsInCreation;
    Full: ExceedsMaxNumberOfNodes;
});

sort!(EventOpenError {
    Absent: DoesNotExist;
    InFlux: IsMarkedForDestruction;
    Interrupted: Interrupt;
    Mismatch: IncompatibleMessagingPattern | VersionMismatch;
    Denied: InsufficientPermissions;
    HalfMade: HangsInCreation;
    Full: ExceedsMaxNumberOfNodes;
});

sort!(RequestResponseOpenError {
    Absent: DoesNotExist;
    InFlux: IsMarkedForDestruction;
    Interrupted: Interrupt;
    Mismatch: IncompatibleRequestOrResponseType | IncompatibleMessagingPattern | VersionMismatch;
    Denied: InsufficientPermissions;
    HalfMade: HangsInCreation;
    Full: ExceedsMaxNumberOfNodes;
});

sort!(PublishSubscribeCreateError {
    InFlux: AlreadyExists | IsBeingCreatedByAnotherInstance;
    Interrupted: Interrupt;
    Denied: InsufficientPermissions;
    HalfMade: HangsInCreation;
});

sort!(EventCreateError {
    InFlux: AlreadyExists | IsBeingCreatedByAnotherInstance;
    Interrupted: Interrupt;
    Denied: InsufficientPermissions;
});

sort!(RequestResponseCreateError {
    InFlux: AlreadyExists | IsBeingCreatedByAnotherInstance;
    Interrupted: Interrupt;
    Denied: InsufficientPermissions;
    HalfMade: HangsInCreation;
});
