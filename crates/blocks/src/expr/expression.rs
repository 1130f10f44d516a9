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
