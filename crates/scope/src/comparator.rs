//! How a signal is compared with a level.

/// How two numbers are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Comparator {
    Greater,
    Less,
    AtLeast,
    AtMost,
    Equal,
    Unequal,
}

/// Longer signs first: `>` begins `>=`.
pub(crate) const SIGNS: [(&str, Comparator); 6] = [
    (">=", Comparator::AtLeast),
    ("<=", Comparator::AtMost),
    ("==", Comparator::Equal),
    ("!=", Comparator::Unequal),
    (">", Comparator::Greater),
    ("<", Comparator::Less),
];

impl Comparator {
    /// Its sign.
    pub fn sign(self) -> &'static str {
        SIGNS.into_iter().find(|(_, known)| *known == self).map_or("", |(sign, _)| sign)
    }

    /// Whether it is so. Numbers are compared, not their bits: `0.0 == -0.0`, and NaN is unequal to
    /// everything and neither greater nor less.
    pub fn holds(self, value: f64, level: f64) -> bool {
        match self {
            Self::Greater => value > level,
            Self::Less => value < level,
            Self::AtLeast => value >= level,
            Self::AtMost => value <= level,
            Self::Equal => value == level,
            Self::Unequal => value != level,
        }
    }
}
