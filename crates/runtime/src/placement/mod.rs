//! Which task needs which CPU when: the tasks of a plan, the tasks of other nodes that run, and the work of devices
//! there.
//!
//! [`CpuUsers`] is the one model of this. It answers which CPU has room for a task ([`CpuUsers::choose_cpus`]), which
//! phase keeps clear of the other tasks there ([`CpuUsers::choose_phases`]), and which tasks conflict
//! ([`CpuUsers::conflicts`]). Only the run shows whether the frames that a task follows arrive while it watches for
//! them: `late_frames`.

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

/// The tasks of a plan, and those of other nodes that run.
#[derive(Debug, Clone)]
pub struct CpuUsers {
    /// The plan's tasks, in its order, as they will run as far as that is known.
    own: Vec<CpuUser>,
    running: Vec<CpuUser>,
    /// Those of the plan with `cpu = "auto"`.
    auto_cpus: Vec<usize>,
    /// Those of the plan whose phase is still to be chosen.
    open_phases: Vec<usize>,
}

impl CpuUsers {
    /// For a plan that is to run beside other nodes.
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

    /// All tasks except one of the plan.
    fn others(&self, index: usize) -> impl Iterator<Item = &CpuUser> {
        let own = self.own.iter().enumerate().filter(move |(other, _)| *other != index);
        own.map(|(_, user)| user).chain(&self.running)
    }
}
