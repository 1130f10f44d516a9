//! A node beside others: what runs already has a say in its CPUs and phases, and is warned of.

use isochrone_cyclic::ThreadGrant;
use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, TaskPlan, format_duration_ns};
use isochrone_ipc::{Participant, ipc};
use isochrone_machine::Machine;
use isochrone_runtime::{CpuUsers, Neighbours, TaskCpu, TaskCpus};
use isochrone_timing::Warning;

use crate::base::failure::Failure;
use crate::base::terminal;

/// The tasks of a plan, and what runs beside it if they are pinned to CPUs or follow others. Otherwise they share none
/// with other nodes.
pub(super) fn find(
    plan: &Plan,
    participant: &Participant<ipc::Service>,
) -> Result<CpuUsers, Failure> {
    // A task that follows may take the phase of its source wherever it runs.
    let takes_phase =
        |task: &TaskPlan| task.settings.follow.is_some() && task.settings.phase_reason.is_some();
    if plan.tasks.iter().all(|task| matches!(task.settings.cpu, Cpu::Any) && !takes_phase(task)) {
        return Ok(CpuUsers::new(plan, &[]));
    }
    let running = Neighbours::find(participant, &plan.node).map_err(Failure::found)?;
    for node in &running.silent {
        terminal::note(&format!(
            "note: node \"{node}\" does not say which CPUs its tasks need (it says control = \"off\", just \
             starts, is stopped or is of an older version); it may meet tasks of this one"
        ));
    }
    Ok(CpuUsers::new(plan, &running.tasks))
}

/// Chooses the CPUs that the configuration leaves to the node, and says why.
pub(super) fn choose_cpus(plan: &mut Plan, users: &mut CpuUsers) -> TaskCpus {
    let cpus = users.choose_cpus(&Machine::here());
    cpus.settle(plan);
    for (task, cpu) in plan.tasks.iter().zip(cpus.as_slice()) {
        if let TaskCpu::Chosen(choice) = cpu {
            terminal::note(&format!("note: task \"{}\": CPU {}: {choice}", task.name, choice.cpu));
        }
    }
    cpus
}

/// Says which tasks have given up the CPU that was chosen for them.
pub(super) fn note_unpinned<'a>(
    cpus: &TaskCpus,
    grants: impl Iterator<Item = (&'a str, &'a ThreadGrant)>,
) {
    for (cpu, (task, grant)) in cpus.as_slice().iter().zip(grants) {
        if let (TaskCpu::Chosen(choice), None) = (cpu, grant.cpu) {
            terminal::note(&format!(
                "note: task \"{task}\": not pinned to CPU {}, because its priority is refused; name the CPU \
                 (cpu = {0}) to have it stay there",
                choice.cpu
            ));
        }
    }
}

/// Chooses the phases that the configuration leaves to the node, and returns which tasks will share a CPU
/// and need it at the same time, and which will keep the tasks that they follow from sending.
pub(super) fn choose_phases(plan: &mut Plan, users: &mut CpuUsers) -> Vec<Warning> {
    users.choose_phases(plan);
    for task in &plan.tasks {
        if let Some(reason) = &task.settings.phase_reason {
            let phase = format_duration_ns(task.settings.phase_ns);
            terminal::note(&format!("note: task \"{}\": phase {phase}, {reason}", task.name));
        }
    }
    users.conflicts().iter().map(Warning::from).collect()
}
