//! Expressions in structured text (IEC 61131-3, edition 3): what `Expr` blocks compute.
//!
//! [`parse`] reads a text. With the types of its names it becomes a [`Program`]: a flat list of typed steps that
//! [`Program::evaluate`] runs without allocation and recursion. Each value on the way is finite and of its type, or an
//! error, which is a status word. `docs/expressions.md` is the reference of the language.
//!
//! ```
//! use isochrone_blocks::{PinType, expr};
//!
//! let expression = expr::parse("LIMIT(0.0, sp - pv, 10.0)")?;
//! assert_eq!(expression.names().iter().map(|it| &*it.name).collect::<Vec<_>>(), ["sp", "pv"]);
//! let program = expression.program(&[PinType::Lreal, PinType::Int])?;
//! let mut registers = vec![0.0; program.registers()];
//! assert_eq!(program.evaluate(&[7.5, 3.0], &mut registers), Ok(4.5));
//! # Ok::<(), expr::Mistake>(())
//! ```

use alloc::string::String;
use core::ops::Range;

mod compile;
mod evaluate;
mod expression;
mod functions;
mod literal;
mod operands;
mod operator;
mod parse;
mod program;
mod tokens;
mod types;

pub use expression::{Expression, Name, Operand, SignalComparison};
pub use parse::parse;
pub use program::Program;

/// The most steps that a program has, so that its time has a bound. A name, a literal, an operator and a function take
/// a step each; `MUX` takes one more for each input, `MAX` and `MIN` take one for each input after the first, and `LIMIT` takes two.
pub const MAX_STEPS: usize = 256;

/// How deep parentheses and calls may stand in each other.
pub const MAX_DEPTH: usize = 64;

/// What is wrong with an expression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// Where, in bytes of the text.
    pub span: Range<usize>,
    /// What is wrong.
    pub message: String,
    /// The way out.
    pub help: Option<String>,
}

impl Mistake {
    fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { span, message: message.into(), help: None }
    }

    fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}
