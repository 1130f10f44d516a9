//! The names of the services that carry frames, and of those that carry their layouts.

use iceoryx2::prelude::ServiceName;

use isochrone_model::OWN_SERVICES;

use crate::ServiceNameError;
use crate::error::MAX_SERVICE_NAME_BYTES;

/// What the name of a service of layouts is made of, before that of the service of frames.
const LAYOUT_PREFIX: &str = "isochrone/layout/";

/// Checks whether `name` is valid for a service that carries frames.
///
/// # Errors
/// The name is empty, longer than 238 bytes, begins with `iox2://` or `isochrone/layout/`, begins or
/// ends with a blank, or has a character that is not printable ASCII. (iceoryx2 itself allows 255 bytes
/// and all control characters but NUL, which no tool displays.)
pub fn check_service_name(name: &str) -> Result<(), ServiceNameError> {
    service_name(name).map(drop)
}

/// Refuses a name that is reserved for what nodes say of themselves, such as that of their telemetry: a program publishes
/// on others.
///
/// # Errors
/// The name begins with `isochrone/`.
pub fn refuse_own_service(name: &str) -> Result<(), ServiceNameError> {
    name.strip_prefix(OWN_SERVICES).map_or(Ok(()), |rest| Err(ServiceNameError::own(name, rest)))
}

/// The name of the service that announces the layouts of `service`'s frames.
///
/// # Errors
/// As [`check_service_name`].
pub fn layout_service_name(service: &str) -> Result<String, ServiceNameError> {
    Ok(format!("{LAYOUT_PREFIX}{}", service_name(service)?.as_str()))
}

pub(crate) fn service_name(name: &str) -> Result<ServiceName, ServiceNameError> {
    let refused = |what: &str| Err(ServiceNameError::of(name, what));
    if name.is_empty() {
        return Err(ServiceNameError::empty());
    }
    let printable = |c: char| c.is_ascii_graphic() || c == ' ';
    if let Some(character) = name.chars().find(|c| !printable(*c)) {
        return refused(&format!(
            "contains {character:?}; only printable ASCII characters are possible"
        ));
    }
    if name.trim_matches(' ') != name {
        return refused(
            "begins or ends with a blank, which nobody sees; leave it out, as in \"plant/level\"",
        );
    }
    if name.len() > MAX_SERVICE_NAME_BYTES {
        return refused(&format!(
            "is {} bytes long; at most {MAX_SERVICE_NAME_BYTES} are possible",
            name.len()
        ));
    }
    if name.starts_with(LAYOUT_PREFIX) {
        return refused(
            "begins with \"isochrone/layout/\", where layouts are announced; choose another beginning",
        );
    }
    ServiceName::new(name).map_err(|_| ServiceNameError::reserved(name))
}
