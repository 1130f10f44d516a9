//! Loops of blocks, and the wire that breaks one.

use isochrone_engine::Problem::Loop;
use isochrone_engine::TaskEngine;

use crate::findings::{assert_one, findings, plan};

const HEAD: &str = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"100ms\"\n";
const HELP: &str = "one wire of a loop must say \"block.pin@prev\"";

/// A ramp for each pair of a name and the wire into it.
fn ramps(wires: &[(&str, &str)]) -> String {
    let ramp = |(name, wire): &(&str, &str)| {
        let (mark, wire) = wire.strip_prefix('«').map_or(("", *wire), |wire| ("«", wire));
        format!(
            "[[block]]\nname = \"{name}\"\ntype = \"LimRateOfChangeCI\"\nin.value = {mark}\"{wire}\"\nin.setChangeRate = 10.0\n"
        )
    };
    HEAD.to_string() + &wires.iter().map(ramp).collect::<String>()
}

#[test]
fn a_block_that_reads_itself_is_a_loop() {
    let text = ramps(&[("a", "«a.delayedValue")]);
    assert_one("self", &text, Loop, "loop: a -> a", HELP);
}

#[test]
fn two_blocks_that_read_each_other_are_a_loop() {
    let text = ramps(&[("a", "«b.delayedValue"), ("b", "a.delayedValue")]);
    assert_one("two", &text, Loop, "loop: a -> b -> a", HELP);
}

#[test]
fn a_loop_names_its_blocks_and_not_those_before_and_behind() {
    let text = ramps(&[
        ("behind", "b.delayedValue"),
        ("a", "c.delayedValue"),
        ("b", "«a.delayedValue"),
        ("c", "b.delayedValue"),
    ]);
    let found = findings(&text);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_one("three", &text, Loop, "loop: b -> c -> a -> b", HELP);
}

#[test]
fn a_loop_of_many_blocks_is_found_in_reasonable_time() {
    const BLOCKS: usize = 5_000;
    let names: Vec<String> = (0..BLOCKS).map(|i| format!("b{i}")).collect();
    let wires: Vec<String> =
        (0..BLOCKS).map(|i| format!("b{}.delayedValue", (i + 1) % BLOCKS)).collect();
    let pairs: Vec<_> = names.iter().zip(&wires).map(|(n, w)| (n.as_str(), w.as_str())).collect();
    let found = findings(&ramps(&pairs));
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].message.matches("->").count(), BLOCKS);
}

#[test]
fn disjoint_loops_are_each_named_once() {
    let text = ramps(&[
        ("a", "b.delayedValue"),
        ("b", "a.delayedValue"),
        ("c", "d.delayedValue"),
        ("d", "c.delayedValue"),
        ("e", "c.delayedValue"),
    ]);
    let messages: Vec<String> = findings(&text).into_iter().map(|found| found.message).collect();
    assert_eq!(messages, ["loop: a -> b -> a", "loop: c -> d -> c"]);
}

#[test]
fn a_loop_in_every_instance_of_a_block_is_named_once() {
    let text = format!(
        "{HEAD}[[block]]\nname = \"a\"\ncount = 1000\ntype = \"LimRateOfChangeCI\"\nin.value = «\"a.{{i}}.delayedValue\"\n"
    );
    assert_one("self", &text, Loop, "loop: a.0 -> a.0", HELP);
    let text = text.replace("a.{i}", "b.{i}").replace('«', "")
        + "[[block]]\nname = \"b\"\ncount = 1000\ntype = \"LimRateOfChangeCI\"\nin.value = \"a.{i}.delayedValue\"\n";
    let messages: Vec<String> = findings(&text).into_iter().map(|found| found.message).collect();
    assert_eq!(messages, ["loop: a.0 -> b.0 -> a.0"]);
}

#[test]
fn a_loop_within_one_count_is_found() {
    let text = format!(
        "{HEAD}[[block]]\nname = \"a\"\ncount = 3\ntype = \"LimRateOfChangeCI\"\nin.value = «\"a.2.delayedValue\"\n"
    );
    assert_one("last", &text, Loop, "loop: a.2 -> a.2", HELP);
}

#[test]
fn a_loop_between_tasks_is_none() {
    let text = ramps(&[("a", "b.delayedValue"), ("b", "a.delayedValue")])
        .replace("name = \"a\"", "name = \"a\"\ntask = \"t\"")
        .replace("name = \"b\"", "name = \"b\"\ntask = \"u\"")
        + "[[task]]\nname = \"u\"\nperiod = \"1ms\"\n";
    assert!(plan(&text).is_ok());
}

#[test]
fn a_wire_of_the_cycle_before_breaks_the_loop_and_carries_that_value() {
    let text = format!(
        "{HEAD}\
         [[block]]\nname = \"a\"\ntype = \"LimRateOfChangeCI\"\n\
         in = {{ value = \"b.y@prev\", setChangeRate = inf }}\n\
         [[block]]\nname = \"b\"\ntype = \"ScaleLinear\"\n\
         in = {{ x = \"a.delayedValue\", x1 = 0.0, y1 = 1.0, x2 = 1.0, y2 = 3.0, yMin = -inf, yMax = inf }}\n\
         [[output]]\nservice = \"s\"\nsignals = [\"a.delayedValue\", \"b.y\"]\n"
    );
    let plan = plan(&text).unwrap();
    assert_eq!(plan.tasks[0].previous.len(), 1);
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    let mut frames = Vec::new();
    for cycle in 0..4 {
        engine.step(cycle);
        let mut frame = [0.0; 2];
        engine.read_output(0, &mut frame);
        frames.push(frame);
    }
    // b = 2 a + 1, and a is the b of the cycle before.
    assert_eq!(frames, [[0.0, 1.0], [1.0, 3.0], [3.0, 7.0], [7.0, 15.0]]);
}

#[test]
fn a_block_may_read_its_own_output_of_the_cycle_before() {
    let text = ramps(&[("a", "a.delayedValue@prev")]);
    assert!(plan(&text).is_ok());
}

#[test]
fn the_cycle_before_is_the_one_before_in_a_chain_too() {
    // Both read a pin of the cycle before, in either order of the file.
    let scale = |name: &str, x: &str| {
        format!(
            "[[block]]\nname = \"{name}\"\ntype = \"ScaleLinear\"\nin = {{ x = {x}, x1 = 0.0, y1 = 1.0, x2 = 1.0, y2 = 2.0, yMin = -inf, yMax = inf }}\n"
        )
    };
    let text = HEAD.to_string()
        + &scale("counter", "\"counter.y@prev\"")
        + &scale("one_later", "\"counter.y@prev\"")
        + &scale("two_later", "\"one_later.y@prev\"")
        + "[[output]]\nservice = \"s\"\nsignals = [\"counter.y\", \"one_later.y\", \"two_later.y\"]\n";
    let plan = plan(&text).unwrap();
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    let mut frame = [0.0; 3];
    for cycle in 0..5 {
        engine.step(cycle);
        engine.read_output(0, &mut frame);
    }
    // counter is n; the others add 1 to what they read.
    assert_eq!(frame, [5.0, 4.0 + 1.0, (3.0 + 1.0) + 1.0]);
}
