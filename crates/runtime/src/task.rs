//! The thread of one task: set-up, and the cycle.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender};

use isochrone_cyclic::{
    Clock, Cyclic, Monotonic, PriorityReturn, Release, StopReason, ThreadGrant, ThreadRequest,
    ThreadUsage, WakeUps, prepare_thread, thread_allocations, thread_usage,
};
use isochrone_engine::{TaskEngine, TaskPlan};
use isochrone_ipc::{OpenError, Participant, Repair, give_up_file_override, ipc};
use isochrone_timing::{CycleRecord, DEFAULT_WARM_UP_CYCLES, LinkReport};
use rtrb::Producer;

use crate::bindings::Desk;
use crate::inputs::InputPorts;
use crate::ports::OutputPorts;
use crate::telemetry::Tap;

/// What a task's thread is given.
pub struct Job<'a> {
    /// What the task is.
    pub plan: &'a TaskPlan,
    /// Who opens its ports.
    pub participant: &'a Participant<ipc::Service>,
    /// What it steps.
    pub engine: TaskEngine,
    /// Cycles to run; until stopped if there is none.
    pub cycles: Option<u64>,
    /// Ends the node.
    pub stop: Arc<AtomicBool>,
    /// Where its cycle records go.
    pub records: Producer<CycleRecord>,
    /// Where snapshots of its signals go.
    pub tap: Tap,
    /// Tells that the set-up is done, or why it failed.
    pub ready: Sender<Result<Ready, OpenError>>,
    /// The instant at which the common grid of all tasks begins.
    pub epoch_ns: Receiver<u64>,
}

/// What a task's thread has to say when its set-up is done.
pub struct Ready {
    /// What the machine granted.
    pub grant: ThreadGrant,
    /// For each of its ports.
    pub repairs: Vec<Repair>,
    /// For each service that it reads.
    pub desks: Vec<Desk>,
}

/// What a task's thread has to say in the end.
pub struct Outcome {
    /// Why its loop ended.
    pub stop_reason: Option<StopReason>,
    /// Margin of a hybrid wait in the end.
    pub margin_ns: Option<u64>,
    /// Used by the cycles after the warm-up, in `elapsed_ns`.
    pub usage: ThreadUsage,
    /// From the end of the warm-up to the end, in ns.
    pub elapsed_ns: u64,
    /// From the release until the frames were sent; not ours only where a peer that came made
    /// iceoryx2 map memory there.
    pub allocations: u64,
    /// In the slack, where iceoryx2 loans the next frames.
    pub ipc_allocations: u64,
    /// Steps of blocks that reported an error.
    pub block_errors: u64,
    /// Samples that an input did not take.
    pub input_rejects: u64,
    /// How often a peer was seen to come or go.
    pub connects: u64,
    /// Connections to a peer that failed.
    pub connect_errors: u64,
    /// Snapshots of its signals that did not become telemetry.
    pub lost_snapshots: u64,
    /// What it received and sent. How long that took is for the readers to say.
    pub links: Vec<LinkReport>,
}

/// Runs a task to its end. `None`: it did not come to run, and `ready` was told why, or the node
/// was stopped before.
pub fn run(mut job: Job<'_>) -> Option<Outcome> {
    let _end = EndOfNode(job.stop.clone());
    let ports = InputPorts::open(job.participant, job.plan)
        .and_then(|inputs| Ok((inputs, OutputPorts::open(job.participant, job.plan)?)));
    let ((mut inputs, desks), mut outputs) = match ports {
        Ok(ports) => ports,
        Err(error) => {
            let _ = job.ready.send(Err(error));
            return None;
        }
    };
    // As locals after the ports these two are dropped before them: ports end under the domain's lock,
    // for which no real-time thread may wait.
    let _returned = PriorityReturn::default();
    let grant = prepare_thread(ThreadRequest {
        priority: job.plan.priority,
        cpu: job.plan.cpu.map(|cpu| cpu as usize),
    });
    // Every task: without a priority, too, a half-made peer would hold it up for ever.
    let _given_up = give_up_file_override();
    let repairs = inputs.repairs().chain(outputs.repairs()).collect();
    job.ready.send(Ok(Ready { grant, repairs, desks })).ok()?;
    let epoch_ns = job.epoch_ns.recv().ok()?;

    let mut cyclic = Cyclic::new(Monotonic, job.plan.schedule, epoch_ns, job.stop.clone());
    let mut account = Account::open();
    let mut restless = Restless::default();
    let mut cycles = 0;
    loop {
        // Peers that came while the thread slept are connected before the release, not after it.
        let connect = || {
            account.library(|| {
                inputs.maintain();
                outputs.maintain();
            });
        };
        let Some(release) = cyclic.wait_with(restless.wake_ups(), connect) else { break };

        inputs.read(&mut job.engine, release.start_ns);
        job.engine.step(release.cycle);
        outputs.send(&job.engine, &release);
        let end_ns = Monotonic.now_ns();
        cyclic.finished(end_ns);

        // The slack: what may take its time, until the next release.
        account.library(|| {
            outputs.prepare();
            inputs.maintain();
        });
        restless.note(inputs.connects() + outputs.connects(), end_ns);
        job.tap.take(job.engine.image());
        // A full ring drops the record, and the reader of the ring sees the gap.
        let _ = job.records.push(record(&release, end_ns, cyclic.overruns()));
        cycles += 1;
        if cycles == DEFAULT_WARM_UP_CYCLES {
            account = Account::open();
        }
        if job.cycles.is_some_and(|wanted| cycles >= wanted) {
            break;
        }
    }
    Some(Outcome {
        stop_reason: cyclic.stop_reason(),
        margin_ns: cyclic.margin_ns(),
        usage: thread_usage().since(account.usage),
        elapsed_ns: Monotonic.now_ns().saturating_sub(account.opened_ns),
        allocations: (thread_allocations() - account.allocations)
            .saturating_sub(account.library_allocations),
        ipc_allocations: account.library_allocations,
        block_errors: job.engine.block_errors(),
        input_rejects: inputs.rejects(),
        connects: inputs.connects() + outputs.connects(),
        connect_errors: inputs.connect_errors() + outputs.connect_errors(),
        lost_snapshots: job.tap.lost(),
        links: inputs.links().chain(outputs.links()).collect(),
    })
}

/// Whether peers came or went a short while ago, so that more are to be expected.
#[derive(Default)]
struct Restless {
    connects: u64,
    /// How long peers are expected to come and go.
    until_ns: u64,
    now_ns: u64,
}

impl Restless {
    const FOR_NS: u64 = 1_000_000_000;

    fn note(&mut self, connects: u64, now_ns: u64) {
        if connects != self.connects {
            self.until_ns = now_ns.saturating_add(Self::FOR_NS);
        }
        (self.connects, self.now_ns) = (connects, now_ns);
    }

    fn wake_ups(&self) -> WakeUps {
        if self.now_ns < self.until_ns { WakeUps::Two } else { WakeUps::One }
    }
}

/// One task's end is the node's, also if it ends in a panic.
struct EndOfNode(Arc<AtomicBool>);

impl Drop for EndOfNode {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
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

/// What the thread had used when counting began.
struct Account {
    usage: ThreadUsage,
    opened_ns: u64,
    allocations: u64,
    /// Allocations since then that were iceoryx2's.
    library_allocations: u64,
}

impl Account {
    fn open() -> Self {
        Self {
            usage: thread_usage(),
            opened_ns: Monotonic.now_ns(),
            allocations: thread_allocations(),
            library_allocations: 0,
        }
    }

    /// Does something whose allocations are not ours.
    fn library(&mut self, work: impl FnOnce()) {
        let before = thread_allocations();
        work();
        self.library_allocations += thread_allocations() - before;
    }
}
