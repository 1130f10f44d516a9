//! The supervisor: the one ordinary thread of a node.
//!
//! It does everything that is neither real time nor waiting for a disk: it opens its own ports, drains the rings of
//! the cycles, serves the requests of other programs, publishes telemetry, resolves layouts, keeps the alarms, and
//! changes over to new configurations. It never waits: answers that need a cycle or a disk are parked, and no step
//! except a search of names takes over 10 ms. Work that has to wait has threads of its own, see [`server`].
//!
//! It shares [`Operating`](crate::node::operating::Operating) with the threads of the program; all lock it for short work
//! only. Only the supervisor drains the rings.

mod batches;
mod ending;
mod layouts;
mod new_parts;
mod ports;
mod server;
mod telemetry;
mod turns;
mod units;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

use isochrone_ipc::{FrameLayout, RealTime, Service};

use crate::error::{NodePanicked, PrepareError, SupervisorPanicked};
use crate::node::alarms::Alarm;
use crate::node::operating::Shared;
use crate::node::outcome::{End, Outcome};
use crate::redundancy::twin::Twin;
use crate::task::panics;
use crate::task::threads::{Task, Threads};

use self::batches::Listeners;
pub use self::batches::{Batch, CycleEvent, Events};
pub(crate) use self::new_parts::NewParts;
pub(crate) use self::ports::NodeServices;
use self::ports::Ports;
pub(crate) use self::telemetry::cuts;
use self::turns::Supervised;

/// The handle of the thread. Dropping it ends the thread, and waits for that.
pub(crate) struct Supervisor {
    /// The thread waits for the start, and ends if none can come any more.
    start: Option<Sender<Start>>,
    thread: Option<JoinHandle<Option<Result<Outcome, NodePanicked>>>>,
    listeners: Listeners,
    ended: Arc<Ended>,
}

/// The thread while the tasks open their ports.
pub(crate) struct NewSupervisor {
    equip: Sender<Equipment>,
    opened: Receiver<Result<(), PrepareError>>,
    supervisor: Supervisor,
}

/// What is known when the tasks have opened their ports.
pub(crate) struct Equipment {
    pub(crate) shared: Shared,
    pub(crate) tasks: Vec<Task>,
    pub(crate) alarms: Vec<Alarm>,
    pub(crate) services: NodeServices,
}

/// The node's start.
pub(crate) struct Start {
    pub(crate) threads: Threads,
    pub(crate) started: SystemTime,
}

/// Whether the thread has ended, for threads that wait for that.
#[derive(Default)]
struct Ended {
    has_ended: Mutex<bool>,
    has_changed: Condvar,
}

impl NewSupervisor {
    /// Starts the thread, which first opens the node's telemetry.
    ///
    /// # Errors
    /// The node runs already, or the thread cannot be started.
    pub(crate) fn spawn<S: Service + 'static>(
        participant: Option<Arc<RealTime<S>>>,
        node: &str,
        layout: FrameLayout,
        twin: Option<Arc<Twin>>,
    ) -> Result<Self, PrepareError> {
        let (equip, equipment) = channel();
        let (start, started) = channel();
        let (tell, opened) = channel();
        let (listeners, ended) = (Listeners::default(), Arc::<Ended>::default());
        let at_end = AtEnd { listeners: listeners.clone(), ended: Arc::clone(&ended) };
        let node = node.to_owned();
        let heard = listeners.clone();
        let set_up = SetUp { node, layout, twin, listeners: heard, tell, equipment, started };
        let thread = thread::Builder::new().name("supervisor".to_owned());
        let thread = thread.spawn(move || {
            let _at_end = at_end;
            set_up.open(participant).map(supervise)
        });
        let thread =
            thread.map_err(|cause| PrepareError::no_thread("the node's supervisor", cause))?;
        let (start, thread) = (Some(start), Some(thread));
        let supervisor = Supervisor { start, thread, listeners, ended };
        let mut new = Self { equip, opened, supervisor };
        new.await_opened()?;
        Ok(new)
    }

    /// Makes it open everything else.
    ///
    /// # Errors
    /// A port or a thread cannot be created.
    pub(crate) fn equip(mut self, equipment: Equipment) -> Result<Supervisor, PrepareError> {
        // A thread that has panicked has reported it.
        let _ = self.equip.send(equipment);
        self.await_opened()?;
        Ok(self.supervisor)
    }

    fn await_opened(&mut self) -> Result<(), PrepareError> {
        if let Ok(opened) = self.opened.recv() {
            return opened;
        }
        let message = match self.supervisor.thread.take().map(JoinHandle::join) {
            Some(Err(panic)) => panics::message(&*panic),
            _ => "it ended during its set-up".to_owned(),
        };
        Err(SupervisorPanicked { message }.into())
    }
}

impl Supervisor {
    /// Makes it supervise tasks that start now.
    pub(crate) fn start(&mut self, start: Start) {
        if let Some(sender) = self.start.take() {
            // If it has panicked, this ends the tasks, and the outcome says so.
            let _ = sender.send(start);
        }
    }

    /// The events from now on.
    pub(crate) fn events(&self) -> Events {
        self.listeners.add()
    }

    /// Makes it take its next turn at once.
    pub(crate) fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }

    /// Whether the node has not ended.
    pub(crate) fn is_running(&self) -> bool {
        !*self.ended.lock()
    }

    /// Waits until the node has ended, but no longer than this; whether it has.
    pub(crate) fn await_end(&self, time: Option<Duration>) -> bool {
        let (ended, runs) = (self.ended.lock(), |has_ended: &mut bool| !*has_ended);
        let has_changed = &self.ended.has_changed;
        match time {
            Some(time) => {
                let waited = has_changed.wait_timeout_while(ended, time, runs);
                *waited.unwrap_or_else(PoisonError::into_inner).0
            }
            None => *has_changed.wait_while(ended, runs).unwrap_or_else(PoisonError::into_inner),
        }
    }

    /// Waits until the node has ended; returns its outcome. `None`: it was not started.
    pub(crate) fn join(&mut self) -> Option<Result<Outcome, NodePanicked>> {
        self.start = None;
        match self.thread.take()?.join() {
            Ok(outcome) => outcome,
            Err(panic) => {
                Some(Err(panicked(&*panic, Outcome::begun(SystemTime::now(), Vec::new()))))
            }
        }
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        let _ = self.join();
    }
}

impl Ended {
    fn lock(&self) -> MutexGuard<'_, bool> {
        self.has_ended.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Signals the end of the thread, also after a panic.
struct AtEnd {
    listeners: Listeners,
    ended: Arc<Ended>,
}

impl Drop for AtEnd {
    fn drop(&mut self) {
        self.listeners.end();
        *self.ended.lock() = true;
        self.ended.has_changed.notify_all();
    }
}

/// The state of the thread before the node starts.
struct SetUp {
    node: String,
    layout: FrameLayout,
    twin: Option<Arc<Twin>>,
    listeners: Listeners,
    tell: Sender<Result<(), PrepareError>>,
    equipment: Receiver<Equipment>,
    started: Receiver<Start>,
}

impl SetUp {
    /// Opens the ports, step by step. `None`: one was refused, or the node will not be started.
    fn open<S: Service + 'static>(
        self,
        participant: Option<Arc<RealTime<S>>>,
    ) -> Option<Supervised<S>> {
        let Self { node, layout, twin, listeners, tell, equipment, started } = self;
        let open = |participant| Ports::open(participant, &node, &layout, twin.clone());
        let ports = participant.map(open);
        let mut ports = match ports.transpose() {
            Ok(ports) => ports,
            Err(error) => {
                let _ = tell.send(Err(error.into()));
                return None;
            }
        };
        tell.send(Ok(())).ok()?;
        let Equipment { shared, tasks, alarms, services } = equipment.recv().ok()?;
        let opened =
            ports.as_mut().map_or(Ok(()), |ports| ports.open_all(&node, &shared, services));
        let is_open = opened.is_ok();
        tell.send(opened).ok().filter(|()| is_open)?;
        let Start { threads, started } = started.recv().ok()?;
        if let Some(control) = ports.as_mut().and_then(|ports| ports.control.as_mut()) {
            control.start();
        }
        let (duties_due, is_ending) = (Instant::now(), false);
        Some(Supervised {
            threads,
            node,
            tasks,
            shared,
            listeners,
            alarms,
            started,
            duties_due,
            is_ending,
            ports,
            twin,
        })
    }
}

/// Supervises a node to its end. A panic ends it, too: the tasks are asked to stop, and the journal and the recording
/// are closed.
fn supervise<S: Service + 'static>(mut node: Supervised<S>) -> Result<Outcome, NodePanicked> {
    let (started, shared) = (node.started, node.shared.clone());
    let stop = Arc::clone(&node.threads.stop);
    let ran = catch_unwind(AssertUnwindSafe(|| node.run()));
    stop.store(true, Ordering::Relaxed);
    let ended = catch_unwind(AssertUnwindSafe(|| node.end()));
    match (ran, ended) {
        (Ok(()), Ok(ended)) => ended,
        (Err(panic), Ok(Ok(outcome))) => Err(panicked(&*panic, outcome)),
        (Err(panic), Ok(Err(NodePanicked::Tasks { outcome, .. }))) => {
            Err(panicked(&*panic, *outcome))
        }
        (Err(_), Ok(error @ Err(NodePanicked::Supervisor { .. }))) => error,
        (Err(panic), Err(_)) | (Ok(()), Err(panic)) => {
            let refusals = shared.lock().refusals();
            Err(panicked(&*panic, Outcome::begun(started, refusals)))
        }
    }
}

fn panicked(panic: &(dyn std::any::Any + Send), outcome: Outcome) -> NodePanicked {
    let panic = SupervisorPanicked { message: panics::message(panic) };
    let outcome = Box::new(Outcome { end: End::SupervisorPanicked, ..outcome });
    NodePanicked::Supervisor { panic, outcome }
}
