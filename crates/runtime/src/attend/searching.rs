//! Names that are looked for in a thread of their own: a pattern is compared with a million names, and other
//! requests are not to wait for that.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_engine::operate::{Refusals, Selection, Signals};

use crate::control::{Begun, Code, Failure, Outcome, Ticket};

use super::Attendant;
use super::requests::failure;

/// Most signals that are kept for the next pages of those who asked for them.
const KEPT: usize = 2_000_000;
/// After so long without a search, none are.
const IDLE: Duration = Duration::from_secs(10);

/// What is asked of the signals of some names.
#[derive(Debug, Clone)]
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
}

/// The searches that are under way.
#[derive(Default)]
pub(super) struct Searching {
    thread: Option<Searcher>,
    waiting: BTreeMap<Ticket, Search>,
}

/// The end of the one who asks. Dropping it ends the thread when it has done its search.
struct Searcher {
    jobs: Option<Sender<Job>>,
    found: Receiver<Found>,
    thread: Option<JoinHandle<()>>,
}

struct Job {
    ticket: Ticket,
    signals: Arc<Signals>,
    search: Search,
}

struct Found {
    ticket: Ticket,
    selection: Result<Selection, Refusals>,
}

impl Search {
    /// Looks for its page.
    fn page(&self, signals: &Arc<Signals>) -> Result<Selection, Refusals> {
        self.look(signals, self.offset, self.limit)
    }

    fn look(
        &self,
        signals: &Arc<Signals>,
        offset: usize,
        limit: usize,
    ) -> Result<Selection, Refusals> {
        match &self.names {
            Some(names) => Selection::of(signals, names.iter().map(String::as_str), offset, limit),
            None => Ok(Selection::of_all(signals, offset, limit)),
        }
    }

    fn takes_long(&self, signals: &Signals) -> bool {
        let all = || vec!["*".to_owned()];
        let names = self.names.clone().unwrap_or_else(all);
        Selection::takes_long(signals, names.iter().map(String::as_str))
    }
}

impl Attendant {
    /// Looks for signals, and goes on with them: at once, or when they are found.
    pub(super) fn search(&mut self, search: Search) -> Result<Begun, Failure> {
        let signals = Arc::clone(self.shared.lock().operator.signals());
        if search.takes_long(&signals) {
            let ticket = self.ticket();
            self.searching.begin(ticket, signals, search)?;
            return Ok(Begun::Later(ticket));
        }
        let selection = search.page(&signals).map_err(failure)?;
        let (ticket, purpose) = (self.ticket(), search.purpose);
        match self.selected(ticket, selection, purpose)? {
            Some(begun) => Ok(begun),
            // The configuration was changed meanwhile.
            None => self.search(search),
        }
    }

    /// Goes on with what was found since the last time.
    pub(super) fn go_on_with_found(&mut self) {
        for (Found { ticket, selection }, search) in self.searching.found() {
            let begun = selection
                .map_err(failure)
                .and_then(|selection| self.selected(ticket, selection, search.purpose));
            let outcome: Outcome = match begun {
                Ok(Some(Begun::Ended(outcome))) => outcome,
                Ok(Some(Begun::Later(_))) => continue,
                Ok(None) => {
                    let signals = Arc::clone(self.shared.lock().operator.signals());
                    match self.searching.begin(ticket, signals, search) {
                        Ok(()) => continue,
                        Err(failure) => Err(failure),
                    }
                }
                Err(failure) => Err(failure),
            };
            self.ended.push_back((ticket, outcome));
        }
    }

    /// `None`: the configuration was changed since they were looked for.
    fn selected(
        &mut self,
        ticket: Ticket,
        selection: Selection,
        purpose: Purpose,
    ) -> Result<Option<Begun>, Failure> {
        match purpose {
            Purpose::Read => self.read(ticket, selection),
            Purpose::Describe => {
                Ok(self.described(&selection).map(|reply| Begun::Ended(Ok(reply))))
            }
        }
    }
}

impl Searching {
    fn begin(
        &mut self,
        ticket: Ticket,
        signals: Arc<Signals>,
        search: Search,
    ) -> Result<(), Failure> {
        if self.thread.is_none() {
            self.thread = Some(Searcher::start()?);
        }
        let job = Job { ticket, signals, search: search.clone() };
        let jobs = self.thread.as_ref().and_then(|thread| thread.jobs.as_ref());
        if jobs.is_none_or(|jobs| jobs.send(job).is_err()) {
            self.thread = None;
            let message = "the thread that looks for names panicked; ask again";
            return Err(Failure::new(Code::Internal, message));
        }
        self.waiting.insert(ticket, search);
        Ok(())
    }

    /// Nobody waits for this any more.
    pub(super) fn forget(&mut self, ticket: Ticket) {
        self.waiting.remove(&ticket);
    }

    fn found(&mut self) -> Vec<(Found, Search)> {
        let Some(thread) = &self.thread else { return Vec::new() };
        let found = thread.found.try_iter();
        found
            .filter_map(|found| Some((self.waiting.remove(&found.ticket)?, found)))
            .map(|(search, found)| (found, search))
            .collect()
    }
}

impl Searcher {
    fn start() -> Result<Self, Failure> {
        let (jobs, taken) = channel();
        let (tell, found) = channel();
        let work = move || search(&taken, &tell);
        let thread = thread::Builder::new().name("control search".into()).spawn(work);
        let thread = thread.map_err(|error| {
            let message = format!("cannot start a thread to look for names in: {error}");
            Failure::new(Code::Internal, message)
        })?;
        Ok(Self { jobs: Some(jobs), found, thread: Some(thread) })
    }
}

impl Drop for Searcher {
    fn drop(&mut self) {
        self.jobs = None;
        // A panic has been answered.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// What was found, for the pages that follow.
#[derive(Default)]
struct Kept(VecDeque<(Arc<Signals>, Option<Vec<String>>, Selection)>);

impl Kept {
    /// A page, of what is kept or looked for now.
    fn page(&mut self, signals: &Arc<Signals>, search: &Search) -> Result<Selection, Refusals> {
        // Those of another configuration are of no use.
        self.0.retain(|(of, ..)| Arc::ptr_eq(of, signals));
        let (offset, limit) = (search.offset, search.limit);
        let known = self.0.iter().find(|(_, names, _)| *names == search.names);
        if let Some((.., all)) = known {
            return Ok(all.page(offset, limit));
        }
        let all = search.look(signals, 0, usize::MAX)?;
        let page = all.page(offset, limit);
        self.0.push_back((Arc::clone(signals), search.names.clone(), all));
        while self.0.iter().map(|(.., all)| all.total()).sum::<usize>() > KEPT {
            self.0.pop_front();
        }
        Ok(page)
    }
}

fn search(jobs: &Receiver<Job>, tell: &Sender<Found>) {
    let mut kept = Kept::default();
    loop {
        match jobs.recv_timeout(IDLE) {
            Ok(Job { ticket, signals, search }) => {
                let selection = kept.page(&signals, &search);
                if tell.send(Found { ticket, selection }).is_err() {
                    return;
                }
            }
            Err(RecvTimeoutError::Timeout) => kept.0.clear(),
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}
