//! The condition of an alarm as written.

use std::fmt;

use toml::Spanned;

/// A condition. The places are in the file.
#[derive(Clone, Debug, PartialEq)]
pub enum AlarmCondition {
    /// A BOOL signal has this value.
    Is {
        /// The signal.
        signal: Spanned<String>,
        /// The value.
        value: bool,
    },
    /// A comparison of a signal.
    Comparison {
        /// The signal.
        left: Spanned<String>,
        /// How it is compared.
        relation: Spanned<Relation>,
        /// What it is compared with.
        right: Spanned<AlarmOperand>,
    },
}

/// What a signal is compared with.
#[derive(Clone, Debug, PartialEq)]
pub enum AlarmOperand {
    /// Another signal.
    Signal(String),
    /// A number.
    Number(f64),
    /// A time, in ms.
    Time(i32),
    /// TRUE or FALSE.
    Bool(bool),
}

/// How two values are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// `>`
    Greater,
    /// `>=`
    GreaterOrEqual,
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `=`
    Equal,
    /// `<>`
    NotEqual,
}

impl AlarmCondition {
    /// The signal that it names first.
    pub const fn first_signal(&self) -> &Spanned<String> {
        match self {
            Self::Is { signal: first, .. } | Self::Comparison { left: first, .. } => first,
        }
    }
}

impl Relation {
    /// All of them, those of two characters first.
    pub const ALL: [Self; 6] = [
        Self::GreaterOrEqual,
        Self::LessOrEqual,
        Self::NotEqual,
        Self::Greater,
        Self::Less,
        Self::Equal,
    ];

    /// As it is written.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Greater => ">",
            Self::GreaterOrEqual => ">=",
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Equal => "=",
            Self::NotEqual => "<>",
        }
    }

    /// Whether it holds while the left value is greater, equal, or less.
    pub const fn holds(self) -> [bool; 3] {
        match self {
            Self::Greater => [true, false, false],
            Self::GreaterOrEqual => [true, true, false],
            Self::Less => [false, false, true],
            Self::LessOrEqual => [false, true, true],
            Self::Equal => [false, true, false],
            Self::NotEqual => [true, false, true],
        }
    }

    /// Whether it tells the greater from the less.
    pub const fn is_ordering(self) -> bool {
        !matches!(self, Self::Equal | Self::NotEqual)
    }
}

impl fmt::Display for Relation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
