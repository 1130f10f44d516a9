//! A task that starts where another run of it ended.

use isochrone_engine::orders::{AtEnd, Inbox, Order, SlotForce, Store, Work};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use isochrone_testing::graphs::{INPUTS, configuration, entries, entry_choice};
use proptest::prelude::*;

use crate::findings::plan;
use crate::one_task::{TASK, blocks, output};

fn engine(plan: &Plan) -> TaskEngine {
    TaskEngine::build(plan).unwrap().remove(0)
}

/// The engines of a plan, started where `ended` are.
fn restarted(plan: &Plan, ended: &[TaskEngine]) -> Vec<TaskEngine> {
    let mut engines = TaskEngine::build(plan).unwrap();
    for ((engine, ended), task) in engines.iter_mut().zip(ended).zip(&plan.tasks) {
        let done = engine.warm_start(task, task, &ended.state_now());
        assert!(done.unmatched.is_empty());
    }
    engines
}

fn sent(engine: &TaskEngine) -> Vec<u64> {
    let mut frame = [f64::NAN; 512];
    engine.read_output(0, &mut frame);
    frame.iter().map(|value| value.to_bits()).collect()
}

proptest! {
    #[test]
    fn outputs_go_on_with_exactly_the_next_value(
        choices in prop::collection::vec(entry_choice(), 1..12),
        steps in prop::collection::vec((0usize..2, 0..INPUTS.len(), -20i8..20, any::<bool>()), 1..40),
    ) {
        let text = configuration(&entries(choices));
        let plan = Plan::new(Source::new("random.toml", text.as_str()), &Rules::default()).unwrap();
        let mut unbroken = TaskEngine::build(&plan).unwrap();
        let mut broken = TaskEngine::build(&plan).unwrap();
        let mut cycles = [0; 2];
        for (task, input, sample, is_break) in steps {
            if is_break {
                broken = restarted(&plan, &broken);
            }
            let (_, _, reader, _) = INPUTS[input];
            let own = INPUTS[..input].iter().filter(|(_, _, task, _)| *task == reader).count();
            for engines in [&mut unbroken, &mut broken] {
                // A state is one between two cycles.
                if reader == task {
                    engines[reader].set_input(own, f64::from(sample), 1);
                }
                engines[task].step(cycles[task]);
            }
            cycles[task] += 1;
            prop_assert!(sent(&unbroken[task]) == sent(&broken[task]), "{}", text);
        }
    }
}

#[test]
fn blocks_that_are_not_in_both_or_of_another_type_begin_anew_and_are_named() {
    let saw = |name: &str| blocks(name, 1, "SawTooth", "");
    let ramp =
        |name: &str| blocks(name, 1, "LimRateOfChangeCI", "value = 9.0, setChangeRate = 10.0");
    let before = plan(&format!("{TASK}{}{}{}", ramp("stays"), ramp("goes"), saw("turns"))).unwrap();
    let entries = [&ramp("comes"), &ramp("turns"), &ramp("stays")].map(String::as_str).concat();
    let signals = output(&["stays.delayedValue", "comes.delayedValue", "turns.delayedValue"]);
    let after = plan(&format!("{TASK}{entries}{signals}")).unwrap();
    let mut old = engine(&before);
    (0..3).for_each(|cycle| old.step(cycle));
    let mut new = engine(&after);
    let done = new.warm_start(&after.tasks[0], &before.tasks[0], &old.state_now());
    let unmatched = ["goes", "turns"].map(str::to_owned).to_vec();
    assert_eq!((done.blocks, done.inputs, done.unmatched), (1, vec![], unmatched));
    assert_eq!(done.first_cycle, 3);
    new.step(3);
    let mut frame = [0.0; 3];
    new.read_output(0, &mut frame);
    assert_eq!(frame, [4.0, 1.0, 1.0]);
}

#[test]
fn an_alarm_goes_on_only_where_its_definition_is_the_same() {
    let of = |definition: &str| {
        let signals = output(&["high.active"]);
        let alarm = format!("[[alarm]]\nname = \"high\"\n{definition}\n");
        plan(&format!("{TASK}[[variable]]\nname = \"x\"\ninitial = 2.0\n{alarm}{signals}")).unwrap()
    };
    let before = of("when = \"x > 1.0\"\nhysteresis = 0.5");
    let mut old = engine(&before);
    old.step(0);
    for (definition, goes_on) in [
        ("when = \"x > 1.0\"\nhysteresis = 0.5\ntext = \"Too high\"", true),
        ("when = \"x > 3.0\"\nhysteresis = 0.5", false),
        ("when = \"x > 1.0\"\nhysteresis = 0.5\nfor = \"1s\"", false),
        ("when = \"x > 1.0\"\nhysteresis = 0.25", false),
    ] {
        let after = of(definition);
        let mut new = engine(&after);
        let done = new.warm_start(&after.tasks[0], &before.tasks[0], &old.state_now());
        assert_eq!((done.blocks, done.alarms), (0, usize::from(goes_on)), "{definition}");
        assert_eq!(done.edited.contains(&"high".to_owned()), !goes_on, "{definition}");
        assert!(done.unmatched.is_empty(), "{definition}: {:?}", done.unmatched);
        let mut frame = [f64::NAN];
        new.read_output(0, &mut frame);
        assert_eq!(frame, [f64::from(u8::from(goes_on))], "{definition}");
    }
}

#[test]
fn an_input_begins_with_its_last_value_which_is_not_ok() {
    let node = plan(&format!("{TASK}[[input]]\nname = \"x\"\n{}", output(&["x", "x.ok"]))).unwrap();
    let mut old = engine(&node);
    old.set_input(0, 7.0, 1);
    old.step(0);
    let mut new = engine(&node);
    let done = new.warm_start(&node.tasks[0], &node.tasks[0], &old.state_now());
    assert_eq!((done.blocks, done.inputs, done.unmatched), (0, vec![(0, 7.0)], vec![]));
    let mut frame = [f64::NAN; 2];
    new.read_output(0, &mut frame);
    assert_eq!(frame, [7.0, 0.0]);
}

#[test]
fn the_state_has_the_value_beneath_a_force() {
    let node = plan(&format!("{TASK}[[input]]\nname = \"x\"\n{}", output(&["x"]))).unwrap();
    let mut old = engine(&node);
    old.set_input(0, 7.0, 1);
    let stores = [Store::new(0, 9.0)].into();
    let forces = [SlotForce::new(0, AtEnd::Restore, [].into())].into();
    let mut inbox = Inbox::new(8);
    inbox.take(Order::new(None, Work::Force { stores, forces, cycles: None })).unwrap();
    inbox.apply(&mut old, 0, 0, drop);
    old.step(0);
    assert_eq!((old.image()[0], old.state_now().image[0]), (9.0, 7.0));
}
