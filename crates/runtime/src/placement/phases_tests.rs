use isochrone_engine::{Rules, Source};

use super::*;
use crate::placement::Conflict;

fn plan(node: &str, tasks: &[&str]) -> Plan {
    let tasks: String = tasks.iter().map(|task| format!("[[task]]\n{task}\n")).collect();
    let text = format!("[node]\nname = \"{node}\"\n{tasks}");
    Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap()
}

/// The tasks of a plan, as they run.
fn running(plan: &Plan) -> Vec<CpuUser> {
    let planned = plan.tasks.iter().map(|task| CpuUser::planned(&plan.node, task));
    let mut tasks: Vec<_> = planned.collect();
    for task in &mut tasks {
        task.placement.first_release_ns += 60_000_000;
        task.placement.response_ns = Some(2_345);
    }
    tasks
}

/// Chooses the phases of a plan beside tasks that run; who is in whose way then.
fn choose_phases(plan: &mut Plan, running: &[CpuUser]) -> Vec<Conflict> {
    let mut users = CpuUsers::new(plan, running);
    users.choose_phases(plan);
    users.conflicts()
}

const FAST: &str = "name = \"fast\"\nperiod = \"1ms\"\npriority = 80\ncpu = 1\nmargin = \"100us\"\nphase = \"auto\"";

#[test]
fn nodes_that_are_started_one_after_the_other_keep_clear_of_each_other() {
    let mut all: Vec<CpuUser> = Vec::new();
    for name in ["a", "b", "c", "d"] {
        let mut plan = plan(name, &[FAST]);
        assert_eq!(choose_phases(&mut plan, &all), [], "{plan:?}");
        let mut again = self::plan(name, &[FAST]);
        choose_phases(&mut again, &all);
        assert_eq!(
            again.tasks[0].settings.schedule(),
            plan.tasks[0].settings.schedule(),
            "the same beside the same"
        );
        all.extend(running(&plan));
    }
}

#[test]
fn the_first_node_gets_the_phase_between_the_ticks_and_the_second_is_told_of_it() {
    let reason = |plan: &Plan| plan.tasks[0].settings.phase_reason.as_deref().unwrap().to_owned();
    let mut first = plan("a", &[FAST]);
    choose_phases(&mut first, &[]);
    assert_eq!(first.tasks[0].settings.phase_ns, 0);
    let said = "between the kernel's ticks; no other task is known to run on CPU 1";
    assert_eq!(reason(&first), said);
    let mut second = plan("b", &[FAST]);
    choose_phases(&mut second, &running(&first));
    assert_eq!(second.tasks[0].settings.phase_ns, 700_000);
    assert_eq!(reason(&second), "200 us clear of a.fast on CPU 1 and of the kernel's ticks");
}

const FOLLOW: &str = "\nfollow = { service = \"saw\", within = \"300us\" }\n\
                      [[input]]\nname = \"saw\"\nservice = \"saw\"";

/// A running node that sends the saw, with these keys instead.
fn source(replaced: &str, by: &str) -> Vec<CpuUser> {
    let mut tasks = running(&plan("source", &[&FAST.replace(replaced, by)]));
    tasks.iter_mut().for_each(|task| task.placement.sends = vec!["saw".into()]);
    tasks
}

fn follower(of: &[CpuUser], cpu: &str) -> (u64, String) {
    let mut plan = plan("b", &[&format!("{}{FOLLOW}", FAST.replace("cpu = 1", cpu))]);
    choose_phases(&mut plan, of);
    let task = &plan.tasks[0];
    (task.settings.phase_ns, task.settings.phase_reason.clone().unwrap())
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
        assert_eq!(plan.tasks[0].settings.phase_ns, 0, "{cpu}");
    }
}

#[test]
fn tasks_of_one_node_keep_clear_of_those_whose_phase_is_given() {
    let given = FAST.replace("auto", "0us").replace("fast", "given");
    let mut plan = plan("a", &[FAST, &given]);
    assert_eq!(choose_phases(&mut plan, &[]), []);
    assert_eq!(plan.tasks[1].settings.phase_ns, 0);
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
    let reason = plan.tasks[0].settings.phase_reason.as_deref().unwrap();
    assert_eq!(
        reason,
        "between the kernel's ticks; a.t cannot be kept clear of at any phase; how the grid of o.fast \
         lies to this one is known only after the start"
    );
}

#[test]
fn a_chain_of_followers_gets_the_phase_of_its_source_in_whatever_order_they_are_written() {
    let source = running(&plan("source", &[&FAST.replace("auto", "350us")]));
    let source: Vec<_> = source
        .into_iter()
        .map(|mut task| {
            task.placement.sends = vec!["saw".into()];
            task
        })
        .collect();
    let ports = |task: &str, service: &str| {
        format!("[[input]]\nname = \"from_{service}\"\ntask = \"{task}\"\nservice = \"{service}\"")
    };
    let follows = |task: &str, service: &str| {
        let task = FAST.replace("fast", task).replace("cpu = 1", "cpu = 0");
        format!("{task}\nfollow = {{ service = \"{service}\", within = \"300us\" }}")
    };
    let sends = "[[block]]\nname = \"b\"\ntask = \"first\"\ntype = \"SawTooth\"\nin = { incrementRange = 1 }\n\
                 [[output]]\nservice = \"between\"\ntask = \"first\"\nsignals = [\"b.value\"]";
    let plain = FAST.replace("fast", "plain").replace("cpu = 1", "cpu = 0");
    let tasks = [
        plain,
        follows("last", "between"),
        [follows("first", "saw"), ports("first", "saw"), ports("last", "between"), sends.into()]
            .join("\n"),
    ];
    let mut plan = plan("b", &tasks.each_ref().map(String::as_str));
    choose_phases(&mut plan, &source);
    let [plain, last, first] = [0, 1, 2].map(|task| plan.tasks[task].settings.phase_ns);
    assert_eq!((last, first), (350_000, 350_000), "handed on");
    assert_eq!(
        plan.tasks[1].settings.phase_reason.as_deref(),
        Some("the phase of b.first, which it follows")
    );
    assert!(plain.abs_diff(350_000) > 100_000, "clear of the followers on its CPU: {plain}");
}
