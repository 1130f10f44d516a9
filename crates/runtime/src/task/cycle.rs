//! The thread of one task: set-up, and the cycle.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender};

use isochrone_cyclic::{
    Awake, Clock, CycleStart, Cyclic, FollowedData, Look, Monotonic, Release, Schedule, StopReason,
    ThreadGrant, ThreadRequest, WakeUps,
};
use isochrone_engine::{TaskEngine, TaskState};
use isochrone_ipc::{ForRealTime, OpenError, RealTime, Service};
use isochrone_timing::{CycleRecord, FollowRecord, LinkReport, TaskReport, warm_up_cycles};

use crate::node::alarms::Alarm;
use crate::redundancy::paired::{FollowingTask, Pairing, Standing};
use crate::task::account::Account;
use crate::task::alarms::AlarmSender;
use crate::task::bindings::Desk;
use crate::task::events::EventSender;
use crate::task::inputs::{InputPort, InputPorts, TaskInputs};
use crate::task::orders::Applier;
use crate::task::outputs::{Frame, Output, OutputPorts};
use crate::task::panics::{Panic, catch_panic};
use crate::task::real_time_thread::RealTimeThread;
use crate::task::records::{Cycle, RecordSender};
use crate::task::retained::Copier;
use crate::task::snapshots::Tap;

/// The arguments of a task's thread.
pub(crate) struct Job<S: Service> {
    pub(crate) schedule: Schedule,
    pub(crate) request: ThreadRequest,
    pub(crate) engine: TaskEngine,
    pub(crate) inputs: TaskInputs,
    pub(crate) services: Option<Services<S>>,
    pub(crate) stop: Arc<AtomicBool>,
    /// Set when the task has connected to a peer.
    pub(crate) has_connected: Arc<AtomicBool>,
    /// Set at the end, when the rings have everything that the task did.
    pub(crate) has_ended: Arc<AtomicBool>,
    pub(crate) orders: Applier,
    pub(crate) records: RecordSender,
    pub(crate) tap: Tap,
    pub(crate) events: EventSender,
    pub(crate) alarms: AlarmSender,
    /// Where its state is retained.
    pub(crate) copier: Option<Box<Copier>>,
    /// While it is set, nothing is sent.
    pub(crate) is_held: Arc<AtomicBool>,
    /// The number of its first cycle.
    pub(crate) first_cycle: u64,
    /// Reports that the set-up is done, or why it failed.
    pub(crate) ready: Sender<Result<Ready, OpenError>>,
    pub(crate) start: Receiver<Start>,
}

/// The outputs of a task, and the participant that opens its ports.
pub(crate) struct Services<S: Service> {
    pub(crate) participant: Arc<RealTime<S>>,
    pub(crate) outputs: Vec<Output>,
}

/// The report of a task's thread after its set-up.
pub(crate) struct Ready {
    pub(crate) grant: ThreadGrant,
    /// For each service that it reads.
    pub(crate) desks: Vec<Desk>,
}

/// The start of a task's thread.
#[derive(Clone, Copy)]
pub(crate) struct Start {
    /// The instant at which the common grid of all tasks begins.
    pub(crate) epoch_ns: u64,
    /// Cycles to run; `None`: until it is stopped.
    pub(crate) cycles: Option<u64>,
}

/// The report of a task's thread at its end.
pub(crate) struct FinishedTask {
    /// Why its loop ended; `None`: it ran all its cycles.
    pub(crate) stop_reason: Option<StopReason>,
    /// A panic that ended it, and the bank, by its index in the plan, in which it was.
    pub(crate) panic: Option<(Panic, Option<usize>)>,
    /// Its last cycle, as the ring may have had no room for the record.
    pub(crate) last: Option<Cycle>,
    /// Its counts and costs.
    pub(crate) report: TaskReport,
    pub(crate) links: Vec<LinkReport>,
    pub(crate) alarms: Vec<Alarm>,
    /// Its state after its last cycle, where that is retained; none after a panic.
    pub(crate) state: Option<TaskState>,
    /// How many configurations it had before its last.
    pub(crate) changes: u64,
}

/// A task's ports.
struct Ports<S: Service> {
    inputs: InputPorts<S>,
    outputs: OutputPorts<S>,
}

/// Runs a task to its end. `None`: it did not run, for a reason that was reported to `ready` or because the node was
/// stopped before.
///
/// `open` opens what the task needs because of its twin, if it has one.
pub(crate) fn run<S: Service, P: Pairing<S>>(
    job: Job<S>,
    open: impl FnOnce() -> Result<ForRealTime<P>, OpenError>,
) -> Option<FinishedTask> {
    let Job { mut engine, mut orders, mut records, mut tap, mut copier, .. } = job;
    let (mut events, mut alarms) = (job.events, job.alarms);
    let _end = EndOfNode { stop: job.stop.clone(), has_ended: job.has_ended };
    let opened = open()
        .and_then(|pairing| Ok((Ports::open(job.inputs, job.services)?, pairing)))
        .map(|((ports, desks), pairing)| (ports.and(pairing), desks));
    let (ports, desks) = match opened {
        Ok(opened) => opened,
        Err(error) => {
            let _ = job.ready.send(Err(error));
            return None;
        }
    };
    let (mut ports, grant) = RealTimeThread::prepare(job.request, ports);
    job.ready.send(Ok(Ready { grant, desks })).ok()?;
    let Start { epoch_ns, cycles: wanted } = job.start.recv().ok()?;

    let warm_up = warm_up_cycles(job.schedule.period_ns);
    let follows = job.schedule.follow_within_ns.is_some();
    let cyclic = Cyclic::new(Monotonic, job.schedule, epoch_ns, job.stop.clone());
    let mut cyclic = cyclic.counting_from(job.first_cycle);
    let mut account = Account::open(0);
    let mut restless = Restless::default();
    let mut cycles = 0;
    let mut last: Option<Cycle> = None;
    // The release whose frames say that another one follows.
    let mut unfinished: Option<Release> = None;
    let (ports, pairing) = &mut *ports;
    pairing.begin(&mut ports.outputs);
    let ended = catch_panic(|| {
        while wanted.is_none_or(|wanted| cycles < wanted) {
            let following = FollowingTask {
                engine: &mut engine,
                inputs: &mut ports.inputs,
                outputs: &mut ports.outputs,
                orders: &mut orders,
                alarms: &mut alarms,
            };
            let taken_over = match pairing.stand_by(&mut cyclic, following) {
                Standing::Holds => None,
                Standing::TookOver(release) => Some(release),
                Standing::Ended => break,
            };
            // Peers that joined while the thread slept are connected before the release, not after it.
            let mut waiting = Waiting {
                account: &mut account,
                ports: &mut *ports,
                orders: &mut orders,
                engine: &engine,
                last_cycle: last.as_ref().map(|last| last.record.cycle),
            };
            let released = if taken_over.is_some() {
                taken_over
            } else if follows {
                cyclic.wait_for_data(restless.wake_ups(), &mut waiting)
            } else {
                cyclic.wait_with(restless.wake_ups(), |awake| waiting.awake(awake))
            };
            if !pairing.holds() {
                // It was stopped for so long that the other one has taken over.
                continue;
            }
            let Some(release) = released else { break };

            orders.change(&mut engine, &mut tap, &mut events, &mut alarms, &mut copier, &release);
            orders.apply(&mut engine, &release);
            ports.inputs.read(&mut engine, &release);
            engine.step(release.cycle);
            ports.outputs.copy(&engine);
            let is_last = wanted.is_some_and(|wanted| cycles + 1 >= wanted);
            let left_out = pairing.left_out(release.cycle);
            let is_its = taken_over.is_some() || pairing.claim(release.cycle);
            // The process that held the node before has claimed it, and what was left out since.
            ports.outputs.pass_over(left_out + u64::from(!is_its));
            if is_its && !job.is_held.load(Ordering::Relaxed) {
                let flags = ports.inputs.flags();
                let frame = Frame::of(is_last);
                ports.outputs.send(&engine, &release, frame, flags, || pairing.holds());
            }
            unfinished = Some(release).filter(|_| !is_last);
            let end_ns = Monotonic.now_ns();
            cyclic.finished(end_ns);

            // The slack until the next release: work that is not urgent.
            account.library(|| {
                ports.outputs.prepare();
                ports.inputs.maintain();
                pairing.publish(&engine, &release, ports.outputs.next_sequence());
            });
            if restless.note(ports.connects(), end_ns) {
                job.has_connected.store(true, Ordering::Relaxed);
            }
            orders.read(&engine, release.cycle);
            events.look(&engine, release.cycle);
            alarms.look(engine.image(), release.cycle);
            ports.inputs.tell(&mut events);
            let record = record(&release, end_ns, cyclic.overruns());
            let cycle = Cycle { record, follow: ports.follow_record(&release) };
            tap.take(engine.image(), &cycle);
            orders.capture(&engine, &cycle);
            records.push(&cycle);
            last = Some(cycle);
            if let Some(copier) = &mut copier {
                copier.take(&engine, &record);
            }
            engine.maintain();
            orders.prepare(&mut engine, &release);
            cycles += 1;
            if cycles == warm_up {
                account = Account::open(ports.allocations());
            }
        }
    });
    // After a panic of a block the image is neither of that cycle nor of the one before.
    if let Some(release) =
        unfinished.filter(|_| ended.is_ok() && !job.is_held.load(Ordering::Relaxed))
        && pairing.holds()
        // The service goes on, and the standby gives this frame's number to another one.
        && !pairing.is_followed()
    {
        // The end of the task was not known when its last cycle sent its frames.
        ports.outputs.copy(&engine);
        let flags = ports.inputs.flags();
        ports.outputs.send(&engine, &release, Frame::Last, flags, || pairing.holds());
    }
    let is_whole = ended.is_ok();
    // Allocations and faults of a panic itself are no cost of the cycle.
    let has_costs = cycles > warm_up && ended.is_ok();
    let costs = if has_costs { account.close(ports.allocations()) } else { TaskReport::default() };
    let report = TaskReport {
        margin_ns: cyclic.margin_ns(),
        block_errors: Some(engine.block_errors()),
        input_rejects: Some(ports.inputs.rejects()),
        inputs: ports.inputs.reports(),
        connects: Some(ports.connects()),
        connect_errors: Some(ports.inputs.connect_errors() + ports.outputs.connect_errors()),
        lost_snapshots: Some(tap.lost()),
        ..costs
    };
    Some(FinishedTask {
        stop_reason: cyclic.stop_reason(),
        panic: ended.err().map(|panic| (panic, engine.stepping())),
        last,
        report,
        links: ports.inputs.links().chain(ports.outputs.links()).collect(),
        alarms: ports.inputs.alarms(),
        state: copier.filter(|_| is_whole).map(|_| engine.state_now()),
        changes: engine.changes(),
    })
}

impl<S: Service> Ports<S> {
    fn open(
        inputs: TaskInputs,
        services: Option<Services<S>>,
    ) -> Result<(ForRealTime<Self>, Vec<Desk>), OpenError> {
        let Some(Services { participant, outputs }) = services else {
            let inputs = InputPorts::without_ports(inputs);
            let none = |()| Self { inputs, outputs: OutputPorts::none() };
            return Ok((ForRealTime::nothing().map(none), Vec::new()));
        };
        let (inputs, desks) = InputPorts::open(&participant, inputs)?;
        let outputs = OutputPorts::open(&participant, &outputs)?;
        Ok((inputs.and(outputs).map(|(inputs, outputs)| Self { inputs, outputs }), desks))
    }

    fn maintain(&mut self) {
        self.inputs.maintain();
        self.outputs.maintain();
    }

    /// The rest of the record of a cycle that follows its data, after its frames were sent.
    fn follow_record(&self, release: &Release) -> Option<FollowRecord> {
        let follow = release.follow?;
        let source = self.inputs.followed();
        let taken_ns = source.and_then(|source| source.published_ns);
        let taken_ns = taken_ns.filter(|_| follow.begun != CycleStart::TimedOut);
        let sent_ns = self.outputs.published_ns();
        Some(FollowRecord {
            ready_ns: follow.ready_ns,
            begun: follow.counts,
            sent: source.map_or(0, InputPort::sent),
            frame_ns: taken_ns,
            latency_ns: taken_ns.zip(sent_ns).map(|(taken, sent)| sent.saturating_sub(taken)),
        })
    }

    fn connects(&self) -> u64 {
        self.inputs.connects() + self.outputs.connects()
    }

    /// Allocations by iceoryx2 while receiving and sending.
    fn allocations(&self) -> u64 {
        self.inputs.allocations() + self.outputs.allocations()
    }
}

/// What a task does while it waits for its next cycle.
struct Waiting<'a, S: Service> {
    account: &'a mut Account,
    ports: &'a mut Ports<S>,
    orders: &'a mut Applier,
    engine: &'a TaskEngine,
    last_cycle: Option<u64>,
}

impl<S: Service> FollowedData for Waiting<'_, S> {
    fn awake(&mut self, awake: Awake) {
        match (awake, self.last_cycle) {
            (Awake::Ahead, _) => self.account.library(|| self.ports.maintain()),
            // So that observers of a slow task need not wait for its next cycle.
            (Awake::Midway, Some(cycle)) => self.orders.read_between(self.engine, cycle),
            (Awake::Midway, None) => {}
        }
    }

    fn has_arrived(&mut self, look: Look) -> bool {
        self.ports.inputs.has_arrived(self.orders, look)
    }
}

/// Whether peers joined or left recently, so that more may follow.
#[derive(Default)]
struct Restless {
    connects: u64,
    /// How long after a peer joined or left others are expected to.
    until_ns: u64,
    now_ns: u64,
}

impl Restless {
    const FOR_NS: u64 = 1_000_000_000;

    /// Takes note of how many peers have come and gone; whether it was any since the last time.
    fn note(&mut self, connects: u64, now_ns: u64) -> bool {
        let has_connected = connects != self.connects;
        if has_connected {
            self.until_ns = now_ns.saturating_add(Self::FOR_NS);
        }
        (self.connects, self.now_ns) = (connects, now_ns);
        has_connected
    }

    fn wake_ups(&self) -> WakeUps {
        if self.now_ns < self.until_ns { WakeUps::Two } else { WakeUps::One }
    }
}

/// Ends the node when its task ends, also after a panic.
struct EndOfNode {
    stop: Arc<AtomicBool>,
    has_ended: Arc<AtomicBool>,
}

impl Drop for EndOfNode {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.has_ended.store(true, Ordering::Release);
    }
}

fn record(release: &Release, end_ns: u64, overruns: u64) -> CycleRecord {
    CycleRecord {
        cycle: release.cycle,
        release_ns: release.release_ns,
        start_ns: release.start_ns,
        end_ns,
        missed: release.missed,
        overruns,
    }
}
