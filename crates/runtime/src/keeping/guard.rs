//! Who may write the files of a node.

use std::sync::Arc;

use crate::redundancy::twin::Twin;

/// Whether this process may write the files of its node: always, unless it is one of two and the other one holds the
/// node. Asked before each write and each rename, so that one that was stopped and goes on overwrites nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct WriteGuard(Option<Arc<Twin>>);

impl WriteGuard {
    /// Of a process that is one of two, if it is.
    pub(crate) fn of(twin: Option<&Arc<Twin>>) -> Self {
        Self(twin.cloned())
    }

    /// Whether it may write now.
    pub(crate) fn allows(&self) -> bool {
        self.0.as_ref().is_none_or(|twin| twin.holds())
    }

    /// The term with which it does; `None`: it is the only process.
    pub(crate) fn term(&self) -> Option<u64> {
        self.0.as_ref()?.term()
    }
}
