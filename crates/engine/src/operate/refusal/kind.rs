//! The kinds of refusals.

use super::Refusal;

/// The kinds of refusals, which the control service numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum RefusalKind {
    /// 1: a name that does not exist.
    UnknownName,
    /// 2: a signal that cannot be written, or not so.
    NotWritable,
    /// 3: a value of a wrong type, outside of its range or limits, or NaN.
    WrongValue,
    /// 4: a cycle that has begun, or that nothing can wait for.
    TooLate,
    /// 5: no room; try again.
    Busy,
    /// 6: the configuration does not allow it, or the journal cannot be written.
    Forbidden,
    /// 7: it cannot be changed while the node runs.
    CannotChange,
    /// 9: something was changed since.
    Conflict,
}

impl Refusal {
    /// What kind it is of.
    pub fn kind(&self) -> RefusalKind {
        match self {
            Self::Unknown { .. } | Self::UnknownTransaction { .. } | Self::EarlierRun { .. } => {
                RefusalKind::UnknownName
            }
            Self::Output { .. }
            | Self::Wired { .. }
            | Self::Fed { .. }
            | Self::Quality { .. }
            | Self::Age { .. }
            | Self::NotForced { .. }
            | Self::NoSet { .. } => RefusalKind::NotWritable,
            Self::Value { .. }
            | Self::Limits { .. }
            | Self::Twice { .. }
            | Self::Empty
            | Self::Duration { .. } => RefusalKind::WrongValue,
            Self::At { .. } => RefusalKind::TooLate,
            Self::TooMany { .. }
            | Self::Scheduled { .. }
            | Self::Changing { .. }
            | Self::Waiting { .. } => RefusalKind::Busy,
            Self::Fixed { .. } | Self::ForcedGone { .. } | Self::NotRepeated { .. } => {
                RefusalKind::CannotChange
            }
            Self::Protected { .. } | Self::Control { .. } | Self::Journal { .. } => {
                RefusalKind::Forbidden
            }
            Self::Conflict { .. }
            | Self::Gone { .. }
            | Self::TakenBack { .. }
            | Self::Moving { .. } => RefusalKind::Conflict,
        }
    }
}
