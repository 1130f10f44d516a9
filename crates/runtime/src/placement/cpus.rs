//! `cpu = "auto"`: the CPUs of a node's tasks.

use std::cmp::Reverse;
use std::iter;

use isochrone_cyclic::Pinning;
use isochrone_engine::Plan;
use isochrone_engine::config::Cpu;
use isochrone_machine::{Avoided, BoundThread, Choice, Machine, Observation};

use super::{Conflict, CpuUsers};

/// The CPUs of a node's tasks.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskCpus {
    /// In the order of the configuration.
    cpus: Vec<TaskCpu>,
}

/// The CPU of a task's thread.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum TaskCpu {
    /// The kernel may move the thread: the configuration says so, or the CPUs of the machine are unknown.
    Any,
    /// A CPU that the configuration names.
    Named(usize),
    /// A CPU that was chosen; any CPU if the task is refused its priority.
    Chosen(Choice),
}

impl TaskCpu {
    /// The CPU that it is to be pinned to.
    pub const fn cpu(&self) -> Option<usize> {
        match self {
            Self::Any => None,
            Self::Named(cpu) | Self::Chosen(Choice { cpu, .. }) => Some(*cpu),
        }
    }
}

impl TaskCpus {
    /// Chooses the CPUs that the configuration leaves open, on this machine, as [`CpuUsers::choose_cpus`] does if no
    /// other node runs.
    pub fn of(plan: &Plan) -> Self {
        Self::on(plan, &Machine::here())
    }

    /// As [`of`](Self::of), on a given machine.
    pub fn on(plan: &Plan, machine: &Machine) -> Self {
        CpuUsers::new(plan, &[]).choose_cpus(machine)
    }

    /// Writes the chosen CPUs into the plan.
    pub fn settle(&self, plan: &mut Plan) {
        for (task, cpu) in plan.tasks.iter_mut().zip(&self.cpus) {
            if task.settings.cpu.is_auto() {
                task.settings.cpu =
                    Cpu::Auto { chosen: cpu.cpu().and_then(|cpu| cpu.try_into().ok()) };
            }
        }
    }

    /// The same with another CPU for one task.
    #[must_use]
    pub fn with(mut self, task: usize, cpu: TaskCpu) -> Self {
        self.cpus.get_mut(task).into_iter().for_each(|old| *old = cpu.clone());
        self
    }

    /// The same as if the configuration named the CPUs: tasks keep them even if their priority is refused.
    #[must_use]
    pub fn named(mut self) -> Self {
        for cpu in &mut self.cpus {
            *cpu = cpu.cpu().map_or(TaskCpu::Any, TaskCpu::Named);
        }
        self
    }

    /// The CPU of each task, in the order of the configuration.
    pub fn as_slice(&self) -> &[TaskCpu] {
        &self.cpus
    }

    /// The CPU that a task is to be pinned to.
    pub fn cpu(&self, task: usize) -> Option<usize> {
        self.cpus.get(task).and_then(TaskCpu::cpu)
    }

    /// The request for a task's thread.
    pub(crate) fn pinning(&self, task: usize) -> Pinning {
        match self.cpus.get(task) {
            None | Some(TaskCpu::Any) => Pinning::Any,
            Some(TaskCpu::Named(cpu)) => Pinning::Named(*cpu),
            Some(TaskCpu::Chosen(choice)) => Pinning::Chosen(choice.cpu),
        }
    }

    /// Why a task's CPU was chosen, if it was.
    pub fn reason(&self, task: usize) -> Option<String> {
        match self.cpus.get(task)? {
            TaskCpu::Chosen(choice) => Some(choice.to_string()),
            TaskCpu::Any | TaskCpu::Named(_) => None,
        }
    }
}

impl CpuUsers {
    /// Chooses the CPUs that the configuration leaves open (`cpu = "auto"`). If there are any, the machine is
    /// observed for 200 ms.
    ///
    /// Tasks of higher priority choose first, then those of shorter period. Each takes the CPU that
    /// [`choose_off`](Observation::choose_off) names, which counts tasks that have chosen already as threads that run
    /// there. A task that would [starve](isochrone_engine::starves) its source keeps off the source's CPU if there is
    /// another one, and the source keeps off the task's. A task that follows one of a higher priority prefers to
    /// share its CPU over the CPU of a task that it would meet. If this leaves starved sources, sources choose before
    /// the tasks that follow them, provided that this leaves fewer.
    pub fn choose_cpus(&mut self, machine: &Machine) -> TaskCpus {
        // A task that follows another one gets the same phase, on whatever CPU.
        self.follow_sources();
        for index in &self.auto_cpus {
            self.own.get_mut(*index).into_iter().for_each(|task| task.placement.cpu = None);
        }
        let named = self.own.iter().map(|task| task.placement.cpu);
        let named = named.map(|cpu| cpu.map_or(TaskCpu::Any, |cpu| TaskCpu::Named(cpu as usize)));
        let mut cpus = TaskCpus { cpus: named.collect() };
        if self.auto_cpus.is_empty() {
            return cpus;
        }
        let Some(observation) = machine.observation() else { return cpus };
        let by_rank = |index: &usize| {
            self.own.get(*index).map(|task| (Reverse(task.priority()), task.period_ns))
        };
        let mut order = self.auto_cpus.clone();
        order.sort_by_key(by_rank);
        let choices_by_rank = self.in_turn(&order, observation);
        // A task that chooses after its source has to keep off that one alone.
        order.sort_by_key(|index| self.sources_before(*index));
        let choices_by_flow = self.in_turn(&order, observation);
        let ways = [choices_by_rank, choices_by_flow].into_iter();
        let best = ways.min_by_key(|(users, _)| users.starved_sources());
        if let Some((users, choices)) = best {
            *self = users;
            for (index, choice) in choices {
                cpus = cpus.with(index, TaskCpu::Chosen(choice));
            }
        }
        cpus
    }

    /// Lets the tasks choose one after the other.
    fn in_turn(&self, order: &[usize], machine: &Observation) -> (Self, Vec<(usize, Choice)>) {
        let (mut users, mut observation) = (self.clone(), machine.clone());
        for other in &self.running {
            if let Some(cpu) = other.placement.cpu {
                observation.name(cpu as usize, &other.task, &other.full_name());
            }
        }
        let bound = |name, cpu| BoundThread { process: None, name, cpu };
        for task in &self.own {
            let cpu = task.placement.cpu.into_iter();
            cpu.for_each(|cpu| observation.bind(bound(task.full_name(), cpu as usize)));
        }
        let mut choices = Vec::new();
        for index in order {
            let choice = observation.choose_off(&users.avoided(*index, &observation));
            let (Some(choice), Some(task)) = (choice, users.own.get_mut(*index)) else { continue };
            observation.bind(bound(task.full_name(), choice.cpu));
            task.placement.cpu = choice.cpu.try_into().ok();
            choices.push((*index, choice));
        }
        (users, choices)
    }

    /// The CPUs of a machine that a task should avoid: those on which it would starve another task or be starved;
    /// and, if it can share the CPU of its source, those on which it would meet other tasks.
    fn avoided(&self, index: usize, machine: &Observation) -> Vec<Avoided> {
        let Some(task) = self.own.get(index) else { return Vec::new() };
        let conflicts_on = |cpu: usize| -> Vec<Conflict> {
            let mut there = task.clone();
            there.placement.cpu = cpu.try_into().ok();
            self.others(index).flat_map(|other| Conflict::between(&there, other)).collect()
        };
        let cpus = machine.cpus.iter().map(|it| (it.cpu, conflicts_on(it.cpu)));
        let cpus: Vec<(usize, Vec<Conflict>)> = cpus.collect();
        let mut sources = self.others(index).filter(|other| task.follows(other).is_some());
        let may_share = sources.any(|source| {
            let is_free = |(cpu, conflicts): &(usize, Vec<Conflict>)| {
                source.placement.cpu.is_some_and(|it| it as usize == *cpu) && conflicts.is_empty()
            };
            cpus.iter().any(is_free)
        });
        let avoided = |(cpu, conflicts): (usize, Vec<Conflict>)| {
            let starved = conflicts.iter().find(|conflict| conflict.is_starved_source());
            let conflict = starved.or(conflicts.first().filter(|_| may_share))?;
            let follows = conflict.first.node == task.node && conflict.first.task == task.task;
            let (other, how) = match (conflict.is_starved_source(), follows) {
                (true, true) => (&conflict.second, "which the task follows"),
                (true, false) => (&conflict.first, "which follows the task"),
                (false, _) => (&conflict.second, "which needs it at the same time as the task"),
            };
            Some(Avoided { cpu, has: format!("{}, {how}", other.full_name()) })
        };
        cpus.into_iter().filter_map(avoided).collect()
    }

    /// How many sources are starved.
    fn starved_sources(&self) -> usize {
        let all = [self.own.as_slice(), self.running.as_slice()].concat();
        Conflict::among(&all).iter().filter(|conflict| conflict.is_starved_source()).count()
    }

    /// The length of the chain of sources that a task starves, itself included.
    fn sources_before(&self, index: usize) -> usize {
        let source = |index: &usize| {
            let task = self.own.get(*index)?;
            let mut all = self.own.iter().enumerate();
            all.find_map(|(at, it)| (at != *index && task.starves(it).is_some()).then_some(at))
        };
        iter::successors(Some(index), source).take(self.own.len()).count()
    }
}

#[cfg(test)]
#[path = "cpus_tests.rs"]
mod tests;
