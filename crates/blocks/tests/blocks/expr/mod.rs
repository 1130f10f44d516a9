//! The language of expressions.

mod functions;
mod mistakes;
mod oracle;
mod page;
mod random;
mod rules;

use isochrone_blocks::PinType;
use isochrone_blocks::expr::{Mistake, Program, parse};

/// Signals by name, with their types and slots.
type Signals<'a> = &'a [(&'a str, PinType, f64)];

/// The program of a text, and the slots of its signals.
fn program(text: &str, signals: Signals<'_>) -> Result<(Program, Vec<f64>), Mistake> {
    let expression = parse(text)?;
    let used: Vec<_> = expression
        .names()
        .iter()
        .map(|it| {
            signals.iter().find(|known| known.0 == it.name).unwrap_or_else(|| panic!("{it:?}"))
        })
        .collect();
    let types: Vec<_> = used.iter().map(|it| it.1).collect();
    Ok((expression.program(&types)?, used.iter().map(|it| it.2).collect()))
}

/// The type of a text's result, and the result or the status word.
fn value(text: &str, signals: Signals<'_>) -> (PinType, Result<f64, u16>) {
    let (program, inputs) =
        program(text, signals).unwrap_or_else(|mistake| panic!("{text}: {mistake:?}"));
    let mut registers = vec![f64::NAN; program.registers()];
    (program.result(), program.evaluate(&inputs, &mut registers))
}
