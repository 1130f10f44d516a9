//! Errors of service names.

use std::fmt::Display;

use thiserror::Error;

/// Most bytes of a service's name. iceoryx2 takes 255; the rest is for the names of services that
/// belong to one of frames, such as `isochrone/layout/<service>`.
pub(crate) const MAX_SERVICE_NAME_BYTES: usize = 238;

/// Why [`check_service_name`](crate::check_service_name) or [`refuse_own_service`](crate::refuse_own_service) refuses a
/// name.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct ServiceNameError(String);

impl ServiceNameError {
    pub(crate) fn empty() -> Self {
        Self(format!(
            "the service name is empty; give 1 to {MAX_SERVICE_NAME_BYTES} printable ASCII characters, such as \
             \"plant/level\""
        ))
    }

    /// What is wrong with a name that is not empty.
    pub(crate) fn of(name: &str, what: impl Display) -> Self {
        Self(format!("service name {name:?} {what}"))
    }

    /// `rest` is the name after its beginning.
    pub(crate) fn own(name: &str, rest: &str) -> Self {
        Self(format!(
            "service {name:?}: names that begin with \"isochrone/\" are for what nodes say of themselves, such as \
             isochrone/<node>/telemetry; choose another name, such as \"plant/{}\"",
            rest.escape_debug()
        ))
    }

    pub(crate) fn reserved(name: &str) -> Self {
        Self::of(
            name,
            "begins with \"iox2://\", which iceoryx2 keeps for itself; choose another beginning",
        )
    }
}

isochrone_model::debug_as_display!(ServiceNameError);
