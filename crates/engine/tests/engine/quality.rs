//! What an output is worth: the flags of everything that it is computed from, and of nothing else.

use crate::two_tasks::{engines_with, input, output, ramp};
use isochrone_engine::{Flags, TaskEngine};

#[test]
fn an_output_without_a_sample_at_a_source_is_a_substitute_until_the_sample_comes() {
    let (mut fast, _) = engines_with(
        &(input("x", "fast")
            + &ramp("a", "fast", 1.0, "x")
            + &output("fast", &["a.delayedValue"])
            + &output("fast", &["x"])),
    );
    fast.step(0);
    assert_eq!(
        (fast.output_flags(0), fast.output_flags(1)),
        (Flags::SUBSTITUTE, Flags::SUBSTITUTE)
    );
    fast.set_input(0, 1.0, 7);
    fast.step(1);
    assert_eq!((fast.output_flags(0), fast.output_flags(1)), (Flags::NONE, Flags::NONE));
}

#[test]
fn the_error_of_a_block_is_said_of_what_it_feeds_and_of_nothing_else() {
    let (mut fast, _) = engines_with(
        &(input("x", "fast")
            + &input("y", "fast")
            + &ramp("a", "fast", 1.0, "x").replace("type", "count = 2\ntype")
            + &ramp("b", "fast", 1.0, "y")
            + &ramp("c", "fast", 1.0, "b.delayedValue@prev")
            + &output("fast", &["a.1.delayedValue"])
            + &output("fast", &["b.delayedValue"])
            + &output("fast", &["c.delayedValue"])
            + &output("fast", &["x"])),
    );
    let mut flags = |x, y, cycle| {
        fast.set_input(0, x, 7);
        fast.set_input(1, y, 7);
        fast.step(cycle);
        [0, 1, 2, 3].map(|output| fast.output_flags(output))
    };
    let (none, error) = (Flags::NONE, Flags::ERROR);
    assert_eq!(flags(1.0, 1.0, 0), [none; 4]);
    assert_eq!(flags(-1.0, 1.0, 1), [error, none, none, none]);
    assert_eq!(flags(1.0, -1.0, 2), [none, error, error, none]);
    assert_eq!(flags(1.0, 1.0, 3), [none; 4], "no error outlives its cycle");
}

#[test]
fn flags_cross_tasks_for_each_value_on_its_own() {
    let (mut fast, mut slow) = engines_with(
        &(input("x", "fast")
            + &input("y", "fast")
            + &ramp("a", "fast", 1.0, "x")
            + &ramp("b", "fast", 1.0, "y")
            + &output("slow", &["a.delayedValue"])
            + &output("slow", &["b.delayedValue"])),
    );
    let flags = |slow: &TaskEngine| [slow.output_flags(0), slow.output_flags(1)];
    slow.step(0);
    assert_eq!(flags(&slow), [Flags::SUBSTITUTE; 2], "the producer has not finished a cycle");
    fast.set_input(0, -1.0, 7);
    fast.step(0);
    assert_eq!(flags(&slow), [Flags::SUBSTITUTE; 2], "what it finished comes with the next cycle");
    slow.step(1);
    assert_eq!(flags(&slow), [Flags::ERROR, Flags::SUBSTITUTE]);
    fast.set_input(0, 1.0, 7);
    fast.set_input(1, 1.0, 7);
    fast.step(1);
    slow.step(2);
    assert_eq!(flags(&slow), [Flags::NONE; 2]);
}

#[test]
fn an_output_that_does_not_exist_has_nothing_to_say() {
    let (fast, _) = engines_with("");
    assert_eq!(fast.output_flags(3), Flags::NONE);
}
