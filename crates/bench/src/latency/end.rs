//! One end of a transport, whichever it is.

use std::io::{self, ErrorKind};
use std::path::Path;
use std::time::{Duration, Instant};

use isochrone_ipc::{ForRealTime, OpenError, RealTime, ipc};
use thiserror::Error;

use super::bench_node::START_NS;
use super::message::{Header, Message};
use super::pace::Wait;

/// How long an end waits for the other one before it gives up.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);
/// How long a read that blocks may do so, to look whether somebody wants to stop.
pub(super) const BLOCKED: Duration = Duration::from_millis(200);

/// One end of a connection that carries messages of a fixed size both ways.
pub(super) trait End {
    /// Writes the values of a message, all of them, and sends it.
    fn send(&mut self, header: Header) -> Result<(), EndError>;

    /// Receives the next message and reads all its values; `None` if there is none yet.
    fn receive(&mut self) -> Result<Option<Message>, EndError>;

    /// Gets ready for the next `send`: what a cycle does in its slack.
    fn prepare(&mut self) {}
}

/// What can go wrong with an end.
#[derive(Error)]
pub(super) enum EndError {
    #[error("cannot {what}: {source}")]
    System { what: &'static str, source: io::Error },
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error("iceoryx2 refused to send a message")]
    Refused,
    #[error("the other end has gone")]
    Gone,
    #[error("the other end takes no more messages")]
    Full,
    #[error("nothing came from the other end for {} s", PATIENCE.as_secs())]
    Silent,
    #[error("the node sent nothing for {} s", START_NS / 1_000_000_000)]
    NoNode,
    #[error("message {sequence} is damaged: its values add up to {sum}, and {expected} was sent")]
    Damaged { sequence: u64, sum: f64, expected: f64 },
    #[error("message {sequence} has no values")]
    Empty { sequence: u64 },
}

impl EndError {
    /// What the system refused to do.
    pub(super) fn system(what: &'static str) -> impl Fn(io::Error) -> Self {
        move |source| match source.kind() {
            ErrorKind::BrokenPipe
            | ErrorKind::ConnectionReset
            | ErrorKind::ConnectionRefused
            | ErrorKind::UnexpectedEof => Self::Gone,
            _ => Self::System { what, source },
        }
    }
}

isochrone_model::debug_as_display!(EndError);

/// Which of the two ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// The one that is opened first.
    Measuring,
    Peer,
}

/// Where both ends of an arm meet.
pub(super) struct Rendezvous<'a> {
    pub(super) side: Side,
    /// A folder for these two processes and this size of message.
    pub(super) folder: &'a Path,
    pub(super) participant: &'a RealTime<ipc::Service>,
    /// What the names of files in shared memory shall begin with.
    pub(super) prefix: &'a str,
    pub(super) values: usize,
    pub(super) wait: Wait,
}

impl Rendezvous<'_> {
    /// The name of something that goes to or comes from the other end.
    pub(super) fn name(&self, arm: &str, goes: Way) -> String {
        let to_peer = (self.side == Side::Measuring) == (goes == Way::Out);
        let way = if to_peer { "forth" } else { "back" };
        format!("{arm}/{}/{way}", self.values)
    }
}

/// Whether messages leave through it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Out,
    In,
}

/// What is left to do once the other end is open as well.
pub(super) type Opening = Box<dyn FnOnce() -> Result<Box<dyn End>, EndError>>;

/// An end that has no port of iceoryx2, or none that a real-time thread must enter with.
pub(super) fn without_ports(opening: Opening) -> ForRealTime<Opening> {
    ForRealTime::nothing().map(|()| opening)
}

/// Tries until it no longer would block; gives up when the other end takes nothing.
pub(super) fn insist<T>(
    what: &'static str,
    mut attempt: impl FnMut() -> io::Result<T>,
) -> Result<T, EndError> {
    let mut since = None;
    loop {
        match attempt() {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                // Only an end that has to wait asks the clock.
                if since.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                    return Err(EndError::Full);
                }
            }
            done => return done.map_err(EndError::system(what)),
        }
    }
}

/// Whether a read found nothing, rather than failed.
pub(super) fn is_nothing_yet(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_that_takes_nothing_is_given_up() {
        let refused = insist::<()>("write", || Err(ErrorKind::WouldBlock.into())).unwrap_err();
        assert!(matches!(refused, EndError::Full), "{refused}");
    }

    #[test]
    fn an_end_that_takes_something_in_the_end_is_not() {
        let mut attempts = 0;
        let done = insist("write", || {
            attempts += 1;
            match attempts {
                1 => Err(ErrorKind::WouldBlock.into()),
                2 => Err(ErrorKind::Interrupted.into()),
                _ => Ok(attempts),
            }
        });
        assert_eq!(done.unwrap(), 3);
    }

    #[test]
    fn a_reader_that_went_away_is_named_so() {
        let gone = insist::<()>("write", || Err(ErrorKind::BrokenPipe.into())).unwrap_err();
        assert_eq!(gone.to_string(), "the other end has gone");
        let denied = insist::<()>("write", || Err(ErrorKind::PermissionDenied.into())).unwrap_err();
        assert!(denied.to_string().starts_with("cannot write: "), "{denied}");
    }
}
