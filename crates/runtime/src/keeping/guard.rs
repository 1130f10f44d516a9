//! Who may write the files of a node.

use std::sync::Arc;

use crate::redundancy::twin::Twin;

/// Whether this process may write the files of its node: always, unless it is one of two and the other one holds the
/// node. Asked before each write and each rename, so that one that was stopped and goes on overwrites nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct WriteGuard {
    twin: Option<Arc<Twin>>,
    /// The term with which it must hold the node; `None`: any.
    term: Option<u64>,
}

impl WriteGuard {
    /// Of a process that is one of two, if it is.
    pub(crate) fn of(twin: Option<&Arc<Twin>>) -> Self {
        Self { twin: twin.cloned(), term: None }
    }

    /// Of one that holds the node, until it does no more, for a file that it opens anew when it takes over again.
    pub(crate) fn of_holder(twin: Option<&Arc<Twin>>) -> Self {
        Self { twin: twin.cloned(), term: twin.and_then(|twin| twin.term()) }
    }

    /// Whether it may write now.
    pub(crate) fn allows(&self) -> bool {
        let holds = |twin: &Arc<Twin>| {
            let term = twin.term();
            term.is_some() && (self.term.is_none() || self.term == term)
        };
        self.twin.as_ref().is_none_or(holds)
    }

    /// The term with which it does; `None`: it is the only process.
    pub(crate) fn term(&self) -> Option<u64> {
        self.term.or_else(|| self.twin.as_ref()?.term())
    }
}
