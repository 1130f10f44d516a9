//! `Expr`: a block whose outputs are computed by the expressions that a configuration gives.

use crate::expr::{self, Program};
use crate::{Decision, Origin, Pin, PinDefault, PinType, StatusWord, status};

/// One output of an `Expr`. It reads as many inputs of the block as its program does, which stand behind those of the
/// outputs before it.
#[derive(Debug)]
pub struct OutputProgram {
    /// What computes it.
    pub program: Program,
    /// How many inputs it reads.
    pub inputs: usize,
}

/// The output that every `Expr` has behind those of its expressions.
pub const STATUS: Pin = Pin {
    name: "status",
    pin_type: PinType::Word,
    unit: "",
    default: PinDefault::Required,
    names_task: false,
    aliases: &[],
    latched_by: None,
    raw_doc: "Status word: of the first output in order whose expression has an error.",
};

pub(crate) const DOC: &str =
    "Expressions in structured text over signals of the node, one for each key of `out`.";

pub(crate) const COMPUTES: &[&str] = &[
    "`out = { error = \"sp - pv\" }` makes an output `error`; its type is that of the expression.",
    "Signals stand in an expression by their names; docs/expressions.md has the operators and functions.",
    "All expressions read the signals as wires do: of this cycle, or of the one before with `@prev`.",
    "The outputs of one Expr are computed together: one reads another of them with `@prev` only.",
];

const fn word(code: u16, name: &'static str, meaning: &'static str) -> StatusWord {
    StatusWord { code, name, origin: Origin::Ours, meaning }
}

pub(crate) const WORDS: &[StatusWord] = &[
    word(status::OK, "OK", "no error"),
    word(status::DIVISION_BY_ZERO, "DIVISION_BY_ZERO", "a division by zero"),
    word(
        status::OUT_OF_DOMAIN,
        "OUT_OF_DOMAIN",
        "a function has no value for its input, such as SQRT(-1.0)",
    ),
    word(status::CONVERSION, "CONVERSION", "a value does not fit the type that it is converted to"),
    word(
        status::SELECTION,
        "SELECTION",
        "the selector of a MUX is the number of none of its inputs",
    ),
    word(status::NOT_FINITE, "NOT_FINITE", "a signal or a result is NaN or infinite"),
];

pub(crate) const DECISIONS: &[Decision] = &[
    Decision {
        silent_on: "an error that reaches the result",
        chosen: "the output holds its last good value, 0 or FALSE before the first one, and `status` says why",
    },
    Decision {
        silent_on: "the type of an expression that depends on its own result",
        chosen: "the first of LREAL, BOOL, INT, TIME and WORD with which it is right",
    },
];

/// One step of all instances of a bank, each with so many inputs and outputs. A word of state for each output holds its last good value.
pub(crate) fn step_bank(
    [inputs, outputs]: [usize; 2],
    formulas: &[OutputProgram],
    image: &mut [f64],
    state: &mut [u64],
) -> u64 {
    let mut registers = [0.0; expr::MAX_STEPS];
    let mut errors = 0;
    let instances = image.chunks_exact_mut(inputs + outputs).zip(state.chunks_exact_mut(outputs));
    for (slots, words) in instances {
        let (mut signals, results) = slots.split_at_mut_checked(inputs).unwrap_or_default();
        let mut first_error = status::OK;
        for ((formula, result), good) in formulas.iter().zip(results.iter_mut()).zip(words) {
            let (own, others) = signals.split_at_mut_checked(formula.inputs).unwrap_or_default();
            signals = others;
            match formula.program.evaluate(own, &mut registers) {
                Ok(value) => *good = value.to_bits(),
                Err(error) if first_error == status::OK => first_error = error,
                Err(_) => {}
            }
            *result = f64::from_bits(*good);
        }
        if let Some(shown) = results.last_mut() {
            *shown = f64::from(first_error);
        }
        errors += u64::from(status::is_error(first_error));
    }
    errors
}
