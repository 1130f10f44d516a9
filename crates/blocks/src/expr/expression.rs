//! An expression as it was read: its parts, whose names have no types yet.

use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;

use super::functions::Function;
use super::literal::Literal;
use super::operator::Operator;

/// An expression whose signals have no types yet.
#[derive(Clone, Debug)]
pub struct Expression {
    pub(super) text: String,
    pub(super) names: Vec<Name>,
    /// Operands stand before what they are operands of; the last node is the result.
    pub(super) nodes: Vec<Node>,
    /// The inputs of calls, by their nodes.
    pub(super) inputs: Vec<usize>,
}

impl Expression {
    /// The names of its signals, each once, in the order in which they first appear.
    pub fn names(&self) -> &[Name] {
        &self.names
    }

    /// What it compares, if it is one comparison of a signal and nothing else: `a > b`, `1.6 < a`, or a BOOL as it is
    /// or behind `NOT`, which is compared with FALSE.
    pub fn comparison(&self) -> Option<SignalComparison> {
        let last = self.nodes.last()?;
        match &last.part {
            Part::Name(left) => {
                Some(SignalComparison::of(*left, Operand::Literal(0.0), [true, false, true]))
            }
            Part::Not(of) => {
                let left = self.name(*of)?;
                Some(SignalComparison::of(left, Operand::Literal(0.0), [false, true, false]))
            }
            Part::Binary { operator, left, right } => {
                let holds = operator.holds()?;
                match (self.name(*left), self.operand(*right)) {
                    (Some(left), Some(right)) => Some(SignalComparison::of(left, right, holds)),
                    (None, Some(Operand::Name(right))) => {
                        let [above, equal, below] = holds;
                        let literal = self.operand(*left)?;
                        Some(SignalComparison::of(right, literal, [below, equal, above]))
                    }
                    _ => None,
                }
            }
            Part::Literal(_) | Part::Sign { .. } | Part::Call { .. } => None,
        }
    }

    /// The name that a node is.
    fn name(&self, node: usize) -> Option<usize> {
        match self.operand(node)? {
            Operand::Name(name) => Some(name),
            Operand::Literal(_) => None,
        }
    }

    fn operand(&self, node: usize) -> Option<Operand> {
        match &self.nodes.get(node)?.part {
            Part::Name(name) => Some(Operand::Name(*name)),
            Part::Literal(literal) => Some(Operand::Literal(literal.value)),
            _ => None,
        }
    }
}

/// A comparison of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SignalComparison {
    /// The signal, by its place among the names.
    pub left: usize,
    /// What it is compared with.
    pub right: Operand,
    /// Whether it holds while the signal is greater than that, equal to it, or less.
    pub holds: [bool; 3],
}

impl SignalComparison {
    const fn of(left: usize, right: Operand, holds: [bool; 3]) -> Self {
        Self { left, right, holds }
    }

    /// Whether it tells the greater from the less, so that there can be a hysteresis.
    pub const fn is_ordering(&self) -> bool {
        self.holds[0] != self.holds[2]
    }
}

/// What a signal is compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operand {
    /// Another signal, by its place among the names.
    Name(usize),
    /// A constant, as it stands in a slot.
    Literal(f64),
}

/// A signal of an expression.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Name {
    /// Without the quotes.
    pub name: String,
    /// Where it first stands in the text, in bytes, with its quotes.
    pub span: Range<usize>,
}

/// A part of an expression and its place in the text, with its parentheses.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) part: Part,
    pub(super) span: Range<usize>,
}

/// Operands are indices of nodes.
#[derive(Clone, Debug)]
pub(super) enum Part {
    Literal(Literal),
    /// An index of names.
    Name(usize),
    Sign {
        is_negative: bool,
        of: usize,
    },
    Not(usize),
    Binary {
        operator: Operator,
        left: usize,
        right: usize,
    },
    /// A part of the expression's inputs, in the order of the function's.
    Call {
        function: &'static Function,
        inputs: Range<usize>,
    },
}
