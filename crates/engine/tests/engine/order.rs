//! In what order blocks step, and where they stand in the image.

use crate::findings::plan as plan_of;
use crate::one_task::{TASK, blocks, engine, frame, output, ramp};
use isochrone_engine::Plan;
use isochrone_engine::config::Cpu;

fn plan(entries: &str) -> Plan {
    plan_of(&format!("{TASK}{entries}")).unwrap()
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
    let entries = ramp("last", "\"middle.delayedValue\"")
        + &ramp("first", "7.0")
        + &ramp("middle", "\"first.delayedValue\"")
        + &output(&["last.delayedValue"]);
    let expected = [(0, vec!["first"]), (1, vec!["middle"]), (2, vec!["last"])];
    assert_eq!(banks(&plan(&entries)), expected);
    let mut engine = engine(&entries);
    engine.step(0);
    assert_eq!(frame(&engine), [7.0], "a value goes through all blocks in one cycle");
}

#[test]
fn blocks_of_equal_depth_step_in_file_order() {
    let entries = ramp("c", "1.0")
        + &ramp("a", "1.0")
        + &blocks("saw", 1, "SawTooth", "")
        + &ramp("b", "1.0");
    assert_eq!(banks(&plan(&entries)), [(0, vec!["c", "a", "b"]), (0, vec!["saw"])]);
}

#[test]
fn the_depth_of_a_block_is_the_longest_path_that_leads_to_it_in_any_order_of_the_file() {
    let reader = blocks(
        "c",
        1,
        "LimRateOfChangeCI",
        "value = \"b.delayedValue\", defaultOutValue = \"a.delayedValue\", setChangeRate = \"s.delayedValue\"",
    );
    let chain = ramp("a", "1.0") + &ramp("b", "\"a.delayedValue\"");
    for entries in [
        ramp("s", "2.0") + &chain + &reader,
        chain.clone() + &ramp("s", "2.0") + &reader,
        reader.clone() + &chain + &ramp("s", "2.0"),
    ] {
        assert_eq!(banks(&plan(&entries))[1..], [(1, vec!["b"]), (2, vec!["c"])]);
    }
}

#[test]
fn a_value_of_the_cycle_before_orders_nothing() {
    let entries = ramp("a", "\"b.delayedValue@prev\"") + &ramp("b", "1.0");
    assert_eq!(banks(&plan(&entries)), [(0, vec!["a", "b"])]);
}

#[test]
fn the_instances_of_a_count_are_a_bank_and_i_is_the_readers_number() {
    let two = |name, value: &str| {
        blocks(name, 2, "LimRateOfChangeCI", &format!("value = {value}, setChangeRate = inf"))
    };
    let entries = "[[input]]\nname = \"x0\"\n[[input]]\nname = \"x1\"\n".to_string()
        + &two("a", "\"x{i}\"")
        + &two("b", "\"a.{i}.delayedValue\"")
        + &output(&["b.0.delayedValue", "b.1.delayedValue"]);
    let expected = [(0, vec!["a.0", "a.1"]), (1, vec!["b.0", "b.1"])];
    assert_eq!(banks(&plan(&entries)), expected);
    let mut engine = engine(&entries);
    assert!(engine.set_input(0, 4.0, 1) && engine.set_input(1, 5.0, 1));
    engine.step(0);
    assert_eq!(frame(&engine), [4.0, 5.0]);
}

#[test]
fn a_count_of_1_is_a_block_like_any_other_and_answers_to_its_number() {
    let signals = output(&["a.delayedValue", "a.0.delayedValue"]);
    let plan = plan(&(blocks("a", 1, "LimRateOfChangeCI", "") + &signals));
    let signals = &plan.tasks[0].outputs[0].signals;
    assert_eq!(signals[0].slot, signals[1].slot);
    assert_eq!(banks(&plan), [(0, vec!["a"])]);
}

#[test]
fn instances_own_consecutive_slots_inputs_then_outputs_and_every_slot_has_a_name() {
    let input = "[[input]]\nname = \"x\"\ndefault = 3.0\n".to_string();
    let plan = plan(&(input + &blocks("saw", 300, "SawTooth", "startValue = 5, timeRange = 20")));
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
    use isochrone_model::{Margin, Overrun, Wake};
    let plan = plan("[[input]]\nname = \"x\"\n");
    let task = &plan.tasks[0];
    let settings = &task.settings;
    assert_eq!(
        (settings.ob, settings.phase_ns, settings.priority, settings.cpu),
        (None, 0, None, Cpu::Any)
    );
    assert_eq!((settings.wake, settings.overrun), (Wake::Sleep, Overrun::Skip));
    let input = &task.inputs[0];
    assert_eq!(input.binding, Binding::Channel(0));
    assert_eq!((input.value_type, input.default), (isochrone_blocks::PinType::Lreal, 0.0));
    assert_eq!((&input.service, input.max_age_ns, input.on_stale), (&None, None, OnStale::Hold));
    let prior = plan_of(&format!("{TASK}priority = 1\n")).unwrap();
    assert_eq!(prior.tasks[0].settings.wake, Wake::Hybrid(Margin::DEFAULT));
}
