//! Which task gets which CPU.

use std::cmp::Reverse;
use std::iter;

use isochrone_cyclic::EPOCH_OFFSET_NS;
use isochrone_engine::{Plan, TaskPlan};
use isochrone_machine::{Avoided, BoundThread, Observation};

use super::{CpuPlace, Places};
use crate::neighbours::Neighbour;
use crate::phases::phase_of_source;
use crate::shared_cpu::SharedCpu;
use crate::starved_source::StarvedSource;

/// Chooses the CPUs that a plan leaves open. The others are `named`.
pub(super) fn choose(
    plan: &Plan,
    named: &[CpuPlace],
    observation: &Observation,
    running: &[Neighbour],
) -> Places {
    let start = Chooser::new(plan, named, observation, running);
    let mut open: Vec<(usize, &TaskPlan)> =
        plan.tasks.iter().enumerate().filter(|(_, task)| task.cpu.is_auto()).collect();
    open.sort_by_key(|(_, task)| (Reverse(task.priority), task.schedule.period_ns));
    let by_rank = start.clone().give(&open);
    if by_rank.starved() == 0 {
        return by_rank.places();
    }
    // Of those that chose before it, a task that comes behind its source has to keep off that one alone.
    open.sort_by_key(|(index, _)| start.hops(*index));
    let by_flow = start.give(&open);
    if by_flow.starved() < by_rank.starved() { by_flow.places() } else { by_rank.places() }
}

#[derive(Clone)]
struct Chooser<'a> {
    /// The plan's tasks as they will run. Each has its CPU as soon as it is known.
    tasks: Vec<Neighbour>,
    places: Vec<CpuPlace>,
    observation: Observation,
    running: &'a [Neighbour],
}

impl<'a> Chooser<'a> {
    fn new(
        plan: &Plan,
        named: &[CpuPlace],
        observation: &Observation,
        running: &'a [Neighbour],
    ) -> Self {
        let planned: Vec<Neighbour> =
            plan.tasks.iter().map(|task| Neighbour::planned(&plan.node, task)).collect();
        let known = [&planned, running].concat();
        // A task that follows another one gets its phase on whatever CPU.
        let phased = |(task, of): (&Neighbour, &TaskPlan)| {
            let chosen = of.phase_choice.reason().and_then(|_| phase_of_source(task, &known));
            let mut task = task.clone();
            let first_ns = chosen.map(|(phase_ns, _)| EPOCH_OFFSET_NS + phase_ns);
            first_ns.into_iter().for_each(|ns| task.placement.first_release_ns = ns);
            task
        };
        let tasks = planned.iter().zip(&plan.tasks).map(phased).collect();
        let (places, mut observation) = (named.to_vec(), observation.clone());
        for neighbour in running {
            if let Some(cpu) = neighbour.placement.cpu {
                observation.name(cpu as usize, &neighbour.task, &neighbour.full_name());
            }
        }
        let mut chooser = Self { tasks, places, observation, running };
        for (index, place) in named.iter().enumerate() {
            chooser.put(index, place.clone());
        }
        chooser
    }

    /// Has tasks choose one after the other.
    fn give(mut self, order: &[(usize, &TaskPlan)]) -> Self {
        for (index, _) in order {
            let mut avoided = self.avoided(*index);
            avoided.extend(self.crowded(*index, &avoided));
            let choice = self.observation.choose_off(&avoided);
            choice.into_iter().for_each(|choice| self.put(*index, CpuPlace::Chosen(choice)));
        }
        self
    }

    fn put(&mut self, index: usize, place: CpuPlace) {
        let (Some(task), Some(old)) = (self.tasks.get_mut(index), self.places.get_mut(index))
        else {
            return;
        };
        if let Some(cpu) = place.cpu() {
            self.observation.bind(BoundThread { process: None, name: task.full_name(), cpu });
            task.placement.cpu = cpu.try_into().ok();
        }
        *old = place;
    }

    /// The CPUs on which a task would keep another one from sending, or another one it.
    fn avoided(&self, index: usize) -> Vec<Avoided> {
        let Some(task) = self.tasks.get(index) else { return Vec::new() };
        let avoided = |other: &Neighbour| {
            let (cpu, name) = (other.placement.cpu? as usize, other.full_name());
            let has = if task.watched_in_the_way_of(other).is_some() {
                format!("{name}, which the task follows")
            } else {
                other.watched_in_the_way_of(task)?;
                format!("{name}, which follows the task")
            };
            Some(Avoided { cpu, has })
        };
        self.tasks.iter().chain(self.running).filter_map(avoided).collect()
    }

    /// The CPUs of tasks that would need them at the same time as a task, where it had better share that of the one
    /// that it follows: there the two come one after the other.
    fn crowded(&self, index: usize, avoided: &[Avoided]) -> Vec<Avoided> {
        let Some(task) = self.tasks.get(index) else { return Vec::new() };
        let others = || self.tasks.iter().chain(self.running);
        let met = |cpu| {
            let mut there = task.clone();
            there.placement.cpu = cpu;
            others().find(move |other| SharedCpu::of(&there, other).is_some())
        };
        let sources = others().filter(|other| task.followed_in(other).is_some());
        let is_free = |cpu: &u32| {
            !avoided.iter().any(|it| it.cpu == *cpu as usize) && met(Some(*cpu)).is_none()
        };
        if sources.filter_map(|source| source.placement.cpu).find(is_free).is_none() {
            return Vec::new();
        }
        let crowded = |other: &Neighbour| {
            let cpu = other.placement.cpu?;
            let has = format!(
                "{}, which needs it at the same time as the task",
                met(Some(cpu))?.full_name()
            );
            Some(Avoided { cpu: cpu as usize, has })
        };
        others().filter_map(crowded).collect()
    }

    /// How many tasks keep their sources from sending.
    fn starved(&self) -> usize {
        StarvedSource::of_running(&[&self.tasks, self.running].concat()).len()
    }

    /// How many tasks stand behind each other from a task to where what it follows comes from.
    fn hops(&self, index: usize) -> usize {
        let source = |task: &&Neighbour| {
            self.tasks.iter().find(|other| task.watched_in_the_way_of(other).is_some())
        };
        iter::successors(self.tasks.get(index), source).take(self.tasks.len()).count()
    }

    fn places(self) -> Places {
        Places { places: self.places }
    }
}
