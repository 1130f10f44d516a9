//! The turns of the supervisor while the node runs. They never wait.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use isochrone_cyclic::touch_new_memory;
use isochrone_ipc::{ListedNode, Service};

use super::batches::{Batch, CycleEvent, Listeners};
use super::new_parts::NewParts;
use super::ports::Ports;
use crate::node::alarms::Alarm;
use crate::node::operating::{RequestOutcome, Shared};
use crate::redundancy::twin::Twin;
use crate::task::threads::{Task, Threads};

/// Time between two turns while there may be requests, or something is on its way to a cycle.
const PAUSE: Duration = Duration::from_millis(2);
/// Time between two turns with the slower duties. A snapshot of the signals lasts for 20 ms; turns that are as far
/// apart would lose one now and then, as a turn takes time itself.
const DUTIES: Duration = Duration::from_millis(15);

/// A running node, for its supervisor.
pub(super) struct Supervised<S: Service> {
    // Dropped first: the threads end before the things that they use.
    pub(super) threads: Threads,
    pub(super) node: String,
    pub(super) tasks: Vec<Task>,
    pub(super) shared: Shared,
    pub(super) listeners: Listeners,
    pub(super) alarms: Vec<Alarm>,
    pub(super) started: SystemTime,
    /// When the slower duties are due.
    pub(super) duties_due: Instant,
    pub(super) is_ending: bool,
    /// `None` for a node without services.
    pub(super) ports: Option<Ports<S>>,
    /// Where this is one of two processes of the node.
    pub(super) twin: Option<Arc<Twin>>,
}

impl<S: Service + 'static> Supervised<S> {
    /// Takes turns until no task runs and all outcomes have been reported.
    pub(super) fn run(&mut self) {
        while !self.turn() {
            thread::park_timeout(self.pause());
        }
    }

    /// One turn; whether it was the last.
    fn turn(&mut self) -> bool {
        // Asked first: the rings then have everything that a task did before its end.
        let have_ended = self.shared.lock().have_ended();
        let is_ending = have_ended || self.threads.stop.load(Ordering::Relaxed);
        let begins_to_end = is_ending && !std::mem::replace(&mut self.is_ending, is_ending);
        if self.threads.has_connected.swap(false, Ordering::Relaxed) {
            touch_new_memory();
        }
        let now = Instant::now();
        let has_duties = have_ended || begins_to_end || now >= self.duties_due;
        let mut operating = self.shared.lock();
        let (came, arrived) = (operating.take_back(), operating.arrived());
        drop(operating);
        // Asked after the requests were taken in: a receiver that was there before its program sent a request gets
        // the outcome.
        let mut batch = self.listeners.are_there().then(Batch::default);

        self.hand_out(came, batch.as_mut());
        if let Some(new) = arrived {
            self.change_over(new);
        }
        if has_duties {
            self.duties_due = now + DUTIES;
            self.take_cycles(batch.as_mut());
            self.tend();
            self.publish();
            self.shared.lock().retain();
        }
        if self.twin.as_ref().is_some_and(|twin| twin.is_orphaned()) {
            self.threads.stop();
        }
        let mut operating = self.shared.lock();
        if have_ended {
            operating.begin_journal_end();
        }
        let is_over = have_ended && !operating.waits_for_journal();
        drop(operating);
        match &mut self.ports {
            Some(ports) if is_over => ports.end_requests(),
            Some(ports) => {
                ports.tend_twin(&self.shared, has_duties);
                ports.serve();
            }
            None => {}
        }
        if let Some(batch) = batch.filter(|batch| !batch.is_empty()) {
            self.listeners.tell(&Batch { is_ending, ..batch });
        }
        if begins_to_end {
            self.listeners.begin_end();
        }
        is_over
    }

    /// How long until the next turn.
    fn pause(&self) -> Duration {
        let until_duties = self.duties_due.saturating_duration_since(Instant::now());
        let has_service = self.ports.as_ref().is_some_and(|ports| ports.control.is_some());
        let is_awaited = has_service
            || self.twin.is_some()
            || self.is_ending
            || self.shared.lock().is_under_way();
        if is_awaited { until_duties.min(PAUSE) } else { until_duties }
    }

    /// Passes outcomes from the cycles on to the clients that asked and to the receivers of events.
    fn hand_out(&mut self, came: Vec<RequestOutcome>, mut batch: Option<&mut Batch>) {
        let mut control = self.ports.as_mut().and_then(|ports| ports.control.as_mut());
        for outcome in came {
            let outcome = match &mut control {
                Some(control) => control.take(outcome),
                None => Some(outcome),
            };
            if let (Some(batch), Some(outcome)) = (&mut batch, outcome) {
                batch.add(outcome);
            }
        }
    }

    /// Collects the records of the cycles.
    pub(super) fn take_cycles(&mut self, mut batch: Option<&mut Batch>) {
        let mut operating = self.shared.lock();
        for (index, task) in self.tasks.iter_mut().enumerate() {
            while let Some(cycle) = task.records.pop() {
                cycle.add_to(&mut task.timing);
                task.followed.iter_mut().for_each(|followed| followed.note(&cycle));
                operating.note_cycle(index, &cycle);
                if let Some(batch) = &mut batch {
                    let event =
                        CycleEvent { task: index, record: cycle.record, follow: cycle.follow };
                    batch.cycles.push(event);
                }
            }
        }
    }

    /// Changes over to the configuration that all tasks have.
    fn change_over(&mut self, new: NewParts) {
        let NewParts { source, banks, cuts, copies } = new;
        for (task, banks) in self.tasks.iter_mut().zip(banks) {
            task.banks = banks;
        }
        let mut operating = self.shared.lock();
        if let Some(state) = &mut operating.state {
            state.change(&source, copies);
        }
        let is_same = operating.snapshots.arrive();
        let layout = (!is_same).then(|| operating.snapshots.layout().clone());
        drop(operating);
        for cut in cuts {
            if !self.alarms.contains(&cut) {
                tracing::warn!("{cut}");
                self.alarms.push(cut);
            }
        }
        if let (Some(layout), Some(ports)) = (layout, &mut self.ports) {
            ports.change_telemetry(layout);
        }
    }

    /// Logs events of blocks, inputs and services and updates the alarms. Also does the work that a cycle must not
    /// do: retries failed connections, and resolves and announces layouts.
    fn tend(&mut self) {
        for (index, task) in self.tasks.iter_mut().enumerate() {
            self.shared.lock().take_alarms(index, &mut task.alarms);
            task.log.write();
            let happened = task.log.happened();
            let publishers = |service: &str| publishers(self.ports.as_ref(), service);
            let change = task.followed.as_mut().and_then(|it| it.judge(publishers));
            if happened.is_empty() && change.is_none() {
                continue;
            }
            if let Some(lane) = self.shared.lock().lanes.get_mut(index) {
                lane.faults.note(&happened);
                lane.change_states(change.into_iter().collect());
            }
        }
        let Some(ports) = &mut self.ports else { return };
        ports.tend(&self.node);
        for (index, resolvers) in ports.resolvers.iter_mut().enumerate() {
            for resolver in resolvers {
                let (reasons, changes) = (resolver.reasons(), resolver.state_changes());
                let units = resolver.units();
                if reasons.is_none() && changes.is_empty() && units.is_empty() {
                    continue;
                }
                let mut operating = self.shared.lock();
                operating.operator.announce_units(units);
                if let Some(lane) = operating.lanes.get_mut(index) {
                    lane.faults.explain(reasons.unwrap_or_default());
                    lane.change_states(changes);
                }
            }
        }
    }

    /// Collects the newest snapshots, and publishes them if any is new.
    fn publish(&mut self) {
        let mut operating = self.shared.lock();
        let is_fresh = operating.snapshots.update();
        let telemetry = self.ports.as_mut().and_then(Ports::telemetry);
        let Some(telemetry) = telemetry.filter(|_| is_fresh) else { return };
        telemetry.take(&operating.snapshots);
        drop(operating);
        telemetry.publish();
    }
}

/// The publishers of a service; `None`: they cannot be determined without waiting.
pub(super) fn publishers<S: Service + 'static>(
    ports: Option<&Ports<S>>,
    service: &str,
) -> Option<Vec<ListedNode>> {
    ports.map_or(Some(Vec::new()), |ports| ports.publishers(service))
}
