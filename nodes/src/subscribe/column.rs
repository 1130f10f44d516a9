//! What a CSV file says of a frame beside its values.

use super::taken::Taken;

/// A column that stands between `cycle` and the values.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum Column {
    /// Number of the frame; a gap is a loss
    Sequence,
    /// When it was sent, in ns of the sender's monotonic clock
    #[value(name = "publish_ns")]
    PublishNs,
    /// How old it was when it came, in ns; empty if it was stamped by another clock
    #[value(name = "age_ns")]
    AgeNs,
    /// Its flags, such as STALE STOPPED; empty if it has none
    Flags,
}

impl Column {
    /// The name in the file.
    pub(super) fn as_str(self) -> &'static str {
        match self {
            Self::Sequence => "sequence",
            Self::PublishNs => "publish_ns",
            Self::AgeNs => "age_ns",
            Self::Flags => "flags",
        }
    }

    /// The field of a frame.
    pub(super) fn of(self, frame: &Taken) -> String {
        match self {
            Self::Sequence => frame.header.sequence.to_string(),
            Self::PublishNs => frame.header.publish_ns.to_string(),
            Self::AgeNs => frame.age_ns().map_or_else(String::new, |age_ns| age_ns.to_string()),
            Self::Flags => frame.header.flags().to_string(),
        }
    }
}
