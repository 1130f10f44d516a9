//! The line that says what is recorded, on a terminal.

use indicatif::{ProgressBar, ProgressStyle};

use super::output::Output;
use super::source::Source;
use super::summary::{sentence, size};

/// A line at the bottom of the terminal; nothing if stderr is not a terminal.
pub(super) struct Progress(ProgressBar);

impl Default for Progress {
    fn default() -> Self {
        let line = ProgressBar::no_length();
        if let Ok(style) = ProgressStyle::with_template("{elapsed_precise}  {msg}") {
            line.set_style(style);
        }
        Self(line)
    }
}

impl Progress {
    pub(super) fn show(&self, sources: &[Source<'_>], output: &Output) {
        if !self.0.is_hidden() {
            let lost = sources.iter().map(|source| source.counters().lost).sum();
            let received = sentence(sources.len(), output.frames(), lost);
            self.0.set_message(format!("{received}, {}", size(output.bytes())));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
