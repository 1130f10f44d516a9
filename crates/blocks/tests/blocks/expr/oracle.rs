//! Random expressions against an oracle, `tests/oracles/expressions/expressions.py`.

use isochrone_blocks::PinType::{self, Bool, Int, Lreal, Time, Word};
use isochrone_blocks::expr::parse;

const CASES: &str = include_str!("../../oracles/expressions/expressions.txt");

const NAMES: [(&str, PinType); 14] = [
    ("x", Lreal),
    ("y", Lreal),
    ("tank.level", Lreal),
    ("pump-1.y@prev", Lreal),
    ("i", Int),
    ("j", Int),
    ("axis.0.n", Int),
    ("p", Bool),
    ("q", Bool),
    ("AND", Bool),
    ("t", Time),
    ("_pause", Time),
    ("w", Word),
    ("state", Word),
];

/// The type and bits of a run's result, or its status word.
fn found(text: &str, values: &str) -> String {
    let expression = parse(text).unwrap_or_else(|mistake| panic!("{text}: {mistake:?}"));
    let of = |name: &str| NAMES.iter().find(|it| it.0 == name).expect(name).1;
    let types: Vec<_> = expression.names().iter().map(|it| of(&it.name)).collect();
    let program =
        expression.program(&types).unwrap_or_else(|mistake| panic!("{text}: {mistake:?}"));
    let inputs: Vec<f64> = values.split(' ').filter_map(|value| value.parse().ok()).collect();
    assert_eq!(inputs.len(), types.len(), "{text}");
    let mut registers = vec![1.0; program.registers()];
    match program.evaluate(&inputs, &mut registers) {
        Ok(value) => format!("{} {:016x}", program.result(), value.to_bits()),
        Err(status) => format!("!{status:04X}"),
    }
}

#[test]
fn two_thousand_expressions_are_worth_what_the_oracle_says_to_the_last_bit() {
    let mut runs = 0;
    let mut differences = Vec::new();
    for line in CASES.lines() {
        let (text, cases) = line.split_once('|').unwrap();
        for case in cases.split('|').filter(|case| *case != "?") {
            let (values, expected) = case.split_once("> ").unwrap();
            let found = found(text, values);
            runs += 1;
            if found != expected {
                differences.push(format!("{text} of {values}: {found}, not {expected}"));
            }
        }
    }
    assert!(runs > 3000);
    let first = &differences[..differences.len().min(20)];
    assert!(differences.is_empty(), "{} of {runs} differ: {first:#?}", differences.len());
}

#[test]
fn types_that_the_oracle_refuses_are_mistakes() {
    let mut refused = 0;
    for text in CASES.lines().filter_map(|line| line.strip_suffix("|?")) {
        let expression = parse(text).unwrap_or_else(|mistake| panic!("{text}: {mistake:?}"));
        let of = |name: &str| NAMES.iter().find(|it| it.0 == name).expect(name).1;
        let types: Vec<_> = expression.names().iter().map(|it| of(&it.name)).collect();
        let found = expression.program(&types);
        assert!(found.is_err(), "{text}: {found:?}");
        refused += 1;
    }
    assert_eq!(refused, 250);
}
