//! One input of a task.

use isochrone_cyclic::Release;
use isochrone_engine::{InputPlan, TaskEngine, TaskPlan};
use isochrone_timing::InputReport;

use crate::node::alarms::Alarm;
use crate::task::freshness::{Accepted, Freshness, InputState, Tally};

/// How long an input may be without its first sample before that is reported. Publishers announce their layout within
/// half of it.
const PATIENCE_NS: u64 = 1_000_000_000;

/// An input: its value, and the state that was last reported.
pub(super) struct Channel {
    /// Index of the input in the plan.
    pub(super) input: usize,
    name: String,
    unit: String,
    /// Whether it is read from a service rather than set by hand.
    is_read: bool,
    pub(super) freshness: Freshness,
    /// What was said of it last, and the first cycle in which that was no longer so.
    pub(super) reported: Option<InputState>,
    pub(super) changed: Option<Change>,
    first_ns: Option<u64>,
}

/// A state of an input that has to be reported.
#[derive(Clone, Copy)]
pub(super) struct Change {
    pub(super) to: InputState,
    pub(super) cycle: u64,
}

impl Channel {
    /// An input that takes its samples from its service.
    pub(super) fn of_service(input: usize, plan: &InputPlan, task: &TaskPlan) -> Self {
        Self::new(input, plan, Accepted::of_service(plan), task)
    }

    /// An input that takes its samples from the program.
    pub(super) fn of_program(input: usize, plan: &InputPlan, task: &TaskPlan) -> Self {
        Self::new(input, plan, Accepted::all_of(plan.value_type), task)
    }

    fn new(input: usize, plan: &InputPlan, accepted: Accepted, task: &TaskPlan) -> Self {
        Self {
            input,
            name: plan.name.clone(),
            unit: plan.unit.clone(),
            is_read: plan.service.is_some(),
            freshness: Freshness::new(plan, accepted, task.settings.period_ns),
            // No sample is expected for an input that is set by hand.
            reported: plan.service.is_none().then_some(InputState::Waiting),
            changed: None,
            first_ns: None,
        }
    }

    pub(super) fn read(&mut self, engine: &mut TaskEngine, release: &Release) {
        engine.read_input(self.input, &self.freshness.read(release.start_ns));
        let to = self.freshness.state();
        let first_ns = *self.first_ns.get_or_insert(release.start_ns);
        let is_start =
            self.reported.is_none() && release.start_ns.saturating_sub(first_ns) < PATIENCE_NS;
        let is_expected = is_start
            && matches!(to, InputState::Waiting | InputState::Restored | InputState::Missing(_));
        if is_expected || self.reported.is_some_and(|reported| reported.is_like(to)) {
            self.changed = None;
        } else if self.changed.is_none_or(|changed| !changed.to.is_like(to)) {
            self.changed = Some(Change { to, cycle: release.cycle });
        }
    }

    /// Whether it was ok.
    pub(super) fn report(&self) -> InputReport {
        let Tally { falls, not_ok_ns } = self.freshness.tally();
        let ok = self.freshness.state().is_ok();
        InputReport { name: self.name.clone(), unit: self.unit.clone(), ok, falls, not_ok_ns }
    }

    /// How it was not ok; nothing for an input that is set by hand and was never set.
    pub(super) fn alarm(&self) -> Option<Alarm> {
        let report = self.report();
        let never_came = self.is_read && !report.ok && report.not_ok_ns >= PATIENCE_NS;
        (report.falls > 0 || never_came).then_some(Alarm::InputNotOk(report))
    }
}
