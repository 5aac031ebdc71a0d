//! Classes of iceoryx2's errors on services, by how this crate handles them.

use core::fmt::Debug;

use iceoryx2::service::builder::event::{EventCreateError, EventOpenError};
use iceoryx2::service::builder::publish_subscribe::{PublishSubscribeCreateError, PublishSubscribeOpenError};
use iceoryx2::service::builder::request_response::{RequestResponseCreateError, RequestResponseOpenError};

/// Class of an error on a service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// The service does not exist.
    Absent,
    /// Another process is creating or removing the service at this moment.
    InFlux,
    /// A signal interrupted the call. A retry may succeed.
    Interrupted,
    /// Its layout, pattern or iceoryx2 version differs.
    Mismatch,
    /// This user may not use the service.
    Denied,
    /// The process that was creating the service has not finished.
    HalfMade,
    /// The service has its greatest allowed number of members.
    Full,
    /// Any other error.
    Other,
}

/// An error of iceoryx2 with a class.
pub(crate) trait Sorted: Debug {
    /// Returns the class of the error.
    fn trouble(&self) -> Trouble;
}

/// Classifies an error by the names of its variants, most of which all patterns share.
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
