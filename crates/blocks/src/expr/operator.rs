//! The operators with two operands, as the table of operators of IEC 61131-3 orders them.

/// An operator between two operands. All of them group from the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Or,
    Xor,
    And,
    Equal,
    NotEqual,
    Less,
    Greater,
    AtMost,
    AtLeast,
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
}

/// Each with its text and its precedence; an operator whose text begins with another's stands before it.
const OPERATORS: [(Operator, &str, u8); 16] = [
    (Operator::Or, "OR", 1),
    (Operator::Xor, "XOR", 2),
    (Operator::And, "AND", 3),
    (Operator::And, "&", 3),
    (Operator::Equal, "=", 4),
    (Operator::NotEqual, "<>", 4),
    (Operator::AtMost, "<=", 5),
    (Operator::AtLeast, ">=", 5),
    (Operator::Less, "<", 5),
    (Operator::Greater, ">", 5),
    (Operator::Add, "+", 6),
    (Operator::Subtract, "-", 6),
    (Operator::Power, "**", 8),
    (Operator::Multiply, "*", 7),
    (Operator::Divide, "/", 7),
    (Operator::Modulo, "MOD", 7),
];

impl Operator {
    /// The operator that a word is, in any case.
    pub(super) fn of_word(word: &str) -> Option<Self> {
        let is_it = |it: &&(Self, &str, u8)| it.1.eq_ignore_ascii_case(word);
        OPERATORS.iter().find(is_it).map(|it| it.0)
    }

    /// The operator in signs that a text begins with, and their number.
    pub(super) fn of_signs(text: &str) -> Option<(Self, usize)> {
        let is_it = |it: &&(Self, &str, u8)| {
            !it.1.starts_with(|c: char| c.is_ascii_alphabetic()) && text.starts_with(it.1)
        };
        OPERATORS.iter().find(is_it).map(|it| (it.0, it.1.len()))
    }

    fn entry(self) -> (&'static str, u8) {
        OPERATORS.iter().find(|it| it.0 == self).map_or(("", 0), |it| (it.1, it.2))
    }

    pub(super) fn as_str(self) -> &'static str {
        self.entry().0
    }

    /// Of a comparison, whether it holds while the left operand is greater than the right, equal to it, or less.
    pub(super) fn holds(self) -> Option<[bool; 3]> {
        Some(match self {
            Self::Greater => [true, false, false],
            Self::AtLeast => [true, true, false],
            Self::Less => [false, false, true],
            Self::AtMost => [false, true, true],
            Self::Equal => [false, true, false],
            Self::NotEqual => [true, false, true],
            _ => return None,
        })
    }

    /// What has more binds its operands first.
    pub(super) fn precedence(self) -> u8 {
        self.entry().1
    }
}
