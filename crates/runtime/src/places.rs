//! The CPUs of a node's tasks.

use std::cmp::Reverse;

use isochrone_cyclic::Pinning;
use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, TaskPlan};
use isochrone_machine::{BoundThread, Choice, Machine};

/// The CPUs of a node's tasks.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// In the order of the configuration.
    places: Vec<Place>,
}

/// Where the thread of a task runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// The kernel may move it: the configuration says so, or which CPUs there are is unknown.
    Anywhere,
    /// On a CPU that the configuration names.
    Named(usize),
    /// On a CPU that was chosen; anywhere if the task's priority is refused.
    Chosen(Choice),
}

impl Place {
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
    /// [`choose`](isochrone_machine::Observation::choose) names, where the tasks that have a CPU before it
    /// count as threads that run there.
    pub fn of(plan: &Plan) -> Self {
        Self::on(plan, &Machine::here())
    }

    /// As [`of`](Self::of), on any machine.
    pub fn on(plan: &Plan, machine: &Machine) -> Self {
        let mut places: Vec<Place> = plan.tasks.iter().map(named).collect();
        let mut open: Vec<(usize, &TaskPlan)> =
            plan.tasks.iter().enumerate().filter(|(_, task)| task.cpu.is_auto()).collect();
        if open.is_empty() {
            return Self { places };
        }
        let Some(mut observation) = machine.observation().cloned() else { return Self { places } };
        let thread =
            |task: &TaskPlan, cpu| BoundThread { process: None, name: task.name.clone(), cpu };
        for (task, place) in plan.tasks.iter().zip(&places) {
            place.cpu().into_iter().for_each(|cpu| observation.bind(thread(task, cpu)));
        }
        open.sort_by_key(|(_, task)| (Reverse(task.priority), task.schedule.period_ns));
        for (index, task) in open {
            if let (Some(choice), Some(place)) = (observation.choose(), places.get_mut(index)) {
                observation.bind(thread(task, choice.cpu));
                *place = Place::Chosen(choice);
            }
        }
        Self { places }
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
    pub fn with(mut self, task: usize, place: Place) -> Self {
        self.places.get_mut(task).into_iter().for_each(|old| *old = place.clone());
        self
    }

    /// The same as if the configuration named the CPUs: tasks keep them even if their priority is refused.
    #[must_use]
    pub fn named(mut self) -> Self {
        for place in &mut self.places {
            *place = place.cpu().map_or(Place::Anywhere, Place::Named);
        }
        self
    }

    /// Where each task runs, in the order of the configuration.
    pub fn as_slice(&self) -> &[Place] {
        &self.places
    }

    /// The CPU that a task is to be pinned to.
    pub fn cpu(&self, task: usize) -> Option<usize> {
        self.places.get(task).and_then(Place::cpu)
    }

    /// What a task's thread asks for.
    pub(crate) fn pinning(&self, task: usize) -> Pinning {
        self.places.get(task).map_or(Pinning::Any, Place::pinning)
    }

    /// Why a task's CPU was chosen, if it was.
    pub fn reason(&self, task: usize) -> Option<String> {
        match self.places.get(task)? {
            Place::Chosen(choice) => Some(choice.to_string()),
            Place::Anywhere | Place::Named(_) => None,
        }
    }
}

fn named(task: &TaskPlan) -> Place {
    match task.cpu {
        Cpu::Number(cpu) => Place::Named(cpu as usize),
        Cpu::Auto { .. } | Cpu::Any => Place::Anywhere,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use isochrone_engine::{Rules, Source};

    use super::*;

    /// The CPUs of tasks that are written like this, on a machine of three CPUs.
    #[track_caller]
    fn placed(tasks: &[&str]) -> Vec<Option<usize>> {
        let names = ["a", "b", "c", "d"];
        let task = |(name, keys): (&str, &&str)| format!("[[task]]\nname = \"{name}\"\n{keys}\n");
        let tasks: String = names.into_iter().zip(tasks).map(task).collect();
        let plan = plan(&tasks);
        let root = tempfile::tempdir().unwrap();
        write(root.path(), "sys/devices/system/cpu/online", "0-2");
        write(root.path(), "proc/self/status", "Cpus_allowed_list:\t0-2\n");
        let places = Places::on(&plan, &Machine::below(root.path()));
        (0..plan.tasks.len()).map(|task| places.cpu(task)).collect()
    }

    #[track_caller]
    fn plan(tasks: &str) -> Plan {
        let text = format!("[node]\nname = \"n\"\n{tasks}").into();
        let source = Source { name: "test.toml".into(), text };
        Plan::new(source, &Rules::default()).unwrap()
    }

    fn write(root: &Path, path: &str, text: &str) {
        fs::create_dir_all(root.join(path).parent().unwrap()).unwrap();
        fs::write(root.join(path), text).unwrap();
    }

    #[test]
    fn a_task_with_a_priority_gets_a_cpu_and_one_without_may_move() {
        assert_eq!(
            placed(&["period = \"1ms\"\npriority = 80", "period = \"1ms\""]),
            [Some(2), None]
        );
        assert_eq!(placed(&["period = \"1ms\"\ncpu = \"auto\""]), [Some(2)]);
        assert_eq!(placed(&["period = \"1ms\"\npriority = 80\ncpu = \"any\""]), [None]);
    }

    #[test]
    fn the_highest_priority_chooses_first_and_tasks_are_kept_apart() {
        let slow = "period = \"100ms\"\npriority = 50";
        let fast = "period = \"1ms\"\npriority = 50";
        let first = "period = \"10ms\"\npriority = 80";
        assert_eq!(placed(&[slow, fast, first]), [Some(0), Some(1), Some(2)]);
        assert_eq!(placed(&[slow, slow, slow, slow]), [Some(2), Some(1), Some(0), Some(2)]);
    }

    #[test]
    fn a_cpu_that_is_named_is_kept_and_avoided() {
        let named = "period = \"1ms\"\npriority = 10\ncpu = 2";
        let open = "period = \"1ms\"\npriority = 80";
        assert_eq!(placed(&[named, open]), [Some(2), Some(1)]);
        assert_eq!(placed(&["period = \"1ms\"\ncpu = 7"]), [Some(7)], "the kernel refuses it");
    }

    #[test]
    fn on_a_machine_that_tells_nothing_a_task_may_move() {
        let plan = plan("[[task]]\nname = \"a\"\nperiod = \"1ms\"\npriority = 80\n");
        let root = tempfile::tempdir().unwrap();
        let places = Places::on(&plan, &Machine::below(root.path()));
        assert_eq!(places.as_slice(), [Place::Anywhere]);
    }
}
