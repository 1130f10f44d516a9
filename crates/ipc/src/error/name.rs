//! Why a name cannot be that of a service.

use thiserror::Error;

/// Most bytes of a service's name. iceoryx2 takes 255; the rest is for the names of services that
/// belong to one of frames, such as `isochrone/layout/<service>`.
pub(crate) const MAX_SERVICE_NAME_BYTES: usize = 238;

/// Why [`check_service_name`](crate::check_service_name) refuses a name.
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ServiceNameError {
    /// The name is empty.
    #[error(
        "the service name is empty; give 1 to {MAX_SERVICE_NAME_BYTES} printable ASCII characters, such as \"plant/level\""
    )]
    Empty,
    /// The name begins or ends with a blank, or has nothing else.
    #[error(
        "service name {name:?} begins or ends with a blank, which nobody sees; leave it out, as in \"plant/level\""
    )]
    Blank {
        /// The name as given.
        name: String,
    },
    /// The name is longer than 238 bytes.
    #[error(
        "service name {name:?} is {length} bytes long; at most {MAX_SERVICE_NAME_BYTES} are possible"
    )]
    TooLong {
        /// The name as given.
        name: String,
        /// Its length in bytes.
        length: usize,
    },
    /// The name has a control or a non-ASCII character.
    #[error(
        "service name {name:?} contains {character:?}; only printable ASCII characters are possible"
    )]
    Character {
        /// The name as given.
        name: String,
        /// The first character that does not fit.
        character: char,
    },
    /// The name begins with `isochrone/layout/`, which is reserved for announcing layouts.
    #[error(
        "service name {name:?} begins with \"isochrone/layout/\", where layouts are announced; choose another beginning"
    )]
    OfLayouts {
        /// The name as given.
        name: String,
    },
    /// The name begins with `iox2://`, which iceoryx2 reserves.
    #[error(
        "service name {name:?} begins with \"iox2://\", which iceoryx2 keeps for itself; choose another beginning"
    )]
    Reserved {
        /// The name as given.
        name: String,
    },
}

isochrone_model::debug_as_display!(ServiceNameError);
