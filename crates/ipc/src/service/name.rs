//! The names of the services that carry frames, and of those that carry their layouts.

use iceoryx2::prelude::ServiceName;

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

/// The name of the service that announces the layouts of `service`'s frames.
///
/// # Errors
/// As [`check_service_name`].
pub fn layout_service_name(service: &str) -> Result<String, ServiceNameError> {
    Ok(format!("{LAYOUT_PREFIX}{}", service_name(service)?.as_str()))
}

pub(crate) fn service_name(name: &str) -> Result<ServiceName, ServiceNameError> {
    let owned = || name.to_owned();
    if name.is_empty() {
        return Err(ServiceNameError::Empty);
    }
    let printable = |c: char| c.is_ascii_graphic() || c == ' ';
    if let Some(character) = name.chars().find(|c| !printable(*c)) {
        return Err(ServiceNameError::Character { name: owned(), character });
    }
    if name.trim_matches(' ') != name {
        return Err(ServiceNameError::Blank { name: owned() });
    }
    if name.len() > MAX_SERVICE_NAME_BYTES {
        return Err(ServiceNameError::TooLong { name: owned(), length: name.len() });
    }
    if name.starts_with(LAYOUT_PREFIX) {
        return Err(ServiceNameError::OfLayouts { name: owned() });
    }
    ServiceName::new(name).map_err(|_| ServiceNameError::Reserved { name: owned() })
}
