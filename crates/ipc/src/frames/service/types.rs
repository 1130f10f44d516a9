//! Message types of a service, as iceoryx2 compares them and as people read them.

use std::fmt::Debug;

use iceoryx2::prelude::{MessagingPattern, ServiceName, ZeroCopySend};
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};

use crate::{Participant, Service};

/// What a service's messages are slices of.
pub(crate) trait Element: ZeroCopySend + Debug + 'static {
    /// How people call the messages.
    const MESSAGES: &'static str;
}

impl Element for f64 {
    const MESSAGES: &'static str = "frames";
}

impl Element for u8 {
    const MESSAGES: &'static str = "layouts";
}

/// What goes with each message.
pub(crate) trait Header: ZeroCopySend + Debug + 'static {}

impl<H: ZeroCopySend + Debug + 'static> Header for H {}

pub(super) fn needed_types<E: Element, H: Header>() -> String {
    describe(
        &TypeDetail::new::<E>(TypeVariant::Dynamic),
        &TypeDetail::new::<H>(TypeVariant::FixedSize),
    )
}

pub(super) fn types_of<S: Service>(participant: &Participant<S>, name: &ServiceName) -> String {
    let details = S::details(name, participant.node().config(), MessagingPattern::PublishSubscribe);
    match details {
        Ok(Some(details)) => {
            let types = details.static_details.publish_subscribe().message_type_details();
            describe(&types.payload, &types.user_header)
        }
        _ => "messages of unknown type".to_owned(),
    }
}

pub(crate) fn describe(payload: &TypeDetail, header: &TypeDetail) -> String {
    let payload_name = match payload.variant() {
        TypeVariant::Dynamic => format!("[{}]", payload.type_name()),
        TypeVariant::FixedSize => payload.type_name().to_string(),
    };
    if header.size() == 0 {
        return format!(
            "{payload_name} (elements of {} bytes) without user header",
            payload.size()
        );
    }
    format!(
        "{payload_name} (elements of {} bytes) with user header {} ({} bytes)",
        payload.size(),
        header.type_name(),
        header.size()
    )
}
