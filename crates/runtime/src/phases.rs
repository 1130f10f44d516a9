//! `phase = "auto"`: phases that keep clear of what runs on the same CPU.

use isochrone_cyclic::EPOCH_OFFSET_NS;
use isochrone_engine::Plan;
use isochrone_engine::config::PhaseChoice;
use isochrone_schedule::{ClearPhase, Need, clear_phase_ns};
use isochrone_timing::units::duration;

use crate::neighbours::Neighbour;

/// Chooses the phases of the tasks with `phase = "auto"`, in the order of the configuration: as far as
/// possible from what other tasks of the plan, and those that run, need of the same CPU, and from the
/// kernel's ticks. Tasks that are pinned to no CPU keep the phase between the ticks. The same plan beside
/// the same tasks gets the same phases.
///
/// What a task of the plan will need after its release is not known before it runs, and counts as nothing.
pub fn choose_phases(plan: &mut Plan, running: &[Neighbour]) {
    let mut placed: Vec<Neighbour> = running.to_vec();
    let given = plan.tasks.iter().filter(|task| task.phase_choice == PhaseChoice::Given);
    placed.extend(given.map(|task| Neighbour::planned(&plan.node, task)));
    for task in plan.tasks.iter_mut().filter(|task| task.phase_choice != PhaseChoice::Given) {
        if let Some(cpu) = task.cpu.number() {
            let need =
                Need { release_ns: EPOCH_OFFSET_NS, ..Neighbour::planned(&plan.node, task).need() };
            let (phase_ns, reason) = choose(&need, cpu, &plan.node, &placed);
            task.schedule.phase_ns = phase_ns;
            task.phase_choice = PhaseChoice::Automatic { reason };
        }
        placed.push(Neighbour::planned(&plan.node, task));
    }
}

/// A phase, and why.
fn choose(task: &Need, cpu: u32, node: &str, placed: &[Neighbour]) -> (u64, String) {
    let others: Vec<&Neighbour> =
        placed.iter().filter(|other| other.placement.cpu == Some(cpu)).collect();
    let (known, unknown): (Vec<&Neighbour>, Vec<&Neighbour>) =
        others.iter().copied().partition(|other| other.node == node || other.is_on_grid_with(task));
    let needs: Vec<Need> = known.iter().map(|other| other.need()).collect();
    let ClearPhase { phase_ns, clear_ns } = clear_phase_ns(task, &needs);
    let placed = Need { release_ns: task.release_ns + phase_ns, ..*task };
    let (met, clear): (Vec<&Neighbour>, Vec<&Neighbour>) =
        known.into_iter().partition(|other| placed.meeting(&other.need()).is_some());
    let mut reasons = vec![match clear_ns {
        Some(clear_ns) => format!(
            "{} clear of {} on CPU {cpu} and of the kernel's ticks",
            duration(clear_ns as f64),
            names(&clear)
        ),
        None if others.is_empty() => {
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
    (phase_ns, reasons.join("; "))
}

fn names(tasks: &[&Neighbour]) -> String {
    let names: Vec<_> = tasks.iter().map(|task| format!("{}.{}", task.node, task.task)).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use isochrone_engine::{Rules, Source};

    use super::*;
    use crate::SharedCpu;

    fn plan(node: &str, tasks: &[&str]) -> Plan {
        let tasks: String = tasks.iter().map(|task| format!("[[task]]\n{task}\n")).collect();
        let text = format!("[node]\nname = \"{node}\"\n{tasks}");
        Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap()
    }

    /// The tasks of a plan, as they run.
    fn running(plan: &Plan) -> Vec<Neighbour> {
        let mut tasks: Vec<_> =
            plan.tasks.iter().map(|task| Neighbour::planned(&plan.node, task)).collect();
        for task in &mut tasks {
            task.placement.first_release_ns += 60_000_000;
            task.placement.response_ns = Some(2_345);
        }
        tasks
    }

    const FAST: &str = "name = \"fast\"\nperiod = \"1ms\"\npriority = 80\ncpu = 1\nmargin = \"100us\"\nphase = \"auto\"";

    #[test]
    fn nodes_that_are_started_one_after_the_other_keep_clear_of_each_other() {
        let mut all: Vec<Neighbour> = Vec::new();
        for name in ["a", "b", "c", "d"] {
            let mut plan = plan(name, &[FAST]);
            choose_phases(&mut plan, &all);
            assert_eq!(SharedCpu::of_plan(&plan, &all), [], "{plan:?}");
            let mut again = self::plan(name, &[FAST]);
            choose_phases(&mut again, &all);
            assert_eq!(again.tasks[0].schedule, plan.tasks[0].schedule, "the same beside the same");
            all.extend(running(&plan));
        }
    }

    #[test]
    fn the_first_node_gets_the_phase_between_the_ticks_and_the_second_is_told_of_it() {
        let reason = |plan: &Plan| plan.tasks[0].phase_choice.reason().unwrap().to_owned();
        let mut first = plan("a", &[FAST]);
        choose_phases(&mut first, &[]);
        assert_eq!(first.tasks[0].schedule.phase_ns, 0);
        let said = "between the kernel's ticks; no other task is known to run on CPU 1";
        assert_eq!(reason(&first), said);
        let mut second = plan("b", &[FAST]);
        choose_phases(&mut second, &running(&first));
        assert_eq!(second.tasks[0].schedule.phase_ns, 700_000);
        assert_eq!(reason(&second), "200 us clear of a.fast on CPU 1 and of the kernel's ticks");
    }

    #[test]
    fn a_task_on_another_cpu_or_on_none_is_not_in_the_way() {
        let other = running(&plan("a", &[FAST]));
        for cpu in ["cpu = 0", ""] {
            let mut plan = plan("b", &[&FAST.replace("cpu = 1", cpu)]);
            choose_phases(&mut plan, &other);
            assert_eq!(plan.tasks[0].schedule.phase_ns, 0, "{cpu}");
        }
    }

    #[test]
    fn tasks_of_one_node_keep_clear_of_those_whose_phase_is_given() {
        let given = FAST.replace("auto", "0us").replace("fast", "given");
        let mut plan = plan("a", &[FAST, &given]);
        choose_phases(&mut plan, &[]);
        assert_eq!(plan.tasks[1].schedule.phase_ns, 0);
        assert_eq!(SharedCpu::of_plan(&plan, &[]), []);
    }

    #[test]
    fn what_cannot_be_avoided_is_named() {
        let spins = running(&plan(
            "a",
            &["name = \"t\"\nperiod = \"1ms\"\npriority = 80\ncpu = 1\nwake = \"spin\""],
        ));
        let odd = running(&plan("o", &[&FAST.replace("1ms", "7ms")]));
        let mut plan = plan("b", &[&FAST.replace("1ms", "7ms")]);
        choose_phases(&mut plan, &[spins, odd].concat());
        let reason = plan.tasks[0].phase_choice.reason().unwrap();
        assert_eq!(
            reason,
            "between the kernel's ticks; a.t cannot be kept clear of at any phase; how the grid of o.fast \
             lies to this one is known only after the start"
        );
    }
}
