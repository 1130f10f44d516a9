//! Columns of a CSV file besides the values of a frame.

use isochrone_ipc::Receipt;
use isochrone_recording::RecordedFrame;
use isochrone_runtime::read_clocks;

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
    /// When its cycle was due, or else when it was sent, in ns of Unix time
    #[value(name = "unix_ns")]
    UnixNs,
}

impl Column {
    /// The name in the file.
    pub(crate) fn as_str(self) -> &'static str {
        match self {
            Self::Sequence => "sequence",
            Self::PublishNs => "publish_ns",
            Self::AgeNs => "age_ns",
            Self::Flags => "flags",
            Self::UnixNs => "unix_ns",
        }
    }

    /// The field of a frame.
    pub(super) fn of(self, receipt: &Receipt) -> String {
        let Receipt { header, .. } = receipt;
        match self {
            Self::Sequence => header.sequence.to_string(),
            Self::PublishNs => header.publish_ns.to_string(),
            Self::AgeNs => receipt.age_ns().map_or_else(String::new, |age_ns| age_ns.to_string()),
            Self::Flags => header.flags().to_string(),
            Self::UnixNs => read_clocks().unix_ns(receipt.due_ns()).to_string(),
        }
    }

    /// The field of a frame that was recorded.
    pub(crate) fn of_recorded(self, frame: &RecordedFrame<'_>) -> String {
        let header = &frame.header;
        match self {
            Self::Sequence => header.sequence.to_string(),
            Self::PublishNs => header.publish_ns.to_string(),
            Self::AgeNs => {
                // The recorder did not believe a stamp if it took another time for that of sending.
                let after_due_ns = frame.sent_unix_ns.wrapping_sub(frame.due_unix_ns);
                let is_believed = frame.due_ns.wrapping_add(after_due_ns) == header.publish_ns;
                let age_ns = frame.received_ns.saturating_sub(header.publish_ns);
                if is_believed { age_ns.to_string() } else { String::new() }
            }
            Self::Flags => header.flags().to_string(),
            Self::UnixNs => frame.due_unix_ns.to_string(),
        }
    }
}
