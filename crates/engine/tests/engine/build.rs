//! A plan whose parts do not fit together is refused before it is stepped.

use crate::two_tasks;
use crate::two_tasks::{input, output, ramp};
use isochrone_engine::{BuildError, Plan, TaskEngine};

/// An input and two ramps of `fast`, the second of which has its own last value, and one of `slow`.
fn ramps() -> Plan {
    two_tasks::plan(
        &(input("raw", "fast")
            + &ramp("a", "fast", "raw", 1.0)
            + &ramp("b", "fast", "a.delayedValue", "b.delayedValue@prev")
            + &ramp("c", "slow", "b.delayedValue", 1.0)
            + &output("slow", &["c.delayedValue"])),
    )
}

fn refusal(change: impl FnOnce(&mut Plan)) -> BuildError {
    let mut plan = ramps();
    assert!(TaskEngine::build(&plan).is_ok());
    change(&mut plan);
    TaskEngine::build(&plan).err().expect("a refusal")
}

#[test]
fn a_task_without_a_period_or_with_a_name_that_no_thread_can_have_is_refused() {
    let error = refusal(|plan| plan.tasks[1].settings.period_ns = 0);
    assert_eq!(error.to_string(), r#"task "slow": its period is 0"#);
    let error = refusal(|plan| plan.tasks[0].name.push('\0'));
    assert_eq!(error.to_string(), r#"task "fast\0": its name contains a NUL character"#);
}

#[test]
fn an_image_that_is_too_small_for_its_banks_is_refused_with_the_slot() {
    let error = refusal(|plan| plan.tasks[0].image.truncate(20));
    let sentence = error.to_string();
    assert!(sentence.contains("task \"fast\": a bank reaches to slot 20"), "{sentence}");
    assert!(sentence.ends_with("the process image has 20"), "{sentence}");
}

#[test]
fn a_wire_that_leads_backwards_or_into_another_bank_is_refused() {
    for change in [
        |plan: &mut Plan| plan.tasks[0].banks[1].wires[0].from = 12,
        |plan: &mut Plan| plan.tasks[0].banks[1].wires[0].to = 1,
        |plan: &mut Plan| plan.tasks[0].banks.swap(0, 1),
    ] {
        let sentence = refusal(change).to_string();
        assert!(sentence.ends_with("does not stand behind what it reads"), "{sentence}");
    }
}

#[test]
fn slots_of_outputs_links_and_wires_of_the_cycle_before_are_checked_too() {
    for change in [
        |plan: &mut Plan| plan.tasks[1].outputs[0].signals[0].slot = 99,
        |plan: &mut Plan| plan.tasks[0].previous[0].from = u32::MAX,
        |plan: &mut Plan| plan.tasks[0].previous[0].to = 99,
        |plan: &mut Plan| plan.links[0].slots[0] = 99,
        |plan: &mut Plan| plan.links[0].first_slot = usize::MAX - 1,
    ] {
        let sentence = refusal(change).to_string();
        assert!(sentence.contains(", but the process image has "), "{sentence}");
    }
}

#[test]
fn sources_and_tasks_that_do_not_exist_are_refused() {
    for change in [
        |plan: &mut Plan| plan.tasks[1].outputs[0].upstream.sources = vec![7],
        |plan: &mut Plan| plan.links[0].upstream[0].sources = vec![1],
        |plan: &mut Plan| plan.links[0].first_slot = 1,
    ] {
        let sentence = refusal(change).to_string();
        assert!(sentence.contains(" is computed from source "), "{sentence}");
    }
    let unknown = refusal(|plan| plan.links[0].upstream[0].blocks[0].range.end = 2);
    let sentence = unknown.to_string();
    assert!(sentence.contains("by instance 1 of bank "), "{sentence}");
    assert_eq!(
        refusal(|plan| plan.links[0].to = 2).to_string(),
        "a link leads from task 0 to task 2, but there are 2 tasks"
    );
}
