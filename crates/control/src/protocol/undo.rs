//! Takes back a `set`, or an undo.

use super::SetResult;
#[cfg(test)]
pub(super) use super::set::example;

params! {
    /// Parameters of `undo`: what to take back.
    Undo: changes UndoParams -> SetResult {
        /// The number of a `set`.
        required transaction "transaction": u64,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }
}
