//! Errors of the set-up. Each names the thing, the place and the way out.

mod announcing;
mod domain;
mod layout;
mod name;
mod open;
mod signal;

pub use announcing::AnnouncingError;
pub use domain::{DomainError, JoinError};
pub use layout::{AnnouncementError, LayoutConflict, LayoutError};
pub use name::ServiceNameError;
pub use open::OpenError;
pub use signal::SignalError;

pub(crate) use domain::MAX_DOMAIN_BYTES;
pub(crate) use name::MAX_SERVICE_NAME_BYTES;
pub(crate) use open::EVERYTHING;
