//! What a handler of a method is told beside the parameters, and what it returns.

/// Who asks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Caller {
    /// The process, where iceoryx2 tells it.
    pub process: Option<u32>,
}

/// What became of a request so far that was not refused.
#[derive(Debug, Clone, PartialEq)]
pub enum Begun<R> {
    /// It is answered at once.
    Ended(R),
    /// It is answered when [`Operated::ended`](crate::Operated::ended) returns the ticket.
    Later(Ticket),
}

impl<R> Begun<R> {
    /// The same with another form of the answer.
    pub fn map<T>(self, form: impl FnOnce(R) -> T) -> Begun<T> {
        match self {
            Self::Ended(result) => Begun::Ended(form(result)),
            Self::Later(ticket) => Begun::Later(ticket),
        }
    }
}

/// Names a request that was begun; no two that are under way have the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket(pub u64);
