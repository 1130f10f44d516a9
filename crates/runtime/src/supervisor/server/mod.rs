//! The requests of other programs to a running node.
//!
//! The supervisor serves them. Beside it are threads for what has to wait: one that [clears](clear) clients that died, one
//! for the services of [traces](trace_ports), and one for [jobs](jobs) that take long.

mod alarms;
mod applied;
mod apply;
mod describe;
mod force;
mod forces;
mod get;
mod jobs;
mod journal;
mod pages;
mod release;
mod requests;
mod save;
mod set;
mod signals;
mod trace;
mod trace_ports;
mod under_way;
mod undo;

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_control::desk::OrderOutcome;
use isochrone_ipc::{Participant, RealTime, RequestUpkeep, Service};
use isochrone_model::Access;

use crate::error::PrepareError;
use crate::operating::{Shared, Told, unix_ns};
use crate::panics;
use apply::{HeldUp, Making};
use isochrone_control::{CallResult, ControlService, Operated, Ticket, service_name};
use jobs::Jobs;
use save::Saving;
use trace::Tracing;
use under_way::UnderWay;

/// Between two looks for clients that died.
const UPKEEP_PAUSE: Duration = Duration::from_millis(100);

/// The control service of a node. Dropping it ends its threads.
pub(super) struct Serving<S: Service> {
    // The thread that publishes traces ends when nobody can ask for one any more.
    server: ControlServer,
    service: ControlService<S>,
    _beside: Beside,
}

impl<S: Service + 'static> Serving<S> {
    /// Opens the service, which is served from the start on.
    pub(super) fn open(
        participant: &Arc<RealTime<S>>,
        node: &str,
        control: Access,
        shared: &Shared,
    ) -> Result<Self, PrepareError> {
        let service = ControlService::open(participant.ordinary(), node)?;
        let mut beside = Beside::of(service_name(node));
        let (jobs, taken) = channel();
        let (tell, made) = channel();
        let tracing = Arc::clone(participant);
        beside.spawn("traces", move |_| trace_ports::publish(&tracing, &taken, &tell))?;
        let (of, participant) = (beside.service.clone(), Arc::clone(participant));
        let upkeep = service.upkeep();
        beside.spawn("control upkeep", move |stop| clear(&of, upkeep, &participant, stop))?;
        let server = ControlServer::new(node, control, shared, Tracing::new(jobs, made));
        Ok(Self { server, service, _beside: beside })
    }

    /// Begins to answer.
    pub(super) fn start(&mut self) {
        self.server.started_unix_ns = unix_ns();
    }

    /// Takes in what has come of a request of this service that still waits. Returns what is for everybody: all but its
    /// readings, and what is of others.
    pub(super) fn take(&mut self, told: Told) -> Option<Told> {
        let is_its = |one: &&mut UnderWay| one.is_about(&told.done);
        let Some(one) = self.server.under_way.iter_mut().find(is_its) else { return Some(told) };
        let for_all =
            Some(&told).filter(|told| !matches!(told.done, OrderOutcome::Read(_))).cloned();
        let operating = self.server.shared.lock();
        one.take(told, |name| operating.operator.value_type(name));
        for_all
    }

    /// Answers what is on its way to the tasks with what has come of it: no more will. Whoever waits for a
    /// configuration that is being made or saved, or for a trace, sees that the node is gone.
    pub(super) fn end_all(&mut self) {
        let ended = self.server.under_way.drain(..).map(UnderWay::end);
        self.server.ended.extend(ended);
    }

    /// Answers what can be answered, and begins what is asked for. Never waits.
    pub(super) fn serve(&mut self, participant: &Participant<S>) {
        self.server.collect();
        self.service.serve(&mut self.server, participant);
    }
}

/// Clears the clients of the service that died, until it is to stop.
///
/// It waits for the lock of the domain, which a process that starts holds for as long as that takes, or for as long as
/// it is stopped, and removes many files: nobody who is to answer may do that.
fn clear<S: Service>(
    service: &str,
    mut upkeep: RequestUpkeep<S>,
    participant: &RealTime<S>,
    stop: &AtomicBool,
) {
    while !stop.load(Ordering::Relaxed) {
        upkeep.tend(participant.ordinary());
        if let Some(stranger) = upkeep.new_stranger() {
            tracing::warn!(
                "service \"{service}\" has a second server: {stranger}; it sees all requests, and only clients \
                 that check who answers, as isochrone does, pass its answers over: end it"
            );
        }
        thread::park_timeout(UPKEEP_PAUSE);
    }
}

/// The threads beside the supervisor, for what has to wait. Dropping it ends them.
struct Beside {
    service: String,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Beside {
    fn of(service: String) -> Self {
        Self { service, stop: Arc::default(), threads: Vec::new() }
    }

    /// Starts a thread, whose panic is no end of the node.
    fn spawn(
        &mut self,
        name: &'static str,
        work: impl FnOnce(&AtomicBool) + Send + 'static,
    ) -> Result<(), PrepareError> {
        let (of, stop) = (self.service.clone(), Arc::clone(&self.stop));
        let work = move || {
            if let Err(panic) = catch_unwind(AssertUnwindSafe(|| work(&stop))) {
                let words = panics::words(&*panic);
                tracing::error!(
                    "the thread \"{name}\" of service \"{of}\" panicked: {words}; the node goes on \
                     without it until it is started again"
                );
            }
        };
        let spawned = thread::Builder::new().name(name.to_owned()).spawn(work);
        let service = || self.service.clone();
        let failed = |source| PrepareError::ServiceThread { service: service(), source };
        self.threads.push(spawned.map_err(failed)?);
        Ok(())
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            // A panic was reported where it was.
            let _ = thread.join();
        }
    }
}

/// Carries out what is asked for.
struct ControlServer {
    node: String,
    control: Access,
    started_unix_ns: u64,
    shared: Shared,
    tickets: u64,
    under_way: Vec<UnderWay>,
    jobs: Jobs,
    saving: Saving,
    making: Option<Making>,
    held_up: Option<HeldUp>,
    tracing: Tracing,
    ended: VecDeque<(Ticket, CallResult)>,
}

impl ControlServer {
    fn new(node: &str, control: Access, shared: &Shared, tracing: Tracing) -> Self {
        Self {
            node: node.to_owned(),
            control,
            started_unix_ns: 0,
            shared: shared.clone(),
            tickets: 0,
            under_way: Vec::new(),
            jobs: Jobs::default(),
            saving: Saving::default(),
            making: None,
            held_up: None,
            tracing,
            ended: VecDeque::new(),
        }
    }

    fn ticket(&mut self) -> Ticket {
        self.tickets += 1;
        Ticket(self.tickets)
    }

    /// Takes in what has come to its end, of requests that are under way and of the work beside the supervisor.
    fn collect(&mut self) {
        let complete = self.under_way.extract_if(.., |one| one.is_complete());
        self.ended.extend(complete.map(UnderWay::end));
        self.ended.extend(self.saving.made());
        self.send_made();
        self.tend_traces();
    }
}

impl Operated for ControlServer {
    fn ended(&mut self) -> Option<(Ticket, CallResult)> {
        self.ended.pop_front()
    }

    fn given_up(&mut self, ticket: Ticket) {
        self.forget_making(ticket);
    }
}
