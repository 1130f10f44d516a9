//! Every case in golden/, bit for bit.

use std::fs;
use std::path::Path;

use isochrone_engine::{Flags, InputReading, Plan, Rules, Source, TaskEngine, TaskPlan};

/// Header, without units, and rows of a table of numbers.
fn table(text: &str) -> (Vec<&str>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let header = lines.next().unwrap_or_default().split(',');
    let header = header.map(|column| column.split(" [").next().unwrap()).collect();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    (header, lines.map(row).collect())
}

/// Gives a row of samples of inputs, whether they are ok, and values of variables.
fn give(engine: &mut TaskEngine, plan: &TaskPlan, columns: &[&str], row: &[f64]) {
    let cell = |name: &str| columns.iter().position(|column| *column == name).map(|at| row[at]);
    let mut given = 0;
    for (index, input) in plan.inputs.iter().enumerate() {
        let Some(value) = cell(&input.name) else { continue };
        let ok = cell(&format!("{}.ok", input.name));
        given += 1 + usize::from(ok.is_some());
        let ok = ok.is_none_or(|ok| ok != 0.0);
        let (source_ns, flags) = (0, Flags::NONE);
        engine.read_input(index, &InputReading { value, ok, age_s: 0.0, source_ns, flags });
    }
    for (index, variable) in plan.variables.iter().enumerate() {
        let Some(value) = cell(&variable.name) else { continue };
        given += 1;
        engine.give_variable(index, value);
    }
    assert_eq!(given, columns.len(), "{columns:?}");
}

/// Runs a case of one task and one output; column 0 of the expected table is the cycle.
fn assert_case(case: &Path) {
    let source = Source::read(&case.join("config.toml")).unwrap();
    let plan = Plan::new(source, &Rules::default()).unwrap();
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    let expected = fs::read_to_string(case.join("expected.csv")).unwrap();
    let (columns, expected) = table(&expected);
    let signals: Vec<&str> =
        plan.tasks[0].outputs[0].signals.iter().map(|signal| signal.name.as_str()).collect();
    assert_eq!(columns[1..], signals, "{}", case.display());
    let samples = fs::read_to_string(case.join("in.csv")).unwrap_or_default();
    let (inputs, samples) = table(&samples);
    let mut frame = vec![0.0; signals.len()];
    assert!(!expected.is_empty());
    for (cycle, expected) in expected.iter().enumerate() {
        if let Some(row) = samples.get(cycle) {
            give(&mut engine, &plan.tasks[0], &inputs, row);
        }
        engine.step(expected[0] as u64);
        engine.read_output(0, &mut frame);
        for ((signal, actual), expected) in signals.iter().zip(&frame).zip(&expected[1..]) {
            let place = format!("{} cycle {cycle} {signal}", case.display());
            assert_eq!(
                actual.to_bits(),
                expected.to_bits(),
                "{place}: {actual:?} not {expected:?}"
            );
        }
    }
}

#[test]
fn every_golden_case_is_reproduced_bit_for_bit() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../golden");
    let cases: Vec<_> = fs::read_dir(golden).unwrap().map(|case| case.unwrap().path()).collect();
    assert!(cases.len() >= 16);
    for case in cases {
        assert_case(&case);
    }
}
