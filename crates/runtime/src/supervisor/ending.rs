//! Puts the outcome of a node together after its tasks have ended.

use isochrone_cyclic::StopReason;
use isochrone_ipc::Service;
use isochrone_timing::Progress;

use super::layouts::Resolver;
use super::turns::{Supervised, publishers};
use crate::error::{NodePanicked, TaskPanicked};
use crate::keeping::state::StateWriting;
use crate::node::alarms::Alarm;
use crate::node::outcome::{End, Outcome};
use crate::task::clocks::unix_ns;
use crate::task::cycle::FinishedTask;
use crate::task::panics::Panic;

impl<S: Service + 'static> Supervised<S> {
    /// Ends the node, and returns its outcome. Waits for every task to end its cycle, and up to some seconds for the
    /// disk.
    pub(super) fn end(mut self) -> Result<Outcome, NodePanicked> {
        if let Some(ports) = &mut self.ports {
            // The requests of the last cycles have been answered.
            ports.control = None;
        }
        let done = std::mem::take(&mut self.threads).join();
        // Usually none are left. After a panic of the supervisor there may be some that the journal and the recording
        // have to get.
        self.shared.lock().take_back();
        self.take_cycles(None);
        self.tasks.iter_mut().for_each(|task| task.log.finish());
        let mut operating = self.shared.lock();
        for (index, task) in self.tasks.iter_mut().enumerate() {
            operating.take_alarms(index, &mut task.alarms);
        }
        operating.process_alarms.finish();
        let mut outcome = Outcome::begun(self.started, operating.refusals());
        outcome.process_alarms = operating.process_alarms.totals();
        drop(operating);
        outcome.alarms = std::mem::take(&mut self.alarms);
        let mut panics = Vec::new();
        let (mut last_cycles, mut states) = (Vec::new(), Vec::new());
        for (index, mut done) in done.into_iter().enumerate() {
            let done_task = done.as_mut().ok().and_then(Option::as_mut);
            states.push(done_task.and_then(|done| Some((done.state.take()?, done.changes))));
            last_cycles.push(match done {
                Ok(Some(done)) => self.end_task(index, done, &mut outcome, &mut panics),
                Ok(None) => None,
                Err(panic) => {
                    panics.push(panic);
                    None
                }
            });
        }
        let mut operating = self.shared.lock();
        let recording = operating.recording.take();
        let state = operating.take_state(states).map(|(state, last)| {
            state.begin_end(last);
            state
        });
        drop(operating);
        outcome.recording = recording.map(|recording| recording.end(last_cycles));
        let recording = outcome.recording.as_ref();
        let incomplete = recording.and_then(|recording| recording.incomplete.clone());
        outcome.alarms.extend(incomplete.map(|reason| Alarm::RecordingIncomplete { reason }));
        let mut operating = self.shared.lock();
        outcome.forces = operating.operator.forces().collect();
        outcome.unsaved = operating.unsaved();
        let journal = operating.take_journal();
        drop(operating);
        if let Some(reason) = state.and_then(StateWriting::end) {
            let alarm = Alarm::StateIncomplete { reason };
            tracing::error!("{}", alarm.sentence());
            outcome.alarms.push(alarm);
        }
        if let Some(reason) = journal.and_then(|journal| journal.end(unix_ns())) {
            let alarm = Alarm::JournalIncomplete { reason: reason.to_string() };
            tracing::error!("{}", alarm.sentence());
            outcome.alarms.push(alarm);
        }
        let Some(first) = panics.first() else { return Ok(outcome) };
        outcome.end = End::Panicked { task: first.task.clone() };
        Err(NodePanicked::Tasks { panics, outcome: Box::new(outcome) })
    }

    /// Adds the outcome of one task; returns its last cycle.
    fn end_task(
        &mut self,
        index: usize,
        done: FinishedTask,
        outcome: &mut Outcome,
        panics: &mut Vec<TaskPanicked>,
    ) -> Option<Progress> {
        let resolvers = self.ports.as_mut().and_then(|ports| ports.resolvers.get_mut(index));
        outcome.alarms.extend(resolvers.into_iter().flatten().flat_map(Resolver::alarms));
        let task = self.tasks.get_mut(index)?;
        if let Some((Panic { message, place }, bank)) = &done.panic {
            let block = bank.and_then(|bank| task.banks.get(bank).cloned());
            let (task, message, place) = (task.name.clone(), message.clone(), place.clone());
            panics.push(TaskPanicked { task, block, message, place });
        }
        if let Some(last) = &done.last {
            last.end(&mut task.timing);
        }
        let errors = done.report.block_errors.unwrap_or(0);
        outcome.alarms.extend(done.alarms);
        outcome.alarms.extend(Alarm::of_counts(&task.name, errors, &task.timing));
        match done.stop_reason {
            Some(StopReason::Overrun) => {
                let (task, missed) = (task.name.clone(), task.timing.missed());
                outcome.end = End::Overrun { task, missed };
            }
            None if outcome.end == End::Asked && done.panic.is_none() => outcome.end = End::Cycles,
            None | Some(StopReason::Requested) => {}
        }
        let publishers = |service: &str| publishers(self.ports.as_ref(), service);
        let late = task.followed.take().and_then(|followed| followed.end(publishers));
        outcome.alarms.extend(late);
        let report = task.timing.complete(done.report);
        let operating = self.shared.lock();
        outcome.tasks.extend(operating.lanes.get(index).map(|lane| lane.complete(report)));
        outcome.links.extend(done.links);
        done.last.map(|last| Progress::of(&last.record))
    }
}
