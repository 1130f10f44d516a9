//! Expressions in structured text.

use isochrone_blocks::PinType;
use isochrone_blocks::expr::{Expression, MAX_DEPTH, MAX_STEPS, Mistake, Program, parse};

use crate::{Target, assert_sentence};

pub(crate) const TARGET: Target = Target { name: "expressions", max_bytes: 512, max_mib: 16, read };

/// What signals hold.
const VALUES: [f64; 10] = [
    0.0,
    -0.0,
    1.0,
    -32768.0,
    32767.0,
    2_147_483_647.0,
    f64::MAX,
    f64::MIN_POSITIVE,
    f64::NAN,
    f64::NEG_INFINITY,
];

fn read(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let expression = match parse(text) {
        Ok(expression) => expression,
        Err(mistake) => return check(&mistake, text),
    };
    // In parentheses, it means the same.
    let within = format!("(\n{text}\n)");
    let within = match parse(&within) {
        Ok(within) => Some(within),
        Err(mistake) => {
            let too_deep = format!("there are more than {MAX_DEPTH} parentheses in each other");
            assert_eq!(mistake.message, too_deep, "{within}");
            None
        }
    };
    for shift in 0..PinType::ALL.len() {
        let names = 0..expression.names().len();
        let types: Vec<PinType> =
            names.map(|name| PinType::ALL[(name + shift) % PinType::ALL.len()]).collect();
        match expression.program(&types) {
            Ok(program) => run(&program, &types, within.as_ref()),
            Err(mistake) => check(&mistake, text),
        }
    }
}

fn check(mistake: &Mistake, text: &str) {
    assert!(!mistake.message.is_empty() && mistake.help.as_deref() != Some(""), "{mistake:?}");
    assert!(text.get(mistake.span.clone()).is_some(), "no place in the text: {mistake:?}");
    // As a configuration with it does, which escapes what a terminal must not get.
    assert_sentence(&isochrone_engine::escaped(&mistake.message));
}

/// A result is a finite value of its type, or an error.
fn run(program: &Program, types: &[PinType], within: Option<&Expression>) {
    assert!(program.steps() <= MAX_STEPS, "{} steps", program.steps());
    let within = within.map(|within| within.program(types).expect("the types fit, as they did"));
    let mut registers = vec![f64::NAN; program.registers()];
    for shift in 0..VALUES.len() {
        let value = |(index, pin_type): (usize, &PinType)| {
            let value = VALUES[(index + shift) % VALUES.len()];
            if pin_type.holds(value) { value } else { 1.0 }
        };
        let inputs: Vec<f64> = types.iter().enumerate().map(value).collect();
        let result = program.evaluate(&inputs, &mut registers);
        match result {
            Ok(value) => assert!(
                value.is_finite() && program.result().holds(value),
                "{value} is no {} of {inputs:?}",
                program.result()
            ),
            Err(status) => assert!(status >= 0x8000, "{status:#06x} is no error"),
        }
        if let Some(within) = &within {
            let mut registers = vec![0.0; within.registers()];
            let again = within.evaluate(&inputs, &mut registers);
            assert_eq!(again.map(f64::to_bits), result.map(f64::to_bits), "{inputs:?}");
        }
    }
}
