//! A node that runs, as an ordinary thread sees it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use isochrone_control::desk::Reading;
use isochrone_cyclic::StopReason;
use isochrone_ipc::{ListedNode, RealTime, Service, ipc};
use isochrone_model::Entry;
use isochrone_timing::{CycleRecord, FollowRecord};

use crate::alarms::Alarm;
use crate::error::{NodePanicked, TaskPanicked};
use crate::layouts::Resolver;
use crate::new_parts::NewParts;
use crate::operating::{Returns, unix_ns};
use crate::outcome::{End, Outcome};
use crate::panics::Panic;
use crate::parts::Parts;
use crate::server::Serving;
use crate::telemetry::Telemetry;
use crate::threads::Threads;
use isochrone_timing::Progress;

/// How often to [poll](Running::poll): the rings of the cycles hold 40 ms at the shortest period, and a
/// snapshot of the signals stays for 20 ms. A poll that slept as long would lose one now and then, as it
/// takes some time itself.
pub const POLL_INTERVAL: Duration = Duration::from_millis(15);

/// A node that runs. Dropping it ends it.
///
/// It stays in the thread that prepared it, as the ports of
/// [`ipc::Service`](isochrone_ipc::ipc::Service) do: prepare, start and poll a node
/// in one thread, and end it from another by its [`stop_flag`](Self::stop_flag).
///
/// Dropping it waits for every task to end its cycle. A block that never returns from its step holds
/// that up for ever, as it does [`finish`](Self::finish); a thread cannot be ended from outside. A
/// program that must end all the same asks the node to [`stop`](Self::stop), polls until
/// [`Poll::is_running`] is false, and after a time limit of its own calls
/// [`std::process::exit`] without dropping the node. What the process leaves in the domain is removed
/// by the next one that joins.
///
/// In a process that forks, the child has none of the threads and must not touch the node: fork only
/// to `exec`, as [`std::process::Command`] does.
#[must_use = "dropping it ends the node"]
pub struct Running<S: Service = ipc::Service> {
    // The threads end before what they use.
    serving: Option<Serving>,
    pub(crate) threads: Threads,
    pub(crate) parts: Parts<S>,
    pub(crate) epoch_ns: u64,
    started: SystemTime,
    news: News,
}

/// What a poll found.
#[derive(Debug, Default)]
struct News {
    records: Vec<(usize, CycleRecord)>,
    /// One for each record.
    follows: Vec<Option<FollowRecord>>,
    returns: Returns,
}

/// What came in since the last [`poll`](Running::poll).
#[derive(Debug)]
pub struct Poll<'a> {
    is_running: bool,
    is_ending: bool,
    news: &'a News,
}

impl<'a> Poll<'a> {
    /// Whether a task still runs, or the last that was done waits for the journal: at most a second. When
    /// that is over, everything has been seen.
    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// Whether the node ends or has ended: it was asked to, or one of its tasks has ended.
    pub fn is_ending(&self) -> bool {
        self.is_ending
    }

    /// The cycles since the last poll: the task, by its place in the plan, and its record.
    pub fn records(&self) -> &'a [(usize, CycleRecord)] {
        &self.news.records
    }

    /// What each of [`records`](Self::records) leaves out, of a task that follows its data; `None` for others.
    pub fn follow_records(&self) -> &'a [Option<FollowRecord>] {
        &self.news.follows
    }

    /// What requests changed since the last poll, those of others included: an entry for each task of a
    /// request, and what ended by itself.
    pub fn applied(&self) -> &'a [Entry] {
        &self.news.returns.applied
    }

    /// The transactions among [`applied`](Self::applied) whose entries are not in the file of the journal,
    /// as it cannot be written: they are written as soon as it can be, and a node that is killed before loses
    /// them.
    pub fn unwritten(&self) -> &'a [u64] {
        &self.news.returns.unwritten
    }

    /// The program's requests since the last poll that came too late for the cycle that they named. Nothing
    /// happened.
    pub fn too_late(&self) -> &'a [u64] {
        &self.news.returns.too_late
    }

    /// The values that came in since the last poll, as [`Running::get`] asked for.
    pub fn readings(&self) -> &'a [Reading] {
        &self.news.returns.readings
    }
}

impl<S: Service> Running<S> {
    pub(crate) fn new(
        serving: Option<Serving>,
        threads: Threads,
        parts: Parts<S>,
        epoch_ns: u64,
    ) -> Self {
        let started = SystemTime::now();
        Self { serving, threads, parts, epoch_ns, started, news: News::default() }
    }

    /// Takes in what the cycles did, and does what a cycle must not: connects what failed to connect,
    /// resolves and announces layouts, logs what blocks and inputs ran into, publishes telemetry.
    ///
    /// For an ordinary thread, every [`POLL_INTERVAL`] or so; it never waits. A node that is polled
    /// less often loses records, which are counted, and connects later to peers that were busy.
    pub fn poll(&mut self) -> Poll<'_> {
        // Asked first: what a task did before its end is then in its ring.
        if self.threads.have_ended() {
            self.parts.operating.lock().end();
        }
        let is_running = !self.drain();
        self.change_over();
        self.tend();
        let is_fresh = self.parts.snapshots.update();
        if let (true, Some(telemetry)) = (is_fresh, &mut self.parts.telemetry) {
            telemetry.publish(&self.parts.snapshots);
        }
        let is_ending = !is_running || self.threads.stop.load(Ordering::Relaxed);
        Poll { is_running, is_ending, news: &self.news }
    }

    /// Asks all tasks to end, which they do within 200 ms; go on polling until none runs.
    pub fn stop(&self) {
        self.threads.stop();
    }

    /// The names of the tasks that run. Of a node that was asked to [`stop`](Self::stop) 200 ms ago or
    /// earlier, those whose cycle takes long or hangs.
    pub fn unfinished_tasks(&self) -> impl Iterator<Item = &str> {
        self.threads.unfinished()
    }

    /// The flag that ends the node when it is set, for another thread or a signal's handler.
    pub fn stop_flag(&self) -> Arc<AtomicBool> {
        self.threads.stop.clone()
    }

    /// When the grid of all tasks begins, in ns of `CLOCK_MONOTONIC`.
    pub fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// The newest value of an input, of an output pin (`"block.pin"`), or of a task's timing
    /// (`"task.NAME.cycle"`): what telemetry shows, at most 20 ms, or a period, before the last
    /// [`poll`](Self::poll). The values of a task are all of one cycle. `None`: there is none of this
    /// name among the first 1024 signals of its task, or no cycle of the task was shown yet.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parts.snapshots.value(name)
    }

    /// Ends the node if it still runs, and tells what it did.
    ///
    /// Waits for every task to end its cycle: for ever, if a block never returns from its step (see
    /// [`Running`]).
    ///
    /// # Errors
    /// Tasks panicked; what all tasks did until then is in the error.
    pub fn finish(mut self) -> Result<Outcome, NodePanicked> {
        self.stop();
        while self.poll().is_running() {
            std::thread::sleep(Duration::from_millis(1));
        }
        // What the last cycles did is answered yet.
        drop(self.serving.take());
        self.parts.tasks.iter_mut().for_each(|task| task.log.finish());
        let Self { threads, mut parts, started, .. } = self;
        let refusals = parts.operating.lock().refusals();
        let done = threads.join();
        let mut panics = Vec::new();
        let mut end = End::Asked;
        let (mut tasks, mut links) = (Vec::new(), Vec::new());
        let mut alarms = parts.alarms;
        let mut ends = vec![None; parts.tasks.len()];
        for (index, (task, done)) in parts.tasks.iter_mut().zip(done).enumerate() {
            alarms.extend(task.resolvers.iter_mut().flat_map(Resolver::alarms));
            let done = match done {
                Ok(Some(done)) => done,
                Ok(None) => continue,
                Err(panic) => {
                    panics.push(panic);
                    continue;
                }
            };
            if let Some((Panic { message, place }, bank)) = &done.panic {
                let block = bank.and_then(|bank| task.banks.get(bank).cloned());
                let (task, message, place) = (task.name.clone(), message.clone(), place.clone());
                panics.push(TaskPanicked { task, block, message, place });
            }
            if let Some(last) = &done.last {
                last.end(&mut task.timing);
            }
            alarms.extend(done.alarms);
            alarms.extend(Alarm::of_counts(
                &task.name,
                done.report.block_errors.unwrap_or(0),
                &task.timing,
            ));
            match done.stop_reason {
                Some(StopReason::Overrun) => {
                    end = End::Overrun { task: task.name.clone(), missed: task.timing.missed() };
                }
                None if end == End::Asked && done.panic.is_none() => end = End::Cycles,
                None | Some(StopReason::Requested) => {}
            }
            if let Some(end) = ends.get_mut(index) {
                *end = done.last.map(|last| Progress::of(&last.record));
            }
            let followed = task.followed.take();
            let publishers = |service: &str| publishers(parts.participant.as_deref(), service);
            alarms.extend(followed.and_then(|followed| followed.end(publishers)));
            let report = task.timing.complete(done.report);
            tasks.extend(parts.operating.lock().lanes.get(index).map(|lane| lane.complete(report)));
            links.extend(done.links);
        }
        let recording = parts.operating.lock().recording.take();
        let recording = recording.map(|recording| recording.end(ends));
        let incomplete = recording.as_ref().and_then(|recording| recording.incomplete.clone());
        alarms.extend(incomplete.map(|reason| Alarm::RecordingIncomplete { reason }));
        let mut operating = parts.operating.lock();
        let forces = operating.operator.forces().collect();
        let journal = operating.take_journal();
        drop(operating);
        if let Some(reason) = journal.and_then(|journal| journal.end(unix_ns())) {
            let alarm = Alarm::JournalIncomplete { reason: reason.to_string() };
            tracing::error!("{}", alarm.sentence());
            alarms.push(alarm);
        }
        let Some(first) = panics.first() else {
            return Ok(Outcome { end, started, refusals, tasks, links, alarms, forces, recording });
        };
        let end = End::Panicked { task: first.task.clone() };
        let outcome =
            Box::new(Outcome { end, started, refusals, tasks, links, alarms, forces, recording });
        Err(NodePanicked { panics, outcome })
    }

    /// Takes in what the cycles did; whether that was the last.
    fn drain(&mut self) -> bool {
        self.news.records.clear();
        self.news.follows.clear();
        let mut operating = self.parts.operating.lock();
        operating.take_back();
        self.news.returns = operating.returns();
        for (index, task) in self.parts.tasks.iter_mut().enumerate() {
            while let Some(cycle) = task.records.pop() {
                cycle.add_to(&mut task.timing);
                task.followed.iter_mut().for_each(|followed| followed.note(&cycle));
                operating.note_cycle(index, &cycle);
                self.news.records.push((index, cycle.record));
                self.news.follows.push(cycle.follow);
            }
        }
        operating.begin_journal_end();
        operating.is_over()
    }

    /// Goes by the configuration that each task has.
    fn change_over(&mut self) {
        let mut operating = self.parts.operating.lock();
        let (coming, arrived) = (operating.coming(), operating.arrived());
        drop(operating);
        self.parts.snapshots.expect(coming);
        arrived.into_iter().for_each(|new| self.enter(new));
    }

    fn enter(&mut self, new: NewParts) {
        let NewParts { banks, cuts, .. } = new;
        for (task, banks) in self.parts.tasks.iter_mut().zip(banks) {
            task.banks = banks;
        }
        let is_same = self.parts.snapshots.arrive();
        for cut in cuts {
            if !self.parts.alarms.contains(&cut) {
                tracing::warn!("{cut}");
                self.parts.alarms.push(cut);
            }
        }
        let Parts { telemetry, participant: Some(participant), snapshots, node, .. } =
            &mut self.parts
        else {
            return;
        };
        if is_same || telemetry.is_none() {
            return;
        }
        // A service has one publisher at a time.
        *telemetry = None;
        *telemetry = Telemetry::open(participant, node, snapshots)
            .inspect_err(|error| {
                tracing::error!(
                    "the node goes on without telemetry of its new configuration: {error}"
                );
            })
            .ok();
    }

    fn tend(&mut self) {
        let Parts { tasks, operating, announcers, telemetry, participant, .. } = &mut self.parts;
        for (index, task) in tasks.iter_mut().enumerate() {
            task.log.write();
            let happened = task.log.happened();
            let publishers = |service: &str| publishers(participant.as_deref(), service);
            let change = task.followed.as_mut().and_then(|it| it.judge(publishers));
            if happened.is_empty() && change.is_none() {
                continue;
            }
            if let Some(lane) = operating.lock().lanes.get_mut(index) {
                lane.faults.note(&happened);
                lane.change_states(change.into_iter().collect());
            }
        }
        let Some(participant) = participant.as_deref() else { return };
        participant.tend();
        for (index, task) in tasks.iter_mut().enumerate() {
            for resolver in &mut task.resolvers {
                resolver.tend(participant.ordinary());
                let (reasons, changes) = (resolver.reasons(), resolver.state_changes());
                if reasons.is_none() && changes.is_empty() {
                    continue;
                }
                if let Some(lane) = operating.lock().lanes.get_mut(index) {
                    lane.faults.explain(reasons.unwrap_or_default());
                    lane.change_states(changes);
                }
            }
        }
        for announcer in announcers {
            announcer.tend(participant.ordinary());
        }
        if let Some(telemetry) = telemetry {
            telemetry.tend(participant);
        }
    }
}

/// Who publishes a service, as far as that can be told without waiting.
fn publishers<S: Service>(participant: Option<&RealTime<S>>, service: &str) -> Vec<ListedNode> {
    let nodes =
        participant.and_then(|participant| participant.ordinary().publishers_at_once(service));
    nodes.unwrap_or_default()
}

impl<S: Service> std::fmt::Debug for Running<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Running").field("epoch_ns", &self.epoch_ns).finish_non_exhaustive()
    }
}
