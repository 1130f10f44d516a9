//! A shot, and when that was.

use isochrone_recording::ClockReading;
use isochrone_scope::Shot;

/// A shot, and when that was.
pub(super) struct Captured {
    pub(super) shot: Shot,
    /// A common reading of the clock of its times and of Unix time, if that is known.
    pub(super) clock: Option<ClockReading>,
}
