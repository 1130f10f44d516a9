//! The CPUs of a node's tasks.

mod choice;

use isochrone_cyclic::Pinning;
use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, TaskPlan};
use isochrone_machine::{Choice, Machine};

use crate::neighbours::Neighbour;

/// The CPUs of a node's tasks.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// In the order of the configuration.
    places: Vec<CpuPlace>,
}

/// Where the thread of a task runs.
#[derive(Debug, Clone, PartialEq)]
pub enum CpuPlace {
    /// The kernel may move it: the configuration says so, or which CPUs there are is unknown.
    Anywhere,
    /// On a CPU that the configuration names.
    Named(usize),
    /// On a CPU that was chosen; anywhere if the task's priority is refused.
    Chosen(Choice),
}

impl CpuPlace {
    /// The CPU that it is to be pinned to.
    pub const fn cpu(&self) -> Option<usize> {
        match self {
            Self::Anywhere => None,
            Self::Named(cpu) | Self::Chosen(Choice { cpu, .. }) => Some(*cpu),
        }
    }

    const fn pinning(&self) -> Pinning {
        match self {
            Self::Anywhere => Pinning::Any,
            Self::Named(cpu) => Pinning::Named(*cpu),
            Self::Chosen(choice) => Pinning::Chosen(choice.cpu),
        }
    }
}

impl Places {
    /// Chooses the CPUs that the configuration leaves open (`cpu = "auto"`), on this machine. If there are
    /// any, the machine is observed for 200 ms.
    ///
    /// Tasks of higher priority choose first, then those of shorter period. Each takes the CPU that
    /// [`choose_off`](isochrone_machine::Observation::choose_off) names, where the tasks that have a CPU before
    /// it count as threads that run there. A task that follows one of its own priority or a lower one keeps off
    /// that one's CPU where there is another, and so does its source. One that follows a task of a higher priority
    /// shares its CPU rather than that of a task that it would meet there.
    pub fn of(plan: &Plan) -> Self {
        Self::beside(plan, &Machine::here(), &[])
    }

    /// As [`of`](Self::of), on any machine.
    pub fn on(plan: &Plan, machine: &Machine) -> Self {
        Self::beside(plan, machine, &[])
    }

    /// As [`of`](Self::of), on any machine, and off the CPUs on which tasks of other nodes would keep a
    /// task of the plan from sending, or it them.
    pub fn beside(plan: &Plan, machine: &Machine, running: &[Neighbour]) -> Self {
        let named = plan.tasks.iter().map(named).collect();
        if !plan.tasks.iter().any(|task| task.cpu.is_auto()) {
            return Self { places: named };
        }
        match machine.observation() {
            Some(observation) => choice::choose(plan, &named, observation, running),
            None => Self { places: named },
        }
    }

    /// Writes the chosen CPUs into the plan, for what depends on them.
    pub fn settle(&self, plan: &mut Plan) {
        for (task, place) in plan.tasks.iter_mut().zip(&self.places) {
            if task.cpu.is_auto() {
                task.cpu = Cpu::Auto { chosen: place.cpu().and_then(|cpu| cpu.try_into().ok()) };
            }
        }
    }

    /// The same with another place for one task.
    #[must_use]
    pub fn with(mut self, task: usize, place: CpuPlace) -> Self {
        self.places.get_mut(task).into_iter().for_each(|old| *old = place.clone());
        self
    }

    /// The same as if the configuration named the CPUs: tasks keep them even if their priority is refused.
    #[must_use]
    pub fn named(mut self) -> Self {
        for place in &mut self.places {
            *place = place.cpu().map_or(CpuPlace::Anywhere, CpuPlace::Named);
        }
        self
    }

    /// Where each task runs, in the order of the configuration.
    pub fn as_slice(&self) -> &[CpuPlace] {
        &self.places
    }

    /// The CPU that a task is to be pinned to.
    pub fn cpu(&self, task: usize) -> Option<usize> {
        self.places.get(task).and_then(CpuPlace::cpu)
    }

    /// What a task's thread asks for.
    pub(crate) fn pinning(&self, task: usize) -> Pinning {
        self.places.get(task).map_or(Pinning::Any, CpuPlace::pinning)
    }

    /// Why a task's CPU was chosen, if it was.
    pub fn reason(&self, task: usize) -> Option<String> {
        match self.places.get(task)? {
            CpuPlace::Chosen(choice) => Some(choice.to_string()),
            CpuPlace::Anywhere | CpuPlace::Named(_) => None,
        }
    }
}

fn named(task: &TaskPlan) -> CpuPlace {
    match task.cpu {
        Cpu::Number(cpu) => CpuPlace::Named(cpu as usize),
        Cpu::Auto { .. } | Cpu::Any => CpuPlace::Anywhere,
    }
}

#[cfg(test)]
#[path = "places_tests.rs"]
mod tests;
