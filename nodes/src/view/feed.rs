//! The thread that takes in every cycle of the signals that pages show as curves, and the jitter of all cycles.
//!
//! A task has one trace, however many pages look at its signals, and none while no page is open.

mod task;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{Client, ClientError, Trace};
use isochrone_ipc::{Participant, ipc};

use self::task::{MAX_TRACED, RETRY_INTERVAL, Task, TraceSelection};
use super::shared::View;
use super::threads::{locked, start_thread};
use crate::failure::Failure;
use crate::operate::NodeArgs;

/// Between two looks for rows: the service holds those of some times as long.
const TURN: Duration = Duration::from_millis(5);
/// Between two looks at what the pages show.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);
/// How long signals are traced that no page shows any more, so that a page that is reloaded finds its curves.
const LINGER: Duration = Duration::from_secs(10);
/// How long an answer is waited for.
const PATIENCE: Duration = Duration::from_secs(2);

/// Starts the thread.
pub(super) fn start(args: &NodeArgs, view: &Arc<View>) -> Result<(), Failure> {
    let participant_args = args.clone();
    let view = view.clone();
    start_thread("view-curves", move || {
        // The session has joined the same domain a moment ago.
        match participant_args.domain.join("isochrone/view-curves") {
            Ok(participant) => Feed::new(participant_args.node, &view, participant).run(),
            Err(failure) => crate::terminal::note_failure(&failure),
        }
    })
}

struct Feed<'a> {
    node: String,
    view: &'a View,
    /// When each signal was last shown by a page.
    shown: HashMap<String, Instant>,
    open_since: Option<Instant>,
    tasks: BTreeMap<String, Task>,
    retry: Instant,
    client: Option<Rc<RefCell<Client>>>,
    // After the traces and the client, which have ports of it.
    participant: Participant<ipc::Service>,
}

impl<'a> Feed<'a> {
    fn new(node: String, view: &'a View, participant: Participant<ipc::Service>) -> Self {
        let (shown, tasks) = (HashMap::new(), BTreeMap::new());
        let (open_since, client, retry) = (None, None, Instant::now());
        Self { node, view, shown, open_since, tasks, retry, client, participant }
    }

    fn run(mut self) {
        let mut look = Instant::now();
        while !self.view.is_over.load(Ordering::Relaxed) {
            let now = Instant::now();
            if now >= look {
                look = now + LOOK_INTERVAL;
                self.participant.tend();
                if let Err(error) = self.look(now) {
                    tracing::info!("no curves at the moment: {error}");
                    self.leave();
                    self.retry = now + RETRY_INTERVAL;
                }
                self.tell_refused();
            }
            for (name, task) in &mut self.tasks {
                task.take_rows(name, self.view);
            }
            thread::sleep(TURN);
        }
    }

    /// Ends all traces.
    fn leave(&mut self) {
        for (name, task) in std::mem::take(&mut self.tasks) {
            locked(&self.view.curves).interrupt(&name);
            locked(&self.view.jitter).set_traced(&name, false);
            drop(task);
        }
        self.client = None;
    }

    /// Opens the traces that the pages need; an error if the node does not answer.
    fn look(&mut self, now: Instant) -> Result<(), ClientError> {
        if self.view.pages.is_any_open() {
            self.open_since = Some(now);
        }
        let lingers = |since: Instant| now.duration_since(since) < LINGER;
        let is_there = locked(&self.view.plant).is_there();
        if !is_there || !self.open_since.is_some_and(lingers) {
            self.leave();
            return Ok(());
        }
        if now < self.retry {
            return Ok(());
        }
        let shown = self.view.pages.curves();
        for name in &shown {
            self.shown.insert(name.clone(), now);
        }
        self.shown.retain(|_, since| lingers(*since));
        let client = match &self.client {
            Some(client) => client.clone(),
            None => {
                let client = Client::connect(&self.participant, &self.node, PATIENCE)?;
                let client = client.interrupted_by(self.view.is_over.clone());
                self.client.insert(Rc::new(RefCell::new(client))).clone()
            }
        };
        for (name, wanted) in self.wanted(&shown) {
            let task = self.tasks.entry(name.clone()).or_default();
            if let Some(trace) = &mut task.trace {
                trace.maintain();
            }
            let renewed = task.trace.as_mut().map_or(Ok(()), Trace::renew);
            match renewed {
                Ok(()) => {}
                Err(ClientError::Refused(_)) => task.end(&name, self.view),
                Err(error) => return Err(error),
            }
            task.follow(&name, wanted, &self.participant, &client, self.view)?;
        }
        Ok(())
    }

    /// The signals that shall be traced, by task: those that pages show, then those that they showed a moment
    /// ago. A task of which none is shown has one all the same, for its jitter.
    fn wanted(&self, shown: &BTreeSet<String>) -> BTreeMap<String, TraceSelection> {
        let plant = locked(&self.view.plant);
        let task_of = |name: &String| plant.signal(name).map(|signal| signal.task.as_str());
        let mut wanted = BTreeMap::new();
        for (task, one) in plant.one_signal_by_task() {
            let of_task = |name: &&String| task_of(name) == Some(task.as_str());
            let mut names: Vec<_> = shown.iter().filter(of_task).cloned().collect();
            // Where there is no room for all, those that are traced stay.
            let traced = self.tasks.get(&task).map_or(&[][..], |task| &task.names);
            names.sort_by_key(|name| !traced.contains(name));
            let left_out = names.split_off(names.len().min(MAX_TRACED));
            let mut before: Vec<_> = self.shown.keys().filter(|it| !shown.contains(*it)).collect();
            before.retain(of_task);
            before.sort();
            names.extend(before.into_iter().take(MAX_TRACED - names.len()).cloned());
            if names.is_empty() {
                names.push(one);
            }
            wanted.insert(task, TraceSelection { names, left_out });
        }
        wanted
    }

    fn tell_refused(&self) {
        let mut refused = BTreeMap::new();
        for (name, task) in &self.tasks {
            let full = format!(
                "the pages show {MAX_TRACED} signals of task \"{name}\", which is as many as can be traced"
            );
            refused.extend(task.left_out.iter().map(|signal| (signal.clone(), full.clone())));
            if let Some(why) = &task.refused {
                refused.extend(task.names.iter().map(|signal| (signal.clone(), why.clone())));
            }
        }
        locked(&self.view.refused).set(&refused);
    }
}
