//! Ends forces.

use super::SetResult;
#[cfg(test)]
pub(super) use super::set::example;

params! {
    /// Parameters of `release`: which forces.
    Release: changes ReleaseParams -> SetResult {
        /// Names and globs, at most 4096.
        required names "names": Vec<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }
}
