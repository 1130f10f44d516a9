//! Samples at the inputs, errors of blocks, and how old the sources of an output are.

use crate::findings::plan;
use crate::one_task::{TASK, blocks, engine, frame, output};
use isochrone_engine::TaskEngine;

/// An engine with an input of a type that is published as it is.
fn input(value_type: &str, default: &str) -> TaskEngine {
    let keys = format!("name = \"x\"\ntype = \"{value_type}\"\ndefault = {default}");
    engine(&format!("[[input]]\n{keys}\n{}", output(&["x"])))
}

/// The value of that input as it is published, and the time of its sample.
fn read(engine: &TaskEngine) -> (f64, u64) {
    let [value] = frame(engine);
    (value, engine.output_source_ns(0))
}

#[test]
fn an_input_reads_its_default_before_the_first_sample() {
    let mut engine = input("LREAL", "2.5");
    assert_eq!(read(&engine), (2.5, 0));
    assert!(engine.set_input(0, 7.0, 42));
    assert_eq!(read(&engine), (7.0, 42));
}

#[test]
fn a_sample_that_the_type_cannot_hold_leaves_the_last_good_value_and_its_time() {
    for (value_type, default, good, bad) in [
        ("INT", "1", [-32768.0, 32767.0], [1.5, 40000.0, -32769.0]),
        ("TIME", "1", [-2147483648.0, 2147483647.0], [0.5, 2147483648.0, -2147483649.0]),
        ("BOOL", "true", [0.0, 1.0], [2.0, -1.0, 0.5]),
    ] {
        let mut engine = input(value_type, default);
        assert_eq!(read(&engine), (1.0, 0));
        for good in good {
            assert!(engine.set_input(0, good, 5), "{value_type} {good}");
            for bad in bad.into_iter().chain([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]) {
                assert!(!engine.set_input(0, bad, 6), "{value_type} {bad}");
                assert_eq!(read(&engine), (good, 5));
            }
        }
    }
}

#[test]
fn an_lreal_takes_every_sample_and_the_block_says_what_it_means() {
    let mut engine = input("LREAL", "0.0");
    for sample in [f64::INFINITY, f64::NEG_INFINITY, -0.0, 5e-324] {
        assert!(engine.set_input(0, sample, 1));
        assert_eq!(read(&engine).0.to_bits(), sample.to_bits());
    }
    assert!(engine.set_input(0, f64::NAN, 1));
    assert!(read(&engine).0.is_nan());
}

#[test]
fn inputs_and_outputs_that_do_not_exist_are_nothing() {
    let mut engine = input("LREAL", "0.0");
    assert!(!engine.set_input(1, 1.0, 1));
    let mut frame = [-1.0; 3];
    engine.read_output(1, &mut frame);
    engine.read_output(0, &mut []);
    assert_eq!(frame, [-1.0; 3]);
    engine.read_output(0, &mut frame);
    assert_eq!(frame, [0.0, -1.0, -1.0], "no more than the output's signals is written");
    assert_eq!(engine.output_source_ns(9), 0);
}

#[test]
fn steps_of_blocks_that_report_an_error_are_counted() {
    let mut engine = engine(
        &("[[input]]\nname = \"rate\"\n".to_string()
            + &blocks("a", 3, "LimRateOfChangeCI", "setChangeRate = \"rate\"")
            + &blocks("b", 1, "SawTooth", "")),
    );
    for (cycle, (rate, errors)) in
        [(1.0, 0), (-1.0, 3), (f64::NAN, 6), (0.0, 6)].into_iter().enumerate()
    {
        engine.set_input(0, rate, 0);
        engine.step(cycle as u64);
        assert_eq!(engine.block_errors(), errors);
    }
}

/// Inputs x0 to x3; ramps a (of x0), b (of a and x1), c (of x2 and its own last value); outputs of
/// a, b, c, of b with c, and of a constant alone.
fn sources() -> TaskEngine {
    let inputs = (0..4).map(|input| format!("[[input]]\nname = \"x{input}\"\n"));
    let mut entries: String = inputs.collect();
    for (name, pins) in [
        ("a", "value = \"x0\""),
        ("b", "value = \"a.delayedValue\", setChangeRate = \"x1\""),
        ("c", "value = \"c.delayedValue@prev\", defaultOutValue = \"x2\""),
        ("d", "value = 1.0"),
        ("e", "value = \"d.delayedValue\", setChangeRate = \"b.delayedValue@prev\""),
    ] {
        entries += &blocks(name, 1, "LimRateOfChangeCI", pins);
    }
    for (index, signals) in ["a", "b", "c", "b|c", "d", "e"].into_iter().enumerate() {
        let signals: Vec<_> = signals.split('|').map(|s| format!("\"{s}.delayedValue\"")).collect();
        entries +=
            &format!("[[output]]\nservice = \"s{index}\"\nsignals = [{}]\n", signals.join(", "));
    }
    engine(&entries)
}

/// The time of the oldest sample of each output.
fn source_times_ns(engine: &TaskEngine) -> [u64; 6] {
    [0, 1, 2, 3, 4, 5].map(|output| engine.output_source_ns(output))
}

#[test]
fn the_source_time_of_an_output_is_that_of_the_oldest_sample_that_it_depends_on() {
    let mut engine = sources();
    for (input, time_ns) in [(0, 40), (1, 30), (2, 20), (3, 10)] {
        engine.set_input(input, 1.0, time_ns);
    }
    engine.step(0);
    // d is computed from no input; e depends on b, though on its last value.
    assert_eq!(source_times_ns(&engine), [40, 30, 20, 20, 0, 30]);
}

#[test]
fn an_input_without_a_sample_does_not_count_as_a_source() {
    let mut engine = sources();
    engine.set_input(0, 1.0, 40);
    engine.step(0);
    assert_eq!(source_times_ns(&engine), [40, 40, 0, 40, 0, 40]);
}

#[test]
fn an_input_is_bound_by_the_name_of_a_signal_or_by_its_channel() {
    use isochrone_engine::config::Binding;
    let binding = |key: &str| {
        let text = format!("{TASK}[[input]]\nname = \"x\"\n{key}\n");
        plan(&text).unwrap().tasks[0].inputs[0].binding.clone()
    };
    assert_eq!(binding("signal = \"level.y\""), Binding::Signal("level.y".into()));
    assert_eq!(binding("channel = 65535"), Binding::Channel(65_535));
    assert_eq!(binding(""), Binding::Channel(0));
}
