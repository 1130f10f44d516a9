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
/// A task that follows another one gets the phase of that one, where its grid is known: it is to watch when
/// that one sends. The tasks that follow nothing choose first, so that theirs are known.
///
/// What a task of the plan will need after its release is not known before it runs, and counts as nothing.
pub fn choose_phases(plan: &mut Plan, running: &[Neighbour]) {
    let mut placed: Vec<Neighbour> = running.to_vec();
    let given = plan.tasks.iter().filter(|task| task.phase_choice == PhaseChoice::Given);
    placed.extend(given.map(|task| Neighbour::planned(&plan.node, task)));
    let automatic = plan.tasks.iter_mut().filter(|task| task.phase_choice != PhaseChoice::Given);
    let (followers, others): (Vec<_>, Vec<_>) =
        automatic.partition(|task| task.followed_service.is_some());
    for task in others.into_iter().chain(followers) {
        let planned = Neighbour::planned(&plan.node, task);
        let need = without_phase(&planned);
        let of_source = phase_of_source(&planned, &placed);
        let chosen = of_source.or_else(|| {
            let cpu = task.cpu.number()?;
            let is_followed = |other: &&Neighbour| planned.followed_in(other).is_some();
            let others: Vec<_> = placed.iter().filter(|other| !is_followed(other)).collect();
            Some(choose(&need, cpu, &plan.node, &others))
        });
        if let Some((phase_ns, reason)) = chosen {
            task.schedule.phase_ns = phase_ns;
            task.phase_choice = PhaseChoice::Automatic { reason };
        }
        placed.push(Neighbour::planned(&plan.node, task));
    }
}

/// The phase of the task that a task follows, and that it is that.
pub(crate) fn phase_of_source(task: &Neighbour, placed: &[Neighbour]) -> Option<(u64, String)> {
    let need = without_phase(task);
    let is_known = |source: &&Neighbour| source.node == task.node || source.is_on_grid_with(&need);
    let is_followed = |source: &&Neighbour| task.followed_in(source).is_some();
    let source = placed.iter().filter(is_followed).find(is_known)?;
    let (own_ns, other_ns) = (task.period_ns.max(1), source.period_ns.max(1));
    if !own_ns.is_multiple_of(other_ns) && !other_ns.is_multiple_of(own_ns) {
        return None;
    }
    let since_ns = source.placement.first_release_ns.checked_sub(EPOCH_OFFSET_NS)?;
    let reason = format!("the phase of {}, which it follows", source.full_name());
    Some((since_ns % own_ns.min(other_ns), reason))
}

/// When a task would need its CPU if it had no phase.
fn without_phase(task: &Neighbour) -> Need {
    Need { release_ns: EPOCH_OFFSET_NS, ..task.need() }
}

/// A phase, and why.
fn choose(task: &Need, cpu: u32, node: &str, placed: &[&Neighbour]) -> (u64, String) {
    let others: Vec<&Neighbour> =
        placed.iter().copied().filter(|other| other.placement.cpu == Some(cpu)).collect();
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

    const FOLLOW: &str = "\nfollow = { service = \"saw\", within = \"300us\" }\n\
                          [[input]]\nname = \"saw\"\nservice = \"saw\"";

    /// A running node that sends the saw, with these keys instead.
    fn source(replaced: &str, by: &str) -> Vec<Neighbour> {
        let mut tasks = running(&plan("source", &[&FAST.replace(replaced, by)]));
        tasks.iter_mut().for_each(|task| task.placement.sends = vec!["saw".into()]);
        tasks
    }

    fn follower(of: &[Neighbour], cpu: &str) -> (u64, String) {
        let mut plan = plan("b", &[&format!("{}{FOLLOW}", FAST.replace("cpu = 1", cpu))]);
        choose_phases(&mut plan, of);
        let task = &plan.tasks[0];
        (task.schedule.phase_ns, task.phase_choice.reason().unwrap().to_owned())
    }

    #[test]
    fn a_task_that_follows_another_one_gets_its_phase_on_whatever_cpu() {
        let expected = (350_000, "the phase of source.fast, which it follows".to_owned());
        for cpu in ["cpu = 1", "cpu = 0", "cpu = \"any\""] {
            assert_eq!(follower(&source("auto", "350us"), cpu), expected, "{cpu}");
        }
        let faster = source("1ms\"", "250us\"");
        assert!(follower(&faster, "cpu = 0").0 < 250_000);
    }

    #[test]
    fn a_task_whose_source_is_unknown_or_off_the_grid_keeps_clear_of_the_others_alone() {
        let other = running(&plan("a", &[FAST]));
        let reason = follower(&other, "cpu = 1").1;
        assert!(reason.contains("clear of a.fast"), "{reason}");
        let odd = source("1ms", "1500us");
        let reason = follower(&[other, odd].concat(), "cpu = 1").1;
        assert!(reason.contains("clear of a.fast on CPU 1"), "{reason}");
        assert!(!reason.contains("source.fast"), "{reason}");
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
