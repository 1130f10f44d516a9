//! A task that starts where another run of it ended.

use isochrone_engine::orders::{AtEnd, Inbox, Order, SlotForce, Store, Work};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use isochrone_testing::graphs::{INPUTS, configuration, entries, entry_choice};
use proptest::prelude::*;

use crate::findings::plan;
use crate::one_task::{TASK, blocks, frame, output};

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
fn an_alarm_whose_signals_have_other_types_goes_on() {
    let of = |value_type: &str| {
        let x = format!("[[variable]]\nname = \"x\"\ntype = \"{value_type}\"\ninitial = 2\n");
        let alarm = "[[alarm]]\nname = \"high\"\nwhen = \"x > 1 AND x < 9\"\nfor = \"1h\"\n";
        plan(&format!("{TASK}{x}{alarm}{}", output(&["high.active"]))).unwrap()
    };
    let (before, after) = (of("LREAL"), of("INT"));
    let (mut old, mut new) = (engine(&before), engine(&after));
    old.step(0);
    let done = new.warm_start(&after.tasks[0], &before.tasks[0], &old.state_now());
    assert_eq!((done.alarms, done.edited.len()), (1, 0));
    assert_eq!(new.state_now().state, old.state_now().state, "its delay goes on");
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

/// What a signal of these entries is in the cycles after a restart that gives the task another period.
fn after_restart(entries: &str, signal: &str, ran: (&str, u64), goes_on: (&str, u64)) -> Vec<f64> {
    let of = |period| {
        plan(&format!("{}{entries}{}", TASK.replace("100ms", period), output(&[signal]))).unwrap()
    };
    let (before, after) = (of(ran.0), of(goes_on.0));
    let mut old = engine(&before);
    (0..ran.1).for_each(|cycle| old.step(cycle));
    let mut new = engine(&after);
    new.warm_start(&after.tasks[0], &before.tasks[0], &old.state_now());
    let value = |cycle| {
        new.step(cycle);
        frame::<1>(&new)[0]
    };
    (ran.1..ran.1 + goes_on.1).map(value).collect()
}

#[test]
fn time_that_passed_stays_as_long_as_it_was_in_a_task_with_another_period() {
    let on = "IN = true, PT = \"300ms\"";
    let [ton, tp] = ["TON", "TP"].map(|of| blocks("x", 1, of, on));
    // A signal that goes off in cycle 2 of 10 ms.
    let off = blocks("pulse", 1, "TP", "IN = true, PT = \"20ms\"");
    let tof = format!("{off}{}", blocks("x", 1, "TOF", "IN = \"pulse.Q\", PT = \"300ms\""));
    let saw = |time: &str| {
        let pins = format!("timeRange = \"{time}\", incrementRange = 1, numberSteps = 9");
        blocks("x", 1, "SawTooth", &pins)
    };
    let cycles = blocks("cycles", 1, "SawTooth", "incrementRange = 1, endlessSteps = true");
    let delayed = blocks("x", 1, "DeadTime", "u = \"cycles.value\", deadTime = 0.2");
    let delayed = format!("{cycles}{delayed}");
    let pins = "enable = true, cyclicExecution = true, value = \"cycles.value\"";
    let slope = format!("{cycles}{}", blocks("x", 1, "DifferenceQuotientFB", pins));
    let wave = blocks("x", 1, "TriangleCI", "periode = \"1s\"");
    let (short, long) = (("10ms", 10), "100ms");
    for (entries, signal, ran, period, expected) in [
        (&ton, "x.ET", short, long, &[190.0, 290.0, 300.0, 300.0][..]),
        (&ton, "x.Q", short, long, &[0.0, 0.0, 1.0, 1.0]),
        (&ton, "x.ET", (long, 4), "7ms", &[300.0, 300.0]),
        (&ton, "x.ET", (long, 3), "7ms", &[207.0, 214.0, 221.0]),
        (&tp, "x.ET", short, long, &[190.0, 290.0, 300.0, 300.0]),
        (&tp, "x.Q", short, long, &[1.0, 1.0, 0.0, 0.0]),
        (&tof, "x.ET", short, long, &[170.0, 270.0, 300.0, 300.0]),
        (&tof, "x.Q", short, long, &[1.0, 1.0, 0.0, 0.0]),
        // 190 ms, 290 ms, …
        (&saw("200ms"), "x.value", short, long, &[0.0, 1.0, 1.0, 2.0, 2.0, 3.0]),
        (&saw("25ms"), "x.value", (long, 2), "10ms", &[4.0, 4.0, 5.0, 5.0, 6.0, 6.0, 6.0, 7.0]),
        (&saw("0ms"), "x.value", (long, 9), "10ms", &[9.0, 0.0, 1.0]),
        (&wave, "x.value", short, long, &[0.76, 0.84, 0.44]),
        (&delayed, "x.y", ("10ms", 30), long, &[9.0, 9.0, 30.0, 31.0]),
        (&slope, "x.derivatedValue", ("10ms", 30), long, &[0.0, 0.0, 0.0, 0.0, 10.0, 10.0]),
    ] {
        let values = after_restart(entries, signal, ran, (period, expected.len() as u64));
        assert_eq!(values, expected, "{signal} after {ran:?} in {period}: {entries}");
    }
}
