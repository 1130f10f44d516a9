//! The threads of a node's tasks, from their set-up to their end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use isochrone_cyclic::{Pinning, ThreadRequest};
use isochrone_engine::{BankPlan, TaskEngine, TaskPlan};
use isochrone_ipc::{ForRealTime, OpenError, RealTime, Service};
use isochrone_timing::TaskTiming;

use crate::error::{PrepareError, TaskPanicked};
use crate::keeping::state::WarmTask;
use crate::node::operating::Lane;
use crate::placement::FollowedFrames;
use crate::redundancy::paired::{Alone, NewPaired, Paired};
use crate::task::alarms::{self, AlarmReceiver};
use crate::task::cycle::{self, FinishedTask, Job, Ready, Services, Start};
use crate::task::events::Log;
use crate::task::faults::Faults;
use crate::task::inputs::TaskInputs;
use crate::task::last_second::Seconds;
use crate::task::panics;
use crate::task::records::RecordReceiver;
use crate::task::responses::Responses;
use crate::task::retained::Copier;
use crate::task::snapshots::Tap;
use crate::task::{events, orders, outputs, records};

/// The threads of a node's tasks. Dropping them ends them, and waits until they have ended.
#[derive(Default)]
pub(crate) struct Threads {
    pub(crate) stop: Arc<AtomicBool>,
    /// Set when a task has connected to a peer, whose memory it has then mapped.
    pub(crate) has_connected: Arc<AtomicBool>,
    /// While it is set, nothing is sent.
    pub(crate) is_held: Arc<AtomicBool>,
    threads: Vec<Thread>,
}

/// A task whose thread opens its ports.
pub(crate) struct Spawned {
    /// Receives a report when the ports are open, or cannot be opened.
    pub(crate) ready: Receiver<Result<Ready, OpenError>>,
    pub(crate) lane: Lane,
    pub(crate) task: Task,
}

/// The supervisor's part of a task.
pub(crate) struct Task {
    pub(crate) name: String,
    /// For each bank its blocks, for messages about one of them.
    pub(crate) banks: Vec<String>,
    pub(crate) timing: TaskTiming,
    pub(crate) records: RecordReceiver,
    /// For a task that follows a service.
    pub(crate) followed: Option<FollowedFrames>,
    pub(crate) log: Log,
    pub(crate) alarms: AlarmReceiver,
}

/// What a task has of earlier runs, and how it is copied for later ones.
#[derive(Default)]
pub(crate) struct RetainedTask {
    pub(crate) warm: Option<WarmTask>,
    pub(crate) copier: Option<Box<Copier>>,
    /// Its alarms that were active.
    pub(crate) active: Vec<usize>,
}

/// What a task is connected with.
pub(crate) struct Connections<'a, S: Service> {
    /// `None` in a node without services.
    pub(crate) participant: Option<&'a Arc<RealTime<S>>>,
    /// Where this is one of two processes of the node.
    pub(crate) paired: Option<NewPaired<S>>,
}

struct Thread {
    task: String,
    thread: JoinHandle<Option<FinishedTask>>,
    start: Sender<Start>,
}

impl Threads {
    /// Starts the thread of a task, which opens its ports and then waits.
    pub(crate) fn spawn<S: Service + 'static>(
        &mut self,
        task: &TaskPlan,
        cpu: Pinning,
        engine: TaskEngine,
        tap: Tap,
        retained: RetainedTask,
        connections: Connections<'_, S>,
    ) -> Result<Spawned, PrepareError> {
        let Connections { participant, paired } = connections;
        let RetainedTask { warm, copier, active } = retained;
        let first_cycle = warm.as_ref().map_or(0, |task| task.warm.first_cycle);
        let first_cycle = paired.as_ref().map_or(first_cycle, |it| it.first_cycle(first_cycle));
        let (ready, is_ready) = channel();
        let (start, started) = channel();
        let schedule = task.settings.schedule();
        let (sender, records) = records::ends(&schedule);
        let (applier, orders) = orders::ends();
        let timing = TaskTiming::new(schedule.period_ns).counting_from(first_cycle);
        let follows = schedule.follow_within_ns.is_some();
        let timing = if follows { timing.following() } else { timing };
        let timing = if paired.is_some() { timing.with_interruptions() } else { timing };
        let (events, log, messages) = events::ends(task);
        let (alarm_sender, alarms) = alarms::ends(task, &active);
        let services = participant.map(|participant| Services {
            participant: Arc::clone(participant),
            outputs: outputs::of_task(task),
        });
        let mut inputs = match &services {
            Some(_) => TaskInputs::of(task),
            None => TaskInputs::set_by_hand(task),
        };
        if let Some(task) = &warm {
            inputs.restore(&task.warm.inputs);
        }
        let has_ended = Arc::<AtomicBool>::default();
        let request = ThreadRequest { priority: task.settings.priority, cpu };
        let job = Job {
            schedule,
            request,
            engine,
            inputs,
            services,
            stop: self.stop.clone(),
            has_connected: self.has_connected.clone(),
            has_ended: has_ended.clone(),
            orders: applier,
            records: sender,
            tap,
            events,
            alarms: alarm_sender,
            copier,
            is_held: self.is_held.clone(),
            first_cycle,
            ready,
            start: started,
        };
        let name = task.name.clone();
        let spawned = thread::Builder::new()
            .name(name.chars().take(15).collect())
            .spawn(move || match paired {
                None => cycle::run(job, || Ok(ForRealTime::nothing().map(|()| Alone))),
                Some(paired) => cycle::run(job, || Paired::open(paired)),
            })
            .map_err(|cause| {
                PrepareError::no_thread(format_args!("the thread of task \"{name}\""), cause)
            })?;
        self.threads.push(Thread { task: name.clone(), thread: spawned, start });
        let lane = Lane {
            name: name.clone(),
            ob: task.settings.ob,
            schedule,
            first_cycle,
            phase_reason: task.settings.phase_reason.clone(),
            follow: task.settings.follow.clone(),
            sends: task.outputs.iter().map(|output| output.service.clone()).collect(),
            orders,
            traces: Vec::new(),
            faults: Faults::new(log.messages()),
            messages,
            last: None,
            cpu_reason: None,
            responses: Responses::default(),
            seconds: Seconds::default(),
            grant: None,
            has_ended,
        };
        let banks = task.banks.iter().map(BankPlan::any_block).collect();
        let followed = FollowedFrames::of(task);
        let task = Task { name, banks, timing, records, followed, log, alarms };
        Ok(Spawned { ready: is_ready, lane, task })
    }

    /// Starts all tasks on one grid; the first task may have a number of cycles after which it ends.
    pub(crate) fn start(&self, epoch_ns: u64, cycles: Option<u64>) {
        for (index, thread) in self.threads.iter().enumerate() {
            // A thread that has ended meanwhile has set the stop flag.
            let cycles = cycles.filter(|_| index == 0);
            let _ = thread.start.send(Start { epoch_ns, cycles });
        }
    }

    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Ends the threads and waits for them, in order.
    pub(crate) fn join(mut self) -> Vec<Result<Option<FinishedTask>, TaskPanicked>> {
        self.end()
    }

    /// The error if a thread ended during set-up without a report.
    pub(crate) fn lost(&mut self, index: usize) -> TaskPanicked {
        let task = self.threads.get(index).map(|thread| thread.task.clone()).unwrap_or_default();
        let panics = self.end().into_iter().filter_map(Result::err);
        let message = "its thread ended during its set-up".into();
        let silent = TaskPanicked { task, block: None, message, place: None };
        panics.into_iter().next().unwrap_or(silent)
    }

    fn end(&mut self) -> Vec<Result<Option<FinishedTask>, TaskPanicked>> {
        self.stop();
        // A thread that waits for its start ends when no start can come any more.
        let handles: Vec<_> = self.threads.drain(..).map(|t| (t.task, t.thread)).collect();
        let join = |(task, thread): (String, JoinHandle<_>)| {
            thread.join().map_err(|panic| {
                let message = panics::message(&*panic);
                TaskPanicked { task, block: None, message, place: None }
            })
        };
        handles.into_iter().map(join).collect()
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.end();
    }
}
