//! The configuration that an `apply` asks for, while it is made and while it has to wait.

use std::time::Instant;

use isochrone_control::Ticket;

use super::jobs::Job;
use crate::apply::PreparedApply;
use crate::error::ApplyError;

/// A change that was refused because of requests for later cycles.
pub(super) struct HeldUp {
    pub(super) who: String,
    pub(super) at: Instant,
}

/// A configuration that is being prepared.
pub(super) struct Making {
    pub(super) ticket: Ticket,
    pub(super) who: String,
    pub(super) is_dry: bool,
    pub(super) allow_missed: bool,
    pub(super) is_given_up: bool,
    pub(super) job: Job<Result<PreparedApply, ApplyError>>,
}
