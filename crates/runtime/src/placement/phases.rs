//! `phase = "auto"`: phases that keep clear of what runs on the same CPU.

use isochrone_engine::Plan;
use isochrone_model::EPOCH_OFFSET_NS;
use isochrone_timing::units::duration;

use super::clear_phase::{ClearPhase, clear_phase_ns};
use super::need::Need;
use super::{CpuUser, CpuUsers};

impl CpuUsers {
    /// Chooses the phases of the tasks with `phase = "auto"`, in the order of the configuration, and writes them into
    /// the plan: as far as possible from the needs of other tasks on the same CPU, of the plan and of other nodes,
    /// and from the kernel's ticks. Tasks that are pinned to no CPU keep the phase between the ticks. The same plan
    /// beside the same tasks always gets the same phases.
    ///
    /// A task that follows another one gets the phase of that one, if its grid is known, so that it watches when that
    /// one sends.
    ///
    /// How long a task of the plan will run after its release is not known before it runs, and counts as nothing.
    pub fn choose_phases(&mut self, plan: &mut Plan) {
        self.follow_sources();
        while let Some(index) = self.take_open_phase() {
            self.choose_clear_phase(index);
            self.follow_sources();
        }
        for (task, user) in plan.tasks.iter_mut().zip(&self.own) {
            let settings = &mut task.settings;
            if settings.phase_reason.is_some() {
                settings.phase_reason.clone_from(&user.placement.phase_reason);
                settings.phase_ns = user.placement.first_release_ns - EPOCH_OFFSET_NS;
            }
        }
    }

    /// Gives tasks the phases of the tasks that they follow, once those have theirs.
    pub(super) fn follow_sources(&mut self) {
        let known = |users: &Self| {
            let mut open = users.open_phases.iter().enumerate();
            open.find_map(|(at, index)| Some((at, *index, users.phase_of_source(*index)?)))
        };
        while let Some((at, index, (phase_ns, reason))) = known(self) {
            self.open_phases.remove(at);
            self.set_phase(index, phase_ns, reason);
        }
    }

    fn phase_of_source(&self, index: usize) -> Option<(u64, String)> {
        let task = self.own.get(index)?;
        let is_followed = |source: &&CpuUser| task.follows(source).is_some();
        let source = self.settled().filter(is_followed).find(|it| is_known_to(it, task))?;
        let (own_ns, other_ns) = (task.period_ns.max(1), source.period_ns.max(1));
        if !own_ns.is_multiple_of(other_ns) && !other_ns.is_multiple_of(own_ns) {
            return None;
        }
        let since_ns = source.placement.first_release_ns.checked_sub(EPOCH_OFFSET_NS)?;
        let reason = format!("the phase of {}, which it follows", source.full_name());
        Some((since_ns % own_ns.min(other_ns), reason))
    }

    /// The next task to choose: one that follows nothing, then one whose source has its phase.
    fn take_open_phase(&mut self) -> Option<usize> {
        let rank = |at: &usize| {
            let task = self.own.get(*self.open_phases.get(*at)?)?;
            let mut open = self.open_phases.iter().filter_map(|index| self.own.get(*index));
            let waits = open.any(|source| task.follows(source).is_some());
            Some((waits, task.placement.follow.is_some()))
        };
        let next = (0..self.open_phases.len()).min_by_key(rank)?;
        Some(self.open_phases.remove(next))
    }

    fn choose_clear_phase(&mut self, index: usize) {
        let Some(task) = self.own.get(index) else { return };
        let Some(cpu) = task.placement.cpu else { return };
        let is_near = |other: &&CpuUser| {
            let is_itself = other.node == task.node && other.task == task.task;
            other.placement.cpu == Some(cpu) && !is_itself && task.follows(other).is_none()
        };
        let (known, unknown): (Vec<_>, Vec<_>) =
            self.settled().filter(is_near).partition(|other| is_known_to(other, task));
        let needs: Vec<Need> = known.iter().map(|other| other.need()).collect();
        let need = task.need_without_phase();
        let ClearPhase { phase_ns, clear_ns } = clear_phase_ns(&need, &needs);
        let placed = Need { release_ns: need.release_ns + phase_ns, ..need };
        let is_alone = known.is_empty() && unknown.is_empty();
        let (met, clear): (Vec<_>, Vec<_>) =
            known.into_iter().partition(|other| placed.meeting(&other.need()).is_some());
        let mut reasons = vec![match clear_ns {
            Some(clear_ns) => format!(
                "{} clear of {} on CPU {cpu} and of the kernel's ticks",
                duration(clear_ns as f64),
                names(&clear)
            ),
            None if is_alone => {
                format!("between the kernel's ticks; no other task is known to run on CPU {cpu}")
            }
            None => "between the kernel's ticks".into(),
        }];
        if !met.is_empty() {
            reasons.push(format!("{} cannot be kept clear of at any phase", names(&met)));
        }
        if !unknown.is_empty() {
            reasons.push(format!(
                "how the grid of {} lies to this one is known only after the start",
                names(&unknown)
            ));
        }
        self.set_phase(index, phase_ns, reasons.join("; "));
    }

    /// The tasks whose phase is decided.
    fn settled(&self) -> impl Iterator<Item = &CpuUser> {
        let own = self.own.iter().enumerate();
        let settled = own.filter(|(index, _)| !self.open_phases.contains(index));
        self.running.iter().chain(settled.map(|(_, user)| user))
    }

    fn set_phase(&mut self, index: usize, phase_ns: u64, reason: String) {
        if let Some(task) = self.own.get_mut(index) {
            task.placement.first_release_ns = EPOCH_OFFSET_NS + phase_ns;
            task.placement.phase_reason = Some(reason);
        }
    }
}

/// Whether the phase between two tasks is known before the start.
fn is_known_to(other: &CpuUser, task: &CpuUser) -> bool {
    other.node == task.node || other.is_on_grid_with(&task.need_without_phase())
}

fn names(tasks: &[&CpuUser]) -> String {
    tasks.iter().map(|task| task.full_name()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
#[path = "phases_tests.rs"]
mod tests;
