//! Frames that are to arrive.

use super::output::Output;

/// Frames that come one after another are a stream.
const STREAM: u64 = 5;

/// Frames that a process is to receive from now on.
#[derive(Debug, Clone)]
pub(super) struct Watch {
    who: String,
    output: Output,
    rows: u64,
    value: Option<f64>,
}

impl Watch {
    /// So many frames, from now on, until one has this value, or any.
    pub(super) fn new(who: &str, output: &Output, value: Option<f64>) -> Self {
        let (output, rows) = (output.clone(), output.feed().rows);
        Self { who: who.to_owned(), output, rows, value }
    }

    /// Whether they arrived.
    pub(super) fn is_met(&self) -> bool {
        let feed = self.output.feed();
        feed.rows >= self.rows + STREAM && self.value.is_none_or(|value| feed.last == Some(value))
    }

    /// Counts from now on.
    pub(super) fn anew(&mut self) {
        self.rows = self.output.feed().rows;
    }

    /// What arrived instead.
    pub(super) fn unmet(&self) -> String {
        let feed = self.output.feed();
        let wanted = self.value.map_or_else(String::new, |value| format!(" with {value}"));
        let last = feed.last.map_or_else(String::new, |last| format!(", the last with {last}"));
        format!("the {} received {} frames{last}, none{wanted}", self.who, feed.rows - self.rows)
    }
}
