use isochrone_control::Placement;
use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, Rules, Source};

use super::super::need::Need;
use super::*;

fn plan(tasks: &str) -> Plan {
    let text = format!("[node]\nname = \"b\"\n{tasks}");
    Plan::new(Source::new("b.toml", text), &Rules::default()).unwrap()
}

/// The tasks of a plan that meet each other, or tasks that run.
fn meetings(plan: &Plan, running: &[CpuUser]) -> Vec<Conflict> {
    let mut conflicts = CpuUsers::new(plan, running).conflicts();
    conflicts.retain(|conflict| !conflict.is_starved_source());
    conflicts
}

/// The sources that are kept from sending.
fn starved(plan: &Plan, running: &[CpuUser]) -> Vec<Conflict> {
    let mut conflicts = CpuUsers::new(plan, running).conflicts();
    conflicts.retain(Conflict::is_starved_source);
    conflicts
}

fn said(conflict: &Conflict) -> String {
    Warning::from(conflict).message
}

const FAST: &str = "[[task]]\nname = \"fast\"\nperiod = \"1ms\"\npriority = 80\ncpu = 1\n";

fn running(phase_ns: u64) -> CpuUser {
    let mut task = CpuUser::planned("a", &plan(FAST).tasks[0]);
    task.placement.first_release_ns += 40_000_000 + phase_ns;
    task.placement.response_ns = Some(1_234);
    task
}

#[test]
fn a_node_of_the_same_period_and_phase_on_the_same_cpu_is_met_at_each_release() {
    let shared = meetings(&plan(FAST), &[running(0)]);
    assert_eq!(
        shared.iter().map(said).collect::<Vec<_>>(),
        [
            "b.fast and a.fast share CPU 1 and meet at each release of b.fast, 0 ns apart: both need the \
          CPU for up to 200 us, and at equal priority (fifo:80) the one that wakes up later waits until \
          the other sleeps"
        ]
    );
    assert_eq!(meetings(&plan(FAST), &[running(500_000)]), []);
    let elsewhere = plan(&FAST.replace("cpu = 1", "cpu = 0"));
    assert_eq!(meetings(&elsewhere, &[running(0)]), []);
    let moves = plan(&FAST.replace("cpu = 1", ""));
    assert_eq!(meetings(&moves, &[running(0)]), []);
}

#[test]
fn a_phase_is_no_remedy_where_none_is_clear_or_one_was_chosen() {
    let remedy = |plan: &Plan, other: &CpuUser| {
        Warning::from(&meetings(plan, std::slice::from_ref(other))[0]).remedy
    };
    let automatic = "give b.fast phase = \"auto\", which keeps clear of what runs, or another cpu";
    assert_eq!(remedy(&plan(FAST), &running(0)), automatic);
    let follows = plan(&following().replace("600us", "500us"));
    let other = CpuUser::planned("a", &follows.tasks[0]);
    let expected = "give b.fast another cpu, or a smaller margin or a shorter within";
    assert_eq!(remedy(&follows, &other), expected);
    let said = said(&meetings(&follows, &[other])[0]);
    let together =
        "; together they may watch the clock for 120 % of it, of which the kernel leaves";
    assert!(said.contains(together), "{said}");
    let mut chosen = plan(FAST);
    let reason = "between the kernel's ticks".into();
    chosen.tasks[0].settings.phase_reason = Some(reason);
    assert_eq!(remedy(&chosen, &running(0)), "give b.fast another cpu, or a smaller margin");
}

#[test]
fn the_one_of_lower_priority_waits() {
    let low = plan(&FAST.replace("80", "70").replace("1ms", "2ms"));
    let shared = meetings(&low, &[running(0)]);
    let waits = said(&shared[0]);
    assert!(waits.ends_with("and b.fast (fifo:70) waits for a.fast (fifo:80)"), "{waits}");
    let other = CpuUser { period_ns: 4_000_000, ..running(0) };
    let said = said(&meetings(&low, &[other])[0]);
    assert!(said.contains("meet at 1 of 2 releases of b.fast"), "{said}");
}

#[test]
fn tasks_of_one_node_meet_too() {
    let two = format!("{FAST}{}", FAST.replace("fast", "slow").replace("1ms", "10ms"));
    let shared = meetings(&plan(&two), &[]);
    assert_eq!(shared.len(), 1);
    assert!(matches!(shared[0].kind, ConflictKind::Meeting(Meeting { of: 10, .. })));
}

#[test]
fn tasks_of_one_node_with_different_priorities_are_meant_to_wait_for_each_other() {
    let low = FAST.replace("fast", "slow").replace("80", "70");
    assert_eq!(meetings(&plan(&format!("{FAST}{low}")), &[]), []);
}

#[test]
fn a_task_that_only_sleeps_is_in_nobodys_way() {
    let sleeps = plan(&FAST.replace("priority = 80\n", ""));
    assert_eq!(meetings(&sleeps, &[running(0)]), []);
}

const SAW: &str = "[[input]]\nname = \"saw\"\nservice = \"saw\"\n";

/// The fast task, which waits for the saw for 600 us after its release.
fn following() -> String {
    format!(
        "{FAST}margin = \"100us\"\nphase = \"300us\"\n\
         follow = {{ service = \"saw\", within = \"600us\" }}\n{SAW}"
    )
}

#[test]
fn a_task_that_follows_needs_its_cpu_after_its_release_until_its_wait_is_up() {
    let mut task = CpuUser::planned("b", &plan(&following()).tasks[0]);
    for response_ns in [None, Some(12_345), Some(700_001)] {
        task.placement.response_ns = response_ns;
        let Need { before_ns, after_ns, .. } = task.need();
        let expected_ns = if response_ns == Some(700_001) { 710_000 } else { 600_000 };
        assert_eq!((before_ns, after_ns), (100_000, expected_ns), "{response_ns:?}");
    }
    // It watches from 200 to 900 us; the other one needs its CPU from 800 us on.
    let shared = meetings(&plan(&following()), &[running(0)]);
    let overlaps = |kind: &ConflictKind| {
        matches!(kind, ConflictKind::Meeting(Meeting { overlap_ns: 100_000, .. }))
    };
    assert!(overlaps(&shared[0].kind), "{shared:?}");
    let sleeps = following().replace("priority = 80\n", "").replace("margin = \"100us\"\n", "");
    assert_eq!(meetings(&plan(&sleeps), &[running(0)]).len(), 1, "it watches, too");
}

#[test]
fn a_task_that_follows_another_one_is_meant_to_be_there_when_that_one_sends() {
    let source = CpuUser {
        placement: Placement { sends: vec!["saw".into()], ..running(0).placement },
        ..running(0)
    };
    let lower = following().replace("priority = 80", "priority = 70");
    for follower in [&following(), &lower] {
        assert_eq!(meetings(&plan(follower), std::slice::from_ref(&source)), []);
    }
    let normal = following().replace("priority = 80", "wake = \"hybrid\"");
    assert_eq!(meetings(&plan(&normal), &[source]).len(), 1, "they take turns");
}

#[test]
fn what_cannot_be_known_before_the_start_is_not_said() {
    let odd = plan(&FAST.replace("1ms", "7ms"));
    let other = CpuUser { period_ns: 7_000_000, ..running(0) };
    assert_eq!(meetings(&odd, std::slice::from_ref(&other)), []);
    assert_eq!(Conflict::among(&[other.clone(), other]).len(), 1, "of what runs all is known");
}

fn of_node(node: &str, task: &str, ports: &str) -> Plan {
    let text = format!(
        "[node]\nname = \"{node}\"\n[[task]]\nname = \"fast\"\nperiod = \"1ms\"\n{task}\n{ports}"
    );
    Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap()
}

fn sending(task: &str) -> Plan {
    let saw = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\nin = { incrementRange = 1 }\n\
               [[output]]\nservice = \"saw\"\nsignals = [\"saw.value\"]";
    of_node("a", task, saw)
}

fn watching(task: &str) -> Plan {
    let follow = format!("{task}\nfollow = {{ service = \"saw\", within = \"100us\" }}");
    of_node("b", &follow, SAW)
}

fn tasks_of(plan: &Plan) -> Vec<CpuUser> {
    plan.tasks.iter().map(|task| CpuUser::planned(&plan.node, task)).collect()
}

#[test]
fn a_source_of_the_same_or_a_lower_priority_on_the_cpu_of_its_follower_is_kept_from_sending() {
    let follower = watching("priority = 80\ncpu = 1");
    for task in ["priority = 80\ncpu = 1", "priority = 79\ncpu = 1", "cpu = 1"] {
        let source = sending(task);
        let of_follower = starved(&follower, &tasks_of(&source));
        assert_eq!(of_follower.len(), 1, "{task}");
        assert_eq!(starved(&source, &tasks_of(&follower)), of_follower);
        let both = [tasks_of(&source), tasks_of(&follower)].concat();
        assert_eq!(Conflict::among(&both), of_follower);
    }
    let source = tasks_of(&sending("priority = 80\ncpu = 1"));
    assert_eq!(
        said(&starved(&follower, &source)[0]),
        "b.fast (fifo:80) follows \"saw\" of a.fast (fifo:80) on the same CPU 1: while the one watches, \
         the other cannot send"
    );
}

#[test]
fn tasks_of_one_plan_are_looked_at_once_their_cpus_are_chosen() {
    let saw = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\ntask = \"source\"\n\
               in = { incrementRange = 1 }\n[[output]]\nservice = \"saw\"\ntask = \"source\"\nsignals = [\"saw.value\"]\n";
    let follower = "[[task]]\nname = \"follower\"\nperiod = \"1ms\"\npriority = 80\n\
                    follow = { service = \"saw\", within = \"100us\" }\n";
    let source = "[[task]]\nname = \"source\"\nperiod = \"1ms\"\npriority = 80\n";
    let input = "[[input]]\nname = \"in\"\nservice = \"saw\"\ntask = \"follower\"\n";
    let text = format!("[node]\nname = \"n\"\n{source}{follower}{input}{saw}");
    let mut plan = Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
    assert_eq!(starved(&plan, &[]), [], "no CPU is chosen yet");
    plan.tasks.iter_mut().for_each(|task| task.settings.cpu = Cpu::Auto { chosen: Some(1) });
    let found = starved(&plan, &[]);
    assert_eq!(found.len(), 1);
    assert_eq!((&found[0].first.task[..], &found[0].second.task[..]), ("follower", "source"));
}

#[test]
fn a_source_that_can_run_while_it_is_watched_for_is_kept_from_nothing() {
    for (of_source, of_follower) in [
        ("priority = 80\ncpu = 1", "priority = 79\ncpu = 1"),
        ("priority = 80\ncpu = 0", "priority = 80\ncpu = 1"),
        ("priority = 80", "priority = 80"),
        ("cpu = 1", "cpu = 1"),
    ] {
        let source = tasks_of(&sending(of_source));
        assert_eq!(starved(&watching(of_follower), &source), [], "{of_source}");
    }
}
