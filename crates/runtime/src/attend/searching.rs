//! Names that are looked for in a thread of their own: a pattern is compared with a million names, and other
//! requests are not to wait for that.

mod kept;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::thread::{self, JoinHandle};
use std::time::Instant;

use isochrone_engine::operate::{Selection, Signals};

use crate::control::{Begun, Code, Outcome, Refusal, Ticket};

use super::Attendant;
use kept::{IDLE, Kept};

/// What is asked of the signals of some names.
#[derive(Debug)]
pub(super) struct Search {
    /// `None`: all.
    pub(super) names: Option<Vec<String>>,
    pub(super) offset: usize,
    pub(super) limit: usize,
    pub(super) purpose: Purpose,
}

/// What the signals are looked for for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To read them.
    Read,
    /// To say what they are.
    Describe,
    /// To trace them, for a process.
    Trace { process: Option<u32> },
}

/// The searches that are not done yet.
#[derive(Default)]
pub(super) struct Searching {
    thread: Option<Searcher>,
    /// In the order in which they were asked for. They wait here, where they can be forgotten, and not
    /// with the thread.
    waiting: VecDeque<(Ticket, Search)>,
}

/// The end of the one who asks. Dropping it ends the thread when it has done its search.
struct Searcher {
    jobs: Option<Sender<Job>>,
    found: Receiver<Found>,
    thread: Option<JoinHandle<()>>,
    occupation: Occupation,
}

/// What the thread does.
#[derive(Debug, Default, PartialEq, Eq)]
enum Occupation {
    #[default]
    Idle,
    /// It looks for the names of a request.
    Searching(Ticket),
    /// It looks for the names of a request that nobody waits for any more.
    Abandoned,
}

struct Job {
    signals: Arc<Signals>,
    search: Search,
}

struct Found {
    search: Search,
    selection: Result<Selection, Refusal>,
}

impl Search {
    /// Looks for its page.
    fn page(&self, signals: &Arc<Signals>) -> Result<Selection, Refusal> {
        self.look(signals, self.offset, self.limit)
    }

    fn look(
        &self,
        signals: &Arc<Signals>,
        offset: usize,
        limit: usize,
    ) -> Result<Selection, Refusal> {
        match &self.names {
            Some(names) => Selection::of(signals, names.iter().map(String::as_str), offset, limit),
            None => Ok(Selection::of_all(signals, offset, limit)),
        }
    }

    /// Adds to its page what its purpose takes.
    fn complete(&self, page: Selection) -> Selection {
        match self.purpose {
            Purpose::Read => page.with_quality(),
            Purpose::Describe | Purpose::Trace { .. } => page,
        }
    }

    fn takes_long(&self, signals: &Signals) -> bool {
        match &self.names {
            Some(names) => Selection::takes_long(signals, names.iter().map(String::as_str)),
            None => Selection::takes_long(signals, ["*"]),
        }
    }
}

impl Attendant {
    /// Looks for signals, and goes on with them: at once, or when they are found.
    pub(super) fn search(&mut self, search: Search) -> Result<Begun, Refusal> {
        let signals = Arc::clone(self.shared.lock().operator.signals());
        let ticket = self.ticket();
        if search.takes_long(&signals) {
            self.searching.waiting.push_back((ticket, search));
            self.begin_next_search();
            return Ok(Begun::Later(ticket));
        }
        let selection = search.complete(search.page(&signals)?);
        match self.selected(ticket, selection, search.purpose)? {
            Some(begun) => Ok(begun),
            // The configuration was changed meanwhile.
            None => self.search(search),
        }
    }

    /// Goes on with what was found since the last time.
    pub(super) fn go_on_with_found(&mut self) {
        if let Some((ticket, found)) = self.searching.found()
            && let Some(outcome) = self.go_on(ticket, found)
        {
            self.ended.push_back((ticket, outcome));
        }
        self.begin_next_search();
    }

    /// `None`: it is not over yet.
    fn go_on(&mut self, ticket: Ticket, found: Result<Found, Refusal>) -> Option<Outcome> {
        let Found { search, selection } = match found {
            Ok(found) => found,
            Err(failure) => return Some(Err(failure)),
        };
        let begun =
            selection.and_then(|selection| self.selected(ticket, selection, search.purpose));
        match begun {
            Ok(Some(Begun::Ended(outcome))) => Some(outcome),
            Ok(Some(Begun::Later(_))) => None,
            Ok(None) => {
                self.searching.waiting.push_front((ticket, search));
                None
            }
            Err(failure) => Some(Err(failure)),
        }
    }

    fn begin_next_search(&mut self) {
        let signals = || Arc::clone(self.shared.lock().operator.signals());
        while let Some((ticket, failure)) = self.searching.begin_next(signals) {
            self.ended.push_back((ticket, Err(failure)));
        }
    }

    /// `None`: the configuration was changed since they were looked for.
    fn selected(
        &mut self,
        ticket: Ticket,
        selection: Selection,
        purpose: Purpose,
    ) -> Result<Option<Begun>, Refusal> {
        match purpose {
            Purpose::Read => self.read(ticket, selection),
            Purpose::Trace { process } => self.open_trace(ticket, selection, process),
            Purpose::Describe => {
                Ok(self.described(&selection).map(|reply| Begun::Ended(Ok(reply))))
            }
        }
    }
}

impl Searching {
    /// Nobody waits for this any more.
    pub(super) fn forget(&mut self, ticket: Ticket) {
        self.waiting.retain(|(waiting, _)| *waiting != ticket);
        if let Some(thread) = &mut self.thread
            && thread.occupation == Occupation::Searching(ticket)
        {
            thread.occupation = Occupation::Abandoned;
        }
    }

    /// What the thread has found, if somebody waits for it.
    fn found(&mut self) -> Option<(Ticket, Result<Found, Refusal>)> {
        let thread = self.thread.as_mut()?;
        let found = match thread.found.try_recv() {
            Ok(found) => Ok(found),
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err(panicked()),
        };
        let occupation = std::mem::take(&mut thread.occupation);
        if found.is_err() {
            self.thread = None;
        }
        match occupation {
            Occupation::Searching(ticket) => Some((ticket, found)),
            Occupation::Idle | Occupation::Abandoned => None,
        }
    }

    /// Gives the thread, if it is idle, the search that waits longest; returns whose it was if that fails.
    fn begin_next(&mut self, signals: impl FnOnce() -> Arc<Signals>) -> Option<(Ticket, Refusal)> {
        let of = self.thread.as_ref().map(|thread| &thread.occupation);
        if of.is_some_and(|occupation| *occupation != Occupation::Idle) {
            return None;
        }
        let (ticket, search) = self.waiting.pop_front()?;
        let begun = self.begin(ticket, Job { signals: signals(), search });
        begun.err().map(|failure| (ticket, failure))
    }

    fn begin(&mut self, ticket: Ticket, job: Job) -> Result<(), Refusal> {
        let thread = match self.thread.take() {
            Some(thread) => thread,
            None => Searcher::start()?,
        };
        let thread = self.thread.insert(thread);
        if thread.jobs.as_ref().is_none_or(|jobs| jobs.send(job).is_err()) {
            self.thread = None;
            return Err(panicked());
        }
        thread.occupation = Occupation::Searching(ticket);
        Ok(())
    }
}

fn panicked() -> Refusal {
    Refusal::new(Code::Internal, "the thread that looks for names panicked; ask again")
}

impl Searcher {
    fn start() -> Result<Self, Refusal> {
        let (jobs, taken) = channel();
        let (tell, found) = channel();
        let work = move || search(&taken, &tell);
        let thread = thread::Builder::new().name("control search".into()).spawn(work);
        let thread = thread.map_err(|error| {
            let message = format!("cannot start a thread to look for names in: {error}");
            Refusal::new(Code::Internal, message)
        })?;
        Ok(Self::of(jobs, found, Some(thread)))
    }

    fn of(jobs: Sender<Job>, found: Receiver<Found>, thread: Option<JoinHandle<()>>) -> Self {
        Self { jobs: Some(jobs), found, thread, occupation: Occupation::Idle }
    }
}

impl Drop for Searcher {
    fn drop(&mut self) {
        self.jobs = None;
        // A panic has been answered.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn search(jobs: &Receiver<Job>, tell: &Sender<Found>) {
    let mut kept = Kept::default();
    loop {
        match jobs.recv_timeout(IDLE) {
            Ok(Job { signals, search }) => {
                let page = kept.page(&signals, &search, Instant::now());
                let selection = page.map(|page| search.complete(page));
                if tell.send(Found { search, selection }).is_err() {
                    return;
                }
            }
            Err(RecvTimeoutError::Timeout) => kept.forget_old(Instant::now()),
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}
