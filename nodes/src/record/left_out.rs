//! The parts that a recording lacks.

/// A service that was to be recorded and was not.
#[derive(Debug, serde::Serialize)]
pub(super) struct LeftOut {
    pub(super) service: String,
    pub(super) why: String,
    /// Nothing of this name was there, or nothing was sent.
    #[serde(skip)]
    pub(super) is_absent: bool,
}
