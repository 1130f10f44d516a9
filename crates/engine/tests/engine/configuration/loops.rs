//! Loops of blocks, and the wire that breaks one.

use isochrone_engine::Problem::Loop;

use crate::findings::{assert_one, findings, plan};
use crate::one_task::{TASK, blocks, engine, frame, line, output, ramp};

const HELP: &str = "one wire of a loop must say \"block.pin@prev\"";

/// A ramp for each pair of a name and the wire into it, which may have the mark.
fn ramps(wires: &[(&str, &str)]) -> String {
    let ramp = |(name, wire): &(&str, &str)| match wire.strip_prefix('«') {
        Some(wire) => ramp(name, &format!("«\"{wire}\"")),
        None => ramp(name, &format!("\"{wire}\"")),
    };
    TASK.to_string() + &wires.iter().map(ramp).collect::<String>()
}

/// What is found.
fn loops(text: &str) -> Vec<String> {
    findings(text).into_iter().map(|found| found.message).collect()
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
    assert_eq!(loops(&text), ["loop: a -> b -> a", "loop: c -> d -> c"]);
}

#[test]
fn a_loop_in_every_instance_of_a_block_is_named_once() {
    let ramps = |name, value: &str| blocks(name, 1000, "LimRateOfChangeCI", value);
    let text = TASK.to_string() + &ramps("a", "value = «\"a.{i}.delayedValue\"");
    assert_one("self", &text, Loop, "loop: a.0 -> a.0", HELP);
    let text = text.replace("a.{i}", "b.{i}").replace('«', "")
        + &ramps("b", "value = \"a.{i}.delayedValue\"");
    assert_eq!(loops(&text), ["loop: a.0 -> b.0 -> a.0"]);
}

#[test]
fn a_loop_within_one_count_is_found() {
    let ramps = blocks("a", 3, "LimRateOfChangeCI", "value = «\"a.2.delayedValue\"");
    let text = TASK.to_string() + &ramps;
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
    let entries = ramp("a", "\"b.y@prev\"")
        + &line("b", "\"a.delayedValue\"", 2)
        + &output(&["a.delayedValue", "b.y"]);
    assert_eq!(plan(&format!("{TASK}{entries}")).unwrap().tasks[0].previous.len(), 1);
    let mut engine = engine(&entries);
    let frames = [0, 1, 2, 3].map(|cycle| {
        engine.step(cycle);
        frame(&engine)
    });
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
    let mut engine = engine(
        &(line("counter", "\"counter.y@prev\"", 1)
            + &line("one_later", "\"counter.y@prev\"", 1)
            + &line("two_later", "\"one_later.y@prev\"", 1)
            + &output(&["counter.y", "one_later.y", "two_later.y"])),
    );
    (0..5).for_each(|cycle| engine.step(cycle));
    // counter is n; the others add 1 to what they read.
    assert_eq!(frame(&engine), [5.0, 4.0 + 1.0, (3.0 + 1.0) + 1.0]);
}
