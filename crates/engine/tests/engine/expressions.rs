//! What an `Expr` computes, holds and hands on.

use isochrone_engine::{Flags, TaskEngine};

use crate::findings::plan;
use crate::one_task::{TASK, engine, frame, output};
use crate::two_tasks::{engines_with, input};

/// The entries of inputs `x` and `y`, an Expr `e` with this `out`, and a frame of these signals.
fn entries(out: &str, signals: &[&str]) -> String {
    ["x", "y"].map(|name| format!("[[input]]\nname = \"{name}\"\n")).concat()
        + &format!("[[block]]\nname = \"e\"\ntype = \"Expr\"\nout = {out}\n")
        + &output(signals)
}

/// One cycle with these samples.
fn step<const SIGNALS: usize>(
    engine: &mut TaskEngine,
    x: f64,
    y: f64,
    cycle: u64,
) -> [f64; SIGNALS] {
    engine.set_input(0, x, 1);
    engine.set_input(1, y, 1);
    engine.step(cycle);
    frame(engine)
}

#[test]
fn outputs_are_computed_from_the_signals_of_the_same_cycle_in_the_order_of_the_file() {
    let out = r#"{ z = "x - y", a = "x > y", m = "MAX(x, y, 2.0 * x)" }"#;
    let mut engine = engine(&entries(out, &["e.z", "e.a", "e.m", "e.status"]));
    assert_eq!(step(&mut engine, 3.0, 1.0, 0), [2.0, 1.0, 6.0, 0.0]);
    assert_eq!(step(&mut engine, -3.0, 1.0, 1), [-4.0, 0.0, 1.0, 0.0]);
}

#[test]
fn an_error_holds_its_output_with_the_status_of_the_first_output_that_has_one() {
    let out = r#"{ sum = "x + y", quotient = "x / y", root = "SQRT(x)" }"#;
    let mut engine = engine(&entries(out, &["e.sum", "e.quotient", "e.root", "e.status"]));
    assert_eq!(step(&mut engine, -4.0, 0.0, 0), [-4.0, 0.0, 0.0, f64::from(0x8210)]);
    assert_eq!(engine.block_errors(), 1);
    assert_eq!(step(&mut engine, 4.0, 2.0, 1), [6.0, 2.0, 2.0, 0.0]);
    assert_eq!(step(&mut engine, -4.0, 2.0, 2), [-2.0, -2.0, 2.0, f64::from(0x8211)]);
    assert_eq!(step(&mut engine, 9.0, 0.0, 3), [9.0, -2.0, 3.0, f64::from(0x8210)]);
    assert_eq!(engine.block_errors(), 3);
}

#[test]
fn an_error_is_said_of_what_is_computed_from_the_expression() {
    let (mut fast, _) = engines_with(
        &(input("x", "fast")
            + "[[block]]\nname = \"e\"\ntask = \"fast\"\ntype = \"Expr\"\nout = { y = \"1.0 / x\" }\n"
            + &crate::two_tasks::output("fast", &["e.y"])
            + &crate::two_tasks::output("fast", &["x"])),
    );
    let mut flags = |x, cycle| {
        fast.set_input(0, x, 7);
        fast.step(cycle);
        [0, 1].map(|output| fast.output_flags(output))
    };
    assert_eq!(flags(2.0, 0), [Flags::NONE; 2]);
    assert_eq!(flags(0.0, 1), [Flags::ERROR, Flags::NONE]);
    assert_eq!(flags(2.0, 2), [Flags::NONE; 2]);
}

#[test]
fn the_doubt_of_a_sample_goes_through_an_expression() {
    let (mut fast, _) = engines_with(
        &(input("x", "fast")
            + "[[block]]\nname = \"e\"\ntask = \"fast\"\ntype = \"Expr\"\nout = { y = \"x + 1.0\", ok = \"x.ok\" }\n"
            + &crate::two_tasks::output("fast", &["e.y", "e.ok"])),
    );
    fast.step(0);
    assert_eq!(fast.output_flags(0), Flags::SUBSTITUTE);
    fast.set_input(0, 1.0, 7);
    fast.step(1);
    assert_eq!((fast.output_flags(0), fast.output_source_ns(0)), (Flags::NONE, 7));
}

#[test]
fn an_expression_accumulates_and_latches_by_its_own_value_of_the_cycle_before() {
    let out = r#"{ sum = '"e.sum@prev" + x', latch = '("e.latch@prev" OR x > 2.0) AND y = 0.0' }"#;
    let mut engine = engine(&entries(out, &["e.sum", "e.latch"]));
    let steps = [(1.0, 0.0), (3.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 0.0)];
    let expected = [[1.0, 0.0], [4.0, 1.0], [5.0, 1.0], [6.0, 0.0], [7.0, 0.0]];
    for (cycle, ((x, y), expected)) in (0..).zip(steps.into_iter().zip(expected)) {
        assert_eq!(step(&mut engine, x, y, cycle), expected, "cycle {cycle}");
    }
}

#[test]
fn expressions_on_expressions_are_computed_in_one_cycle_whatever_their_order_in_the_file() {
    let expr = |name: &str, out: &str| {
        format!("[[block]]\nname = \"{name}\"\ntype = \"Expr\"\nout = {{ y = '{out}' }}\n")
    };
    let variable = "[[variable]]\nname = \"v\"\ninitial = 5.0\n";
    let text = expr("c", "b.y * 2.0") + &expr("b", "a.y + 1.0") + &expr("a", "v") + variable;
    let mut engine = engine(&(text + &output(&["a.y", "b.y", "c.y"])));
    engine.step(0);
    assert_eq!(frame(&engine), [5.0, 6.0, 12.0]);
}

#[test]
fn an_expression_reads_another_tasks_value_of_its_last_finished_cycle() {
    let (mut fast, mut slow) = engines_with(
        &("[[block]]\nname = \"n\"\ntask = \"fast\"\ntype = \"Expr\"\nout = { y = '\"n.y@prev\" + 1.0' }\n".to_owned()
            + "[[block]]\nname = \"m\"\ntask = \"slow\"\ntype = \"Expr\"\nout = { y = 'n.y * 10.0' }\n"
            + &crate::two_tasks::output("slow", &["m.y"])),
    );
    fast.step(0);
    fast.step(1);
    slow.step(0);
    assert_eq!(frame(&slow), [20.0]);
}

#[test]
fn instances_of_one_expression_step_in_one_bank_and_equal_expressions_of_two_blocks_too() {
    let expr = |name: &str, count: usize| {
        format!(
            "[[block]]\nname = \"{name}\"\ncount = {count}\ntype = \"Expr\"\nout = {{ y = \"v * 2.0\" }}\n"
        )
    };
    let variable = "[[variable]]\nname = \"v\"\ninitial = 5.0\n";
    let text = TASK.to_owned() + variable + &expr("a", 3) + &expr("b", 2);
    let plan = plan(&text).unwrap();
    assert_eq!(plan.tasks[0].banks.len(), 1);
    assert_eq!(plan.instances(), 5);
}

/// A task with this Expr that sends `e.sum`, and one signal more.
fn sum(out: &str, signal: &str) -> isochrone_engine::Plan {
    plan(&format!("{TASK}{}", entries(out, &["e.sum", signal]))).unwrap()
}

#[test]
fn a_restart_with_other_expressions_goes_on_with_the_outputs_of_the_same_name_and_type() {
    let old = sum(r#"{ sum = '"e.sum@prev" + x', gone = "y" }"#, "e.gone");
    let mut ended = TaskEngine::build(&old).unwrap().remove(0);
    for cycle in 0..3 {
        step::<2>(&mut ended, 2.0, 1.0, cycle);
    }
    let other = sum(r#"{ new = "y > 0.0", sum = '"e.sum@prev" + 10.0 * x + y' }"#, "e.new");
    let mut engine = TaskEngine::build(&other).unwrap().remove(0);
    let done = engine.warm_start(&other.tasks[0], &old.tasks[0], &ended.state_now());
    assert_eq!((done.blocks, done.unmatched.len()), (1, 0));
    assert_eq!(step(&mut engine, 2.0, 1.0, 3), [27.0, 1.0]);
    let retyped = sum(r#"{ sum = '"e.sum@prev" OR x > 0.0', b = "x" }"#, "e.b");
    let mut engine = TaskEngine::build(&retyped).unwrap().remove(0);
    engine.warm_start(&retyped.tasks[0], &old.tasks[0], &ended.state_now());
    assert_eq!(step(&mut engine, 0.0, 1.0, 3), [0.0, 0.0], "6.0 is no BOOL");
}

#[test]
fn the_last_good_value_is_held_over_a_restart() {
    let plan = sum(r#"{ sum = "x / y" }"#, "e.status");
    let mut ended = TaskEngine::build(&plan).unwrap().remove(0);
    assert_eq!(step(&mut ended, 6.0, 2.0, 0), [3.0, 0.0]);
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    engine.warm_start(&plan.tasks[0], &plan.tasks[0], &ended.state_now());
    assert_eq!(step(&mut engine, 6.0, 0.0, 1), [3.0, f64::from(0x8210)]);
}
