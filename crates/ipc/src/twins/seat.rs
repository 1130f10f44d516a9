//! The place of a process as one of two twins. The kernel keeps it while the process lives, and frees it when it dies.

use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

use super::page::{self, TwinPage};
use crate::domain::locked_file;
use crate::error::EVERYTHING;
use crate::frames::publisher::unix_ns;
use crate::{Domain, OpenError, Participant, Service};

/// Why a process cannot be one of two twins: the node, the obstacle, and what to do.
#[derive(Error)]
#[non_exhaustive]
pub enum SeatError {
    /// Two live already.
    #[error(
        "node \"{node}\" has two redundant processes already ({first} and {second}); end one of them, or give this one \
         another name ([node] name)"
    )]
    Taken {
        /// The node.
        node: String,
        /// The process in the first seat.
        first: u32,
        /// The process in the second seat.
        second: u32,
    },
    /// It has too many tasks.
    #[error("a redundant node has at most {most} tasks, and \"{node}\" has more; divide it")]
    TooManyTasks {
        /// The node.
        node: String,
        /// The limit.
        most: usize,
    },
    /// The domain could not be locked.
    #[error(transparent)]
    Locked(OpenError),
    /// The page that the twins share cannot be used.
    #[error("{path}, which redundant processes of a node share, cannot be used: {source}")]
    Page {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

isochrone_model::debug_as_display!(SeatError);

/// One of the two seats of a node's twins. Dropping it frees it.
#[derive(Debug)]
pub struct Seat {
    number: u64,
    page: Arc<TwinPage>,
    _lock: File,
    other: PathBuf,
    /// The places of the tasks in the page.
    places: Vec<usize>,
    /// The term that it has from its start; 0: the other twin holds the node.
    term: AtomicU64,
    /// Behind the lock: the last one to leave the domain removes the page, if nobody sits.
    _domain: Domain,
}

impl<S: Service> Participant<S> {
    /// Takes one of the two seats of a node's twins, for a process with these tasks. The first one to sit takes the
    /// node over at once; whoever comes while the other one holds it stands by.
    ///
    /// Waits for the domain's lock.
    ///
    /// # Errors
    /// Both seats are taken, the domain cannot be locked, or the shared page cannot be used.
    pub fn take_seat(&self, node: &str, tasks: &[&str]) -> Result<Seat, SeatError> {
        let _held = self.lock(node).map_err(SeatError::Locked)?;
        let path = page::path(self.membership().config(), node);
        let failed = |source| SeatError::Page { path: path.clone(), source };
        let page = TwinPage::open(&path).map_err(failed)?;
        let file = |number: u64| {
            let mut name = path.clone().into_os_string();
            name.push(format!(".{number}"));
            PathBuf::from(name)
        };
        let mut free = Vec::new();
        for number in [1, 2] {
            let lock = locked_file::try_lock(&file(number)).map_err(failed)?;
            free.extend(lock.map(|lock| (number, lock)));
        }
        // Beside a living twin there is one seat left.
        let is_alone = free.len() == 2;
        let Some((number, lock)) = free.into_iter().next() else {
            let process = |seat| page.process(seat).unwrap_or_default();
            let (first, second) = (process(1), process(2));
            return Err(SeatError::Taken { node: node.to_owned(), first, second });
        };
        if is_alone {
            page.forget_tasks();
            page.forget_takeovers();
        }
        let places = tasks.iter().map(|task| page.place_of(task)).collect::<Option<Vec<_>>>();
        let too_many =
            || SeatError::TooManyTasks { node: node.to_owned(), most: page::MAX_TWIN_TASKS };
        let places = places.ok_or_else(too_many)?;
        page.sit(number, std::process::id());
        let (page, other) = (Arc::new(page), file(3 - number));
        let term = AtomicU64::new(0);
        let _domain = self.membership().domain().clone();
        let seat = Seat { number, page, _lock: lock, other, places, term, _domain };
        if is_alone {
            seat.begin();
        }
        Ok(seat)
    }

    /// Holds the node from its start, in place of a holder that died before the one in this seat could take over from
    /// it; whether that worked.
    ///
    /// # Errors
    /// The domain cannot be locked.
    pub fn start_over(&self, seat: &Seat) -> Result<bool, SeatError> {
        let _held = self.lock(EVERYTHING).map_err(SeatError::Locked)?;
        seat.page.forget_tasks();
        Ok(seat.begin())
    }
}

impl Seat {
    /// Takes the node over to start it, under the domain's lock.
    fn begin(&self) -> bool {
        self.page.set_grid(0, std::iter::empty());
        let taken = self.page.begin(self.number, unix_ns());
        self.term.store(taken.unwrap_or(0), Ordering::Release);
        taken.is_some()
    }

    /// Its number, 1 or 2.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// What it shares with the other.
    pub fn page(&self) -> &Arc<TwinPage> {
        &self.page
    }

    /// The places of its tasks in the page.
    pub fn places(&self) -> &[usize] {
        &self.places
    }

    /// The term with which it holds the node from its start; `None`: the other twin holds it.
    pub fn term(&self) -> Option<u64> {
        Some(self.term.load(Ordering::Acquire)).filter(|term| *term > 0)
    }

    /// The process in the other seat, living or dead.
    pub fn other_process(&self) -> Option<u32> {
        self.page.process(3 - self.number)
    }

    /// Whether the term is that of the other seat.
    pub fn is_held_by_other(&self) -> bool {
        let term = self.page.term();
        term != 0 && TwinPage::seat_of(term) != self.number
    }

    /// Whether a process has the other seat, or may have it: it cannot be seen where no file can be opened. Opens a file.
    pub fn has_twin(&self) -> bool {
        !matches!(locked_file::try_lock(&self.other), Ok(Some(_)))
    }
}
