//! The requests of other programs to a running node, in threads of their own.

mod answers;
mod applied;
mod applying;
mod jobs;
mod requests;
mod saving;
mod trace_ports;
mod traces;
mod under_way;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_engine::Plan;
use isochrone_ipc::{OpenError, RealTime, RequestUpkeep, Service};
use isochrone_model::Access;

use crate::error::PrepareError;
use crate::operating::{Shared, unix_ns};
use crate::panics;
use applying::Making;
use isochrone_control::{
    Begun, Call, CallResult, Caller, ControlService, Operated, Refusal, Ticket, service_name,
};
use jobs::Jobs;
use saving::Saving;
use traces::Tracing;
use under_way::UnderWay;

/// Between two looks for requests, and for what has become of them.
const PAUSE: Duration = Duration::from_millis(2);
/// Between two looks for clients that died.
const UPKEEP_PAUSE: Duration = Duration::from_millis(100);

/// The threads that serve. Dropping it ends them.
pub(crate) struct Serving {
    stop: Arc<AtomicBool>,
    start: Option<Sender<()>>,
    threads: Vec<JoinHandle<()>>,
}

impl Serving {
    /// Opens the service of a node, which is served from the start on.
    pub(crate) fn open<S: Service + 'static>(
        participant: Arc<RealTime<S>>,
        plan: &Plan,
        shared: &Shared,
    ) -> Result<Self, PrepareError> {
        let service = service_name(&plan.node);
        let stop = Arc::new(AtomicBool::new(false));
        let (start, started) = channel();
        let (opened, is_open) = channel();
        let mut serving = Self { stop: Arc::clone(&stop), start: Some(start), threads: Vec::new() };
        let (jobs, taken) = channel();
        let (tell, made) = channel();
        let attendant = ControlServer::new(plan, shared, Tracing::new(jobs, made));
        let ports = Arc::clone(&participant);
        let tracing = Arc::clone(&participant);
        serving.spawn(&service, "control", move || {
            serve(&ports, attendant, &stop, &opened, &started);
        })?;
        serving.spawn(&service, "traces", move || trace_ports::publish(&tracing, &taken, &tell))?;
        // Without an answer it has panicked, which is reported there.
        let Ok(upkeep) = is_open.recv() else { return Ok(serving) };
        let mut upkeep = upkeep?;
        let stop = Arc::clone(&serving.stop);
        let of = service.clone();
        serving.spawn(&service, "control upkeep", move || {
            while !stop.load(Ordering::Relaxed) {
                upkeep.tend(participant.ordinary());
                if let Some(stranger) = upkeep.new_stranger() {
                    tracing::warn!(
                        "service \"{of}\" has a second server: {stranger}; it sees all requests, and only \
                         clients that check who answers, as isochrone does, pass its answers over: end it"
                    );
                }
                thread::park_timeout(UPKEEP_PAUSE);
            }
        })?;
        Ok(serving)
    }

    /// Begins to answer.
    pub(crate) fn start(&mut self) {
        if let Some(start) = self.start.take() {
            // A thread that panicked takes no start, and has said so.
            let _ = start.send(());
        }
    }

    /// Starts a thread, whose panic is no end of the node.
    fn spawn(
        &mut self,
        service: &str,
        name: &'static str,
        work: impl FnOnce() + Send + 'static,
    ) -> Result<(), PrepareError> {
        let of = service.to_owned();
        let work = move || {
            if let Err(panic) = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)) {
                let words = panics::words(&*panic);
                tracing::error!(
                    "the thread \"{name}\" of service \"{of}\" panicked: {words}; the node goes on \
                     without it, and takes no requests until it is started again"
                );
            }
        };
        let spawned = thread::Builder::new().name(name.to_owned()).spawn(work);
        let failed = |source| PrepareError::ServiceThread { service: service.to_owned(), source };
        self.threads.push(spawned.map_err(failed)?);
        Ok(())
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.start = None;
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            // A panic was reported where it was.
            let _ = thread.join();
        }
    }
}

/// Opens the desk, as ports stay in their thread, and serves from the start to the end of the node.
fn serve<S: Service>(
    participant: &RealTime<S>,
    mut attendant: ControlServer,
    stop: &AtomicBool,
    opened: &Sender<Result<RequestUpkeep<S>, OpenError>>,
    started: &Receiver<()>,
) {
    let participant = participant.ordinary();
    let mut desk = match ControlService::open(participant, &attendant.node) {
        Ok(desk) => desk,
        Err(error) => return drop(opened.send(Err(error))),
    };
    let _ = opened.send(Ok(desk.upkeep()));
    if started.recv().is_err() {
        return;
    }
    attendant.started_unix_ns = unix_ns();
    while !stop.load(Ordering::Relaxed) {
        desk.serve(&mut attendant, participant);
        thread::sleep(PAUSE);
    }
    // What the last cycles did is answered yet.
    desk.serve(&mut attendant, participant);
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
    tracing: Tracing,
    ended: VecDeque<(Ticket, CallResult)>,
}

impl ControlServer {
    fn new(plan: &Plan, shared: &Shared, tracing: Tracing) -> Self {
        Self {
            node: plan.node.clone(),
            control: plan.control,
            started_unix_ns: 0,
            shared: shared.clone(),
            tickets: 0,
            under_way: Vec::new(),
            jobs: Jobs::default(),
            saving: Saving::default(),
            making: None,
            tracing,
            ended: VecDeque::new(),
        }
    }

    fn ticket(&mut self) -> Ticket {
        self.tickets += 1;
        Ticket(self.tickets)
    }

    /// Takes in what has come of the requests that are under way.
    fn collect(&mut self) {
        let mut operating = self.shared.lock();
        operating.take_back();
        let came = operating.for_service();
        let is_over = operating.is_over();
        drop(operating);
        for told in came {
            let is_its = |one: &&mut UnderWay| one.is_about(&told.done);
            if let Some(one) = self.under_way.iter_mut().find(is_its) {
                one.take(told);
            }
        }
        let is_over = |one: &mut UnderWay| one.is_complete() || is_over;
        for one in self.under_way.extract_if(.., is_over) {
            let (ticket, outcome) = one.end();
            self.ended.push_back((ticket, outcome));
        }
        self.ended.extend(self.saving.made());
        self.send_made();
        self.tend_traces();
    }
}

impl Operated for ControlServer {
    fn begin(&mut self, call: Call, caller: Caller) -> Begun {
        let outcome = match call {
            Call::Describe(_) => Ok(self.describe()),
            Call::Signals(params) => self.signals(&params),
            Call::Forces(params) => Ok(self.forces(&params)),
            Call::Journal(params) => Ok(self.journal(&params)),
            Call::Alarms(params) => Ok(self.alarms(&params)),
            Call::Get(params) => return self.get(params).unwrap_or_else(refused),
            Call::Set(params) => return self.set(params, caller).unwrap_or_else(refused),
            Call::Force(params) => return self.force(params, caller).unwrap_or_else(refused),
            Call::Release(params) => return self.release(params, caller).unwrap_or_else(refused),
            Call::Undo(params) => return self.undo(params, caller).unwrap_or_else(refused),
            Call::Save(params) => return self.save(&params, caller).unwrap_or_else(refused),
            Call::Apply(params) => return self.apply(params, caller).unwrap_or_else(refused),
            Call::Trace(params) => return self.trace(params, caller).unwrap_or_else(refused),
        };
        Begun::Ended(outcome)
    }

    fn ended(&mut self) -> Option<(Ticket, CallResult)> {
        if self.ended.is_empty() {
            self.collect();
        }
        self.ended.pop_front()
    }

    fn given_up(&mut self, ticket: Ticket) {
        self.forget_making(ticket);
    }
}

fn refused(failure: Refusal) -> Begun {
    Begun::Ended(Err(failure))
}
