//! Which values of other tasks enter a task: when they come in a run, no journal says.

use std::collections::BTreeSet;

use isochrone_engine::{Plan, Source, TaskPlan};

/// What of other tasks enters a task, by the names of the signals.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Entering {
    /// Wired to blocks: all that is computed from these is uncertain.
    pub(super) blocks: BTreeSet<String>,
    /// In outputs alone.
    pub(super) outputs: BTreeSet<String>,
}

/// What enters each task of a plan, with this configuration or any other that was applied to it.
pub(super) fn of(plan: &Plan, applied: &BTreeSet<&str>) -> Vec<Entering> {
    let mut entering: Vec<Entering> = plan.tasks.iter().map(|_| Entering::default()).collect();
    add(&mut entering, plan);
    for text in applied {
        let source = Source::new(plan.source.name.clone(), *text);
        // That it can be read was seen to when the journal was.
        if let Ok(applied) = plan.rules.plan(source) {
            add(&mut entering, &applied);
        }
    }
    for Entering { blocks, outputs } in &mut entering {
        outputs.retain(|name| !blocks.contains(name));
    }
    entering
}

/// Another configuration has the same tasks.
fn add(entering: &mut [Entering], plan: &Plan) {
    for link in &plan.links {
        let (Some(found), Some(task)) = (entering.get_mut(link.to), plan.tasks.get(link.to)) else {
            continue;
        };
        for (place, slot) in link.slots.iter().enumerate() {
            let name = plan.slot_name(link.from, *slot as usize);
            let is_wired = is_wired(task, link.first_slot + place);
            let of = if is_wired { &mut found.blocks } else { &mut found.outputs };
            of.insert(name);
        }
    }
}

/// Whether a wire leads from a slot to a block.
fn is_wired(task: &TaskPlan, slot: usize) -> bool {
    let wires = task.banks.iter().flat_map(|bank| &bank.wires).chain(&task.previous);
    wires.into_iter().any(|wire| wire.from as usize == slot)
}

/// For which tasks the simulation of a run is exact, and which values are in the way.
pub(super) fn note(plan: &Plan, entering: &[Entering]) -> String {
    let tasks = || plan.tasks.iter().map(|task| task.name.as_str()).zip(entering);
    let exact = tasks().filter(|(_, of)| of.blocks.is_empty()).map(|(task, of)| {
        match of.outputs.is_empty() {
            true => task.to_owned(),
            false => format!("{task} (all but {}, which other tasks compute)", some(&of.outputs)),
        }
    });
    let open = tasks().filter(|(_, of)| !of.blocks.is_empty());
    let open = open
        .map(|(task, of)| format!("{task} (values of other tasks enter: {})", some(&of.blocks)));
    let (exact, open): (Vec<_>, Vec<_>) = (exact.collect(), open.collect());
    let mut note = String::new();
    if !exact.is_empty() {
        note += &format!("; with the inputs of the run, exact for: {}", exact.join(", "));
    }
    if !open.is_empty() {
        note += &format!("; not for: {}", open.join(", "));
    }
    note
}

/// The first of some names, and how many there are besides.
fn some(names: &BTreeSet<String>) -> String {
    const NAMED: usize = 5;
    let mut named: Vec<_> = names.iter().take(NAMED).cloned().collect();
    if names.len() > NAMED {
        named.push(format!("{} more", names.len() - NAMED));
    }
    named.join(", ")
}

#[cfg(test)]
mod tests {
    use isochrone_engine::Rules;

    use super::*;

    /// Two tasks, of which the one publishes what the other computes.
    const START: &str = r#"
        [node]
        name = "n"
        [[task]]
        name = "fast"
        period = "1ms"
        [[task]]
        name = "slow"
        period = "2ms"
        [[block]]
        name = "a"
        type = "LimRateOfChangeCI"
        task = "fast"
        in = { value = 1.0, setChangeRate = 1.0 }
        [[block]]
        name = "b"
        type = "LimRateOfChangeCI"
        task = "slow"
        in = { value = 1.0, setChangeRate = 1.0 }
        [[output]]
        service = "out"
        task = "fast"
        signals = ["a.delayedValue", "b.delayedValue"]
    "#;

    fn noted(applied: &[&str]) -> String {
        let plan = Plan::new(Source::new("n.toml", START), &Rules::default()).unwrap();
        note(&plan, &of(&plan, &applied.iter().copied().collect()))
    }

    #[test]
    fn a_value_that_a_task_only_publishes_leaves_its_blocks_exact() {
        assert_eq!(
            noted(&[]),
            "; with the inputs of the run, exact for: fast (all but b.delayedValue, which other tasks \
             compute), slow"
        );
    }

    #[test]
    fn a_task_that_an_applied_configuration_lets_another_one_into_is_not_exact() {
        let crossed = START.replacen("value = 1.0", "value = \"b.delayedValue\"", 1);
        let said = noted(&[START, &crossed]);
        assert_eq!(
            said,
            "; with the inputs of the run, exact for: slow; not for: fast (values of other tasks enter: \
             b.delayedValue)"
        );
        let both = crossed.replacen("value = 1.0", "value = \"a.delayedValue\"", 1);
        assert!(noted(&[&both]).starts_with("; not for: fast (values"), "{}", noted(&[&both]));
    }

    #[test]
    fn of_many_names_the_first_are_told_and_the_rest_is_counted() {
        let names: BTreeSet<String> = (0..8).map(|number| format!("x{number}")).collect();
        assert_eq!(some(&names), "x0, x1, x2, x3, x4, 3 more");
    }
}
