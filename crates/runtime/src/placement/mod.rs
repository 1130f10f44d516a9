//! Who needs which CPU when: the tasks of a plan, those of the nodes that run beside it, and what devices do there.
//!
//! [`CpuUsers`] is the one model of it. What a node does about CPUs and phases are questions to it: which CPU has
//! room for a task ([`CpuUsers::choose_cpus`]), which phase keeps clear of the others there
//! ([`CpuUsers::choose_phases`]), and who is in whose way ([`CpuUsers::conflicts`]). Whether the frames that a task
//! follows come while it watches for them, only the run can tell: `late_frames`.

mod clear_phase;
mod conflict;
mod cpus;
mod late_frames;
mod need;
mod neighbours;
mod phases;
mod sources;
mod user;

use isochrone_engine::Plan;

pub use conflict::{Conflict, ConflictKind};
pub use cpus::{TaskCpu, TaskCpus};
pub(crate) use late_frames::FollowedFrames;
pub use need::Meeting;
pub use neighbours::Neighbours;
pub use user::CpuUser;

/// The tasks of a plan, and those that run beside them.
#[derive(Debug, Clone)]
pub struct CpuUsers {
    /// The plan's, in its order, as they will run as far as that is known.
    own: Vec<CpuUser>,
    running: Vec<CpuUser>,
    /// Those of the plan with `cpu = "auto"`.
    auto_cpus: Vec<usize>,
    /// Those of the plan whose phase is still to be chosen.
    open_phases: Vec<usize>,
}

impl CpuUsers {
    /// The tasks of a plan that is to run beside others.
    pub fn new(plan: &Plan, running: &[CpuUser]) -> Self {
        let all = || plan.tasks.iter().enumerate();
        let auto_cpus = all().filter(|(_, task)| task.settings.cpu.is_auto());
        let open_phases = all().filter(|(_, task)| task.settings.phase_reason.is_some());
        Self {
            own: plan.tasks.iter().map(|task| CpuUser::planned(&plan.node, task)).collect(),
            running: running.to_vec(),
            auto_cpus: auto_cpus.map(|(index, _)| index).collect(),
            open_phases: open_phases.map(|(index, _)| index).collect(),
        }
    }

    /// All other tasks than one of the plan.
    fn others(&self, index: usize) -> impl Iterator<Item = &CpuUser> {
        let own = self.own.iter().enumerate().filter(move |(other, _)| *other != index);
        own.map(|(_, user)| user).chain(&self.running)
    }
}
