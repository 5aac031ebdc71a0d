//! Layouts of the existing services, read from their files without opening the services.

use iceoryx2::prelude::{MessagingPattern, ServiceName};
use iceoryx2::service::Service as _;
use iceoryx2::service::ServiceDetailsError;
use iceoryx2::service::static_config::message_type_details::{MessageTypeDetails, TypeDetail, TypeVariant};
use iceoryx2::service::static_config::messaging_pattern::MessagingPattern as Pattern;

use super::place::Domain;
use crate::wire::services::{ALERTS, COMMAND_EVENTS, COMMANDS, DESCRIPTION, FRAMES, READERS, STATUS, Service};
use crate::wire::{Alert, Command, CommandEvent, CommandReply, FrameHeader, HandleState, ReaderReport, Status};

/// Layout of one service, as its creator made it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ServiceLayout {
    /// Name of the service.
    pub service: &'static str,
    /// Types of its messages, or the reason for which they cannot be read.
    pub found: Result<String, String>,
    /// Types that this program uses for this service.
    pub expected: String,
}

impl ServiceLayout {
    /// Whether this program can use the service.
    pub fn agrees(&self) -> bool {
        self.found.as_ref() == Ok(&self.expected)
    }
}

/// Returns the layouts of all existing services.
pub(crate) fn service_layouts(domain: &Domain) -> Vec<ServiceLayout> {
    let slice_of = |payload, header: TypeDetail| [described(&payload), described(&header)].join(" under ");
    let single = |payload: TypeDetail| described(&payload);
    let expected = [
        (FRAMES, slice_of(dynamic::<HandleState>(), fixed::<FrameHeader>())),
        (DESCRIPTION, slice_of(dynamic::<u8>(), fixed::<u64>())),
        (STATUS, single(fixed::<Status>())),
        (ALERTS, single(fixed::<Alert>())),
        (READERS, single(fixed::<ReaderReport>())),
        (COMMAND_EVENTS, single(fixed::<CommandEvent>())),
        (COMMANDS, [single(fixed::<Command>()), single(fixed::<CommandReply>())].join(" to ")),
    ];
    let layout = |(service, expected): (&'static str, String)| {
        Some(ServiceLayout { service, found: found(domain, service)?, expected })
    };
    expected.into_iter().filter_map(layout).collect()
}

/// Returns the types of the service with this name; `None` if it does not exist.
fn found(domain: &Domain, service: &'static str) -> Option<Result<String, String>> {
    let name = ServiceName::new(service).expect("the bus's names are valid service names");
    let pattern =
        if service == COMMANDS { MessagingPattern::RequestResponse } else { MessagingPattern::PublishSubscribe };
    let details = match Service::details(&name, &domain.iceoryx2_config(), pattern) {
        Ok(details) => details?.static_details,
        Err(ServiceDetailsError::VersionMismatch) => {
            return Some(Err("made by another version of iceoryx2".to_owned()));
        }
        Err(error) => return Some(Err(format!("{error:?}"))),
    };
    Some(match details.messaging_pattern() {
        Pattern::PublishSubscribe(publishing) => Ok(described_message(publishing.message_type_details())),
        Pattern::RequestResponse(asking) => {
            Ok([asking.request_message_type_details(), asking.response_message_type_details()]
                .map(described_message)
                .join(" to "))
        }
        other => Err(format!("made as {other:?}")),
    })
}

fn described_message(message: &MessageTypeDetails) -> String {
    let payload = described(&message.payload);
    // A service without a user header has a header of 0 bytes.
    if message.user_header.size() == 0 {
        payload
    } else {
        format!("{payload} under {}", described(&message.user_header))
    }
}

fn described(detail: &TypeDetail) -> String {
    let size = detail.size();
    match detail.variant() {
        TypeVariant::FixedSize => format!("{} of {size} bytes", detail.type_name()),
        TypeVariant::Dynamic => format!("[{}] of {size} bytes each", detail.type_name()),
    }
}

fn fixed<T: iceoryx2::prelude::ZeroCopySend>() -> TypeDetail {
    TypeDetail::new::<T>(TypeVariant::FixedSize)
}

fn dynamic<T: iceoryx2::prelude::ZeroCopySend>() -> TypeDetail {
    TypeDetail::new::<T>(TypeVariant::Dynamic)
}
