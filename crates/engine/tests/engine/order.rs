//! In what order blocks step, and where they stand in the image.

use crate::findings;
use crate::findings::plan;
use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, TaskEngine};

const HEAD: &str = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"100ms\"\n";

/// A block entry: name, count, type and pins.
fn block(name: &str, count: usize, block_type: &str, pins: &str) -> String {
    format!(
        "[[block]]\nname = \"{name}\"\ncount = {count}\ntype = \"{block_type}\"\nin = {{ {pins} }}\n"
    )
}

fn ramp(name: &str, value: &str) -> String {
    block(name, 1, "LimRateOfChangeCI", &format!("value = {value}, setChangeRate = inf"))
}

/// Depth and instances of the banks of the first task.
fn banks(plan: &Plan) -> Vec<(usize, Vec<&str>)> {
    plan.tasks[0]
        .banks
        .iter()
        .map(|bank| (bank.depth, bank.instances.iter().map(String::as_str).collect()))
        .collect()
}

#[test]
fn blocks_step_in_the_order_of_their_wires_whatever_the_order_of_the_file() {
    let text = HEAD.to_string()
        + &ramp("last", "\"middle.delayedValue\"")
        + &ramp("first", "7.0")
        + &ramp("middle", "\"first.delayedValue\"")
        + "[[output]]\nservice = \"s\"\nsignals = [\"last.delayedValue\"]\n";
    let plan = plan(&text).unwrap();
    let expected = [(0, vec!["first"]), (1, vec!["middle"]), (2, vec!["last"])];
    assert_eq!(banks(&plan), expected);
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    engine.step(0);
    let mut frame = [0.0];
    engine.read_output(0, &mut frame);
    assert_eq!(frame, [7.0], "a value goes through all blocks in one cycle");
}

#[test]
fn blocks_of_equal_depth_step_in_file_order() {
    let text = HEAD.to_string()
        + &ramp("c", "1.0")
        + &ramp("a", "1.0")
        + &block("saw", 1, "SawTooth", "")
        + &ramp("b", "1.0");
    assert_eq!(banks(&plan(&text).unwrap()), [(0, vec!["c", "a", "b"]), (0, vec!["saw"])]);
}

#[test]
fn the_depth_of_a_block_is_the_longest_path_that_leads_to_it_in_any_order_of_the_file() {
    let reader = block(
        "c",
        1,
        "LimRateOfChangeCI",
        "value = \"b.delayedValue\", defaultOutValue = \"a.delayedValue\", setChangeRate = \"s.delayedValue\"",
    );
    let chain = ramp("a", "1.0") + &ramp("b", "\"a.delayedValue\"");
    for blocks in [
        ramp("s", "2.0") + &chain + &reader,
        chain.clone() + &ramp("s", "2.0") + &reader,
        reader.clone() + &chain + &ramp("s", "2.0"),
    ] {
        let plan = plan(&(HEAD.to_string() + &blocks)).unwrap();
        assert_eq!(banks(&plan)[1..], [(1, vec!["b"]), (2, vec!["c"])]);
    }
}

#[test]
fn a_value_of_the_cycle_before_orders_nothing() {
    let text = HEAD.to_string() + &ramp("a", "\"b.delayedValue@prev\"") + &ramp("b", "1.0");
    assert_eq!(banks(&plan(&text).unwrap()), [(0, vec!["a", "b"])]);
}

#[test]
fn the_instances_of_a_count_are_a_bank_and_i_is_the_readers_number() {
    let text = HEAD.to_string()
        + "[[input]]\nname = \"x0\"\n[[input]]\nname = \"x1\"\n"
        + &block("a", 2, "LimRateOfChangeCI", "value = \"x{i}\", setChangeRate = inf")
        + &block(
            "b",
            2,
            "LimRateOfChangeCI",
            "value = \"a.{i}.delayedValue\", setChangeRate = inf",
        )
        + "[[output]]\nservice = \"s\"\nsignals = [\"b.0.delayedValue\", \"b.1.delayedValue\"]\n";
    let plan = plan(&text).unwrap();
    assert_eq!(banks(&plan), [(0, vec!["a.0", "a.1"]), (1, vec!["b.0", "b.1"])]);
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    assert!(engine.set_input(0, 4.0, 1) && engine.set_input(1, 5.0, 1));
    engine.step(0);
    let mut frame = [0.0; 2];
    engine.read_output(0, &mut frame);
    assert_eq!(frame, [4.0, 5.0]);
}

#[test]
fn a_count_of_1_is_a_block_like_any_other_and_answers_to_its_number() {
    let text = HEAD.to_string()
        + &block("a", 1, "LimRateOfChangeCI", "")
        + "[[output]]\nservice = \"s\"\nsignals = [\"a.delayedValue\", \"a.0.delayedValue\"]\n";
    let plan = plan(&text).unwrap();
    let signals = &plan.tasks[0].outputs[0].signals;
    assert_eq!(signals[0].slot, signals[1].slot);
    assert_eq!(banks(&plan), [(0, vec!["a"])]);
}

#[test]
fn instances_own_consecutive_slots_inputs_then_outputs_and_every_slot_has_a_name() {
    let text = HEAD.to_string()
        + "[[input]]\nname = \"x\"\ndefault = 3.0\n"
        + &block("saw", 300, "SawTooth", "startValue = 5, timeRange = 20");
    let plan = plan(&text).unwrap();
    let task = &plan.tasks[0];
    assert_eq!((task.image.len(), task.image[0]), (3 + 300 * 7, 3.0));
    assert_eq!(task.banks.iter().map(|bank| bank.instances.len()).sum::<usize>(), 300);
    assert_eq!([0, 1, 2].map(|slot| plan.slot_name(0, slot)), ["x", "x.ok", "x.age"]);
    assert_eq!(task.image[1..3], [0.0, f64::INFINITY]);
    let pins = [
        "startValue",
        "timeRange",
        "incrementRange",
        "numberSteps",
        "endlessSteps",
        "reset",
        "value",
    ];
    for instance in 0..300 {
        for (offset, pin) in pins.iter().enumerate() {
            let slot = 3 + instance * 7 + offset;
            assert_eq!(plan.slot_name(0, slot), format!("saw.{instance}.{pin}"));
        }
        let slots = &task.image[3 + instance * 7..][..7];
        assert_eq!(slots, [5.0, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
    assert_eq!(plan.slot_name(0, task.image.len()), "");
    assert_eq!(
        (plan.slot_name(1, 0), plan.task_index("t"), plan.task_index("u")),
        (String::new(), Some(0), None)
    );
}

#[test]
fn keys_that_are_left_out_have_the_documented_values() {
    use isochrone_engine::config::{Binding, OnStale};
    use isochrone_schedule::{Margin, Overrun, Wake};
    let plan = plan(&(HEAD.to_string() + "[[input]]\nname = \"x\"\n")).unwrap();
    let task = &plan.tasks[0];
    assert_eq!(
        (task.ob, task.schedule.phase_ns, task.priority, task.cpu),
        (None, 0, None, Cpu::Any)
    );
    assert_eq!((task.schedule.wake, task.schedule.overrun), (Wake::Sleep, Overrun::Skip));
    let input = &task.inputs[0];
    assert_eq!(input.binding, Binding::Channel(0));
    assert_eq!((input.value_type, input.default), (isochrone_blocks::PinType::Lreal, 0.0));
    assert_eq!((&input.service, input.max_age_ns, input.on_stale), (&None, None, OnStale::Hold));
    let fast = HEAD.replace("100ms\"", "100ms\"\npriority = 1");
    assert_eq!(
        findings::plan(&fast).unwrap().tasks[0].schedule.wake,
        Wake::Hybrid(Margin::DEFAULT)
    );
}
