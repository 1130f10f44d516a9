//! A received frame, and the text about it.

use isochrone_ipc::Receipt;

/// A frame that was received, kept for as long as it is shown.
pub(super) struct ReceivedFrame {
    pub(super) receipt: Receipt,
    pub(super) values: Vec<f64>,
}

/// The flags of a frame behind `before`, in square brackets; nothing if it has none.
pub(super) fn doubts(receipt: &Receipt, before: &str) -> String {
    match receipt.header.flags() {
        flags if flags.is_empty() => String::new(),
        flags => format!("{before}[{flags}]"),
    }
}

/// The age of a frame when it arrived, as text.
pub(super) fn age(receipt: &Receipt) -> String {
    match receipt.age_ns() {
        Some(age_ns) => format!("{:.1} us", age_ns as f64 / 1e3),
        None => "- us".to_owned(),
    }
}
