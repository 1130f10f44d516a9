//! A node beside others: what runs already has a say in its CPUs and phases, and is warned of.

use isochrone_cyclic::ThreadGrant;
use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, TaskPlan, format_duration_ns};
use isochrone_ipc::{Participant, ipc};
use isochrone_machine::Machine;
use isochrone_runtime::{CpuPlace, Neighbours, Places, SharedCpu, StarvedSource, choose_phases};
use isochrone_timing::Warning;

use crate::failure::Failure;
use crate::terminal;

/// What runs beside a node whose tasks are pinned to CPUs, or follow others. Other nodes share none with it.
pub(super) fn find(
    plan: &Plan,
    participant: &Participant<ipc::Service>,
) -> Result<Neighbours, Failure> {
    // A task that follows may take the phase of its source wherever it runs.
    let takes_phase =
        |task: &TaskPlan| task.followed_service.is_some() && task.phase_choice.reason().is_some();
    if plan.tasks.iter().all(|task| matches!(task.cpu, Cpu::Any) && !takes_phase(task)) {
        return Ok(Neighbours::default());
    }
    let running = Neighbours::find(participant, &plan.node).map_err(Failure::found)?;
    for node in &running.silent {
        terminal::note(&format!(
            "note: node \"{node}\" does not say which CPUs its tasks need (it says control = \"off\", just \
             starts, is stopped or is of an older version); it may meet tasks of this one"
        ));
    }
    Ok(running)
}

/// Chooses the CPUs that the configuration leaves to the node, and says why.
pub(super) fn choose_cpus(plan: &mut Plan, running: &Neighbours) -> Places {
    let places = Places::beside(plan, &Machine::here(), &running.tasks);
    places.settle(plan);
    for (task, place) in plan.tasks.iter().zip(places.as_slice()) {
        if let CpuPlace::Chosen(choice) = place {
            terminal::note(&format!("note: task \"{}\": CPU {}: {choice}", task.name, choice.cpu));
        }
    }
    places
}

/// Says which tasks have given up the CPU that was chosen for them.
pub(super) fn note_unpinned<'a>(
    places: &Places,
    grants: impl Iterator<Item = (&'a str, &'a ThreadGrant)>,
) {
    for (place, (task, grant)) in places.as_slice().iter().zip(grants) {
        if let (CpuPlace::Chosen(choice), None) = (place, grant.cpu) {
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
pub(super) fn settle(plan: &mut Plan, running: &Neighbours) -> Vec<Warning> {
    choose_phases(plan, &running.tasks);
    for task in &plan.tasks {
        if let Some(reason) = task.phase_choice.reason() {
            let phase = format_duration_ns(task.schedule.phase_ns);
            terminal::note(&format!("note: task \"{}\": phase {phase}, {reason}", task.name));
        }
    }
    let shared = SharedCpu::of_plan(plan, &running.tasks);
    let starved = StarvedSource::of_plan(plan, &running.tasks);
    let starved = starved.iter().map(Into::into);
    shared.iter().map(Into::into).chain(starved).collect()
}
