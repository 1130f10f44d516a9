//! The requests of other programs to a running node.
//!
//! The supervisor serves them. Work that has to wait has threads of its own: one [removes](clear) clients that died,
//! one has the services of [traces](trace_ports), and one does [jobs](jobs) that take long.

mod applied;
mod apply;
mod changing;
mod jobs;
mod looking;
mod making;
mod open_traces;
mod requests;
mod save;
mod saving;
mod trace;
mod trace_ports;
mod under_way;

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
use crate::node::operating::{RequestOutcome, Shared};
use crate::task::clocks::unix_ns;
use crate::task::panics;
use isochrone_control::{
    Begun, Call, CallResult, Caller, Code, ControlService, Operated, Refusal, Reply, Ticket,
    service_name,
};
use jobs::Jobs;
use making::{HeldUp, Making};
use open_traces::Tracing;
use saving::Saving;
use under_way::UnderWay;

/// Between two looks for clients that died.
const UPKEEP_PAUSE: Duration = Duration::from_millis(100);

/// The control service of a node. Dropping it ends its threads.
pub(super) struct Serving<S: Service> {
    // The thread that publishes traces ends when nobody can ask for one any more.
    server: ControlServer,
    service: ControlService<S>,
    _threads: ServiceThreads,
}

impl<S: Service + 'static> Serving<S> {
    /// Opens the service. Requests are answered from the start of the node on.
    pub(super) fn open(
        participant: &Arc<RealTime<S>>,
        node: &str,
        control: Access,
        shared: &Shared,
    ) -> Result<Self, PrepareError> {
        let service = ControlService::open(participant.ordinary(), node)?;
        let mut threads = ServiceThreads::of(service_name(node));
        let (jobs, taken) = channel();
        let (tell, made) = channel();
        let tracing = Arc::clone(participant);
        threads.spawn("traces", move |_| trace_ports::publish(&tracing, &taken, &tell))?;
        let (of, participant) = (threads.service.clone(), Arc::clone(participant));
        let upkeep = service.upkeep();
        threads.spawn("control upkeep", move |stop| clear(&of, upkeep, &participant, stop))?;
        let server = ControlServer::new(node, control, shared, Tracing::new(jobs, made));
        Ok(Self { server, service, _threads: threads })
    }

    /// Begins to answer requests.
    pub(super) fn start(&mut self) {
        self.server.started_unix_ns = unix_ns();
    }

    /// Takes in the outcome of a request, for the client that waits for it. Returns the outcome for all receivers of
    /// events, except readings of this service's clients.
    pub(super) fn take(&mut self, outcome: RequestOutcome) -> Option<RequestOutcome> {
        let is_its = |one: &&mut UnderWay| one.is_about(&outcome.done);
        let Some(one) = self.server.under_way.iter_mut().find(is_its) else { return Some(outcome) };
        let for_all = Some(&outcome)
            .filter(|outcome| !matches!(outcome.done, OrderOutcome::Read(_)))
            .cloned();
        one.take(outcome);
        for_all
    }

    /// Answers requests that can be answered, and begins new ones. Never waits.
    pub(super) fn serve(&mut self, participant: &Participant<S>) {
        self.server.collect();
        self.service.serve(&mut self.server, participant);
    }

    /// Leaves all requests to the process that holds the node.
    pub(super) fn stand_by(&mut self, participant: &Participant<S>) {
        self.service.stand_by(participant);
    }

    /// Answers all requests for the last time.
    pub(super) fn end(&mut self, participant: &Participant<S>) {
        self.serve(participant);
        self.server.end_all();
        self.service.answer(&mut self.server);
    }
}

/// Removes clients that died from the control service, until `stop` is set.
///
/// This has a thread of its own, as it deletes many files and waits for the domain's lock: a process that starts holds
/// that lock, for as long as it is stopped if it is. The thread that answers requests must not wait so long.
fn clear<S: Service>(
    service: &str,
    mut upkeep: RequestUpkeep<S>,
    participant: &RealTime<S>,
    stop: &AtomicBool,
) {
    while !stop.load(Ordering::Relaxed) {
        upkeep.tend(participant.ordinary());
        // The server of the other process of the node leaves the answers to this one, or this one to that.
        if !participant.ordinary().is_twin()
            && let Some(stranger) = upkeep.new_stranger()
        {
            tracing::warn!(
                "service \"{service}\" has a second server: {stranger}; it sees all requests, and only clients \
                 that check who answers, as isochrone does, pass its answers over: end it"
            );
        }
        thread::park_timeout(UPKEEP_PAUSE);
    }
}

/// The threads for work that has to wait. Dropping it ends them.
struct ServiceThreads {
    service: String,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl ServiceThreads {
    fn of(service: String) -> Self {
        Self { service, stop: Arc::default(), threads: Vec::new() }
    }

    /// Starts a thread. A panic there does not end the node.
    fn spawn(
        &mut self,
        name: &'static str,
        work: impl FnOnce(&AtomicBool) + Send + 'static,
    ) -> Result<(), PrepareError> {
        let (of, stop) = (self.service.clone(), Arc::clone(&self.stop));
        let work = move || {
            if let Err(panic) = catch_unwind(AssertUnwindSafe(|| work(&stop))) {
                let message = panics::message(&*panic);
                tracing::error!(
                    "the thread \"{name}\" of service \"{of}\" panicked: {message}; the node goes on \
                     without it until it is started again"
                );
            }
        };
        let spawned = thread::Builder::new().name(name.to_owned()).spawn(work);
        let service = &self.service;
        let failed = |cause| {
            PrepareError::no_thread(format_args!("the thread of service \"{service}\""), cause)
        };
        self.threads.push(spawned.map_err(failed)?);
        Ok(())
    }
}

impl Drop for ServiceThreads {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            // A panic has been reported by its thread.
            let _ = thread.join();
        }
    }
}

/// Carries out a request.
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

    /// Collects requests that are finished, and results of the other threads.
    fn collect(&mut self) {
        let complete = self.under_way.extract_if(.., |one| one.is_complete());
        self.ended.extend(complete.map(UnderWay::end));
        self.ended.extend(self.saving.made());
        self.send_made();
        self.tend_traces();
    }

    /// Answers requests that are on their way to the tasks with what has come back so far, as no more will, and
    /// refuses all others.
    fn end_all(&mut self) {
        self.ended.extend(self.under_way.drain(..).map(UnderWay::end));
        let making = self.end_making().into_iter();
        let parked = making.chain(self.saving.end()).chain(self.tracing.end());
        let refused =
            || Refusal::new(Code::TooLate, "the node is ending, and does not do this any more");
        self.ended.extend(parked.map(|ticket| (ticket, Err(refused()))));
    }
}

impl Operated for ControlServer {
    fn begin(&mut self, call: Call, caller: Caller) -> Result<Begun<Reply>, Refusal> {
        call.begin(self, caller)
    }

    fn ended(&mut self) -> Option<(Ticket, CallResult)> {
        self.ended.pop_front()
    }

    fn given_up(&mut self, ticket: Ticket) {
        self.forget_making(ticket);
    }
}

#[cfg(test)]
mod tests {
    use isochrone_control::{ApplyParams, Handle, Params, SaveParams, TraceParams};
    use isochrone_engine::{Plan, Rules, Source};

    use super::*;
    use crate::Node;

    const NODE: &str = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"10ms\"\n\
                        [[block]]\nname = \"saw\"\ntype = \"SawTooth\"\n";

    fn ticket<P: Params>(server: &mut ControlServer, params: P) -> Ticket
    where
        ControlServer: Handle<P>,
    {
        match server.handle(params, Caller::default()) {
            Ok(Begun::Later(ticket)) => ticket,
            _ => panic!("it is not answered later"),
        }
    }

    #[test]
    fn what_is_not_done_when_the_node_ends_is_refused() {
        let plan = Plan::new(Source::new("n.toml", NODE), &Rules::default()).unwrap();
        let node = Node::prepare_alone(&plan).unwrap().start();
        // Nobody opens the services of traces, and the thread for jobs has another one.
        let ((jobs, _taken), (_tell, made)) = (channel(), channel());
        let tracing = Tracing::new(jobs, made);
        let mut server = ControlServer::new("n", Access::Force, &node.shared, tracing);
        let (_go, gone) = channel::<()>();
        let _busy = server.jobs.begin(move || gone.recv()).unwrap();

        let configuration = NODE.to_owned();
        let tickets = [
            ticket(&mut server, ApplyParams { configuration, ..ApplyParams::default() }),
            ticket(&mut server, SaveParams::default()),
            ticket(&mut server, SaveParams::default()),
            ticket(
                &mut server,
                TraceParams { signals: Some(vec!["saw.value".into()]), ..TraceParams::default() },
            ),
        ];
        server.collect();
        assert!(server.ended.is_empty());
        server.end_all();
        let ended: Vec<_> = std::iter::from_fn(|| server.ended()).collect();
        assert_eq!(ended.iter().map(|(ticket, _)| *ticket).collect::<Vec<_>>(), tickets);
        for (_, result) in ended {
            let refusal = result.unwrap_err();
            assert_eq!(refusal.code, Code::TooLate);
            assert_eq!(refusal.message, "the node is ending, and does not do this any more");
        }
    }
}
