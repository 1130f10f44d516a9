//! The context of a method's handler, and its outcome.

/// The client that sent a request.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Caller {
    /// Its process, if iceoryx2 knows it.
    pub process: Option<u32>,
}

/// The state of a request that was not refused.
#[derive(Debug, Clone, PartialEq)]
pub enum Begun<R> {
    /// It is answered now.
    Ended(R),
    /// It is answered when [`Operated::ended`](crate::Operated::ended) returns the ticket.
    Later(Ticket),
}

impl<R> Begun<R> {
    /// Converts the answer.
    pub fn map<T>(self, form: impl FnOnce(R) -> T) -> Begun<T> {
        match self {
            Self::Ended(result) => Begun::Ended(form(result)),
            Self::Later(ticket) => Begun::Later(ticket),
        }
    }
}

/// Identifies a request that was begun; it is unique among the requests under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket(pub u64);
