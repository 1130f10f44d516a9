//! The live view of a bench: time left, and each arm's percentiles so far. On a terminal only.

use std::cell::Cell;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use isochrone_bench::{Onlooker, View};
use isochrone_timing::Warning;

use crate::terminal;

/// The output for a user at a terminal.
pub(super) struct Terminal;

impl Onlooker for Terminal {
    fn begin(&self, total: Duration, arms: &[&str]) -> Box<dyn View> {
        Box::new(Live::start(total, arms))
    }

    fn warn(&self, warning: &Warning) {
        terminal::note(&format!("warning: {}\n  remedy: {}", warning.message, warning.remedy));
    }
}

/// Progress bars on stderr; nothing if that is not a terminal.
struct Live {
    // Bars are drawn as long as this lives.
    _screen: MultiProgress,
    progress: ProgressBar,
    arms: Vec<ProgressBar>,
    total: Cell<Duration>,
}

impl Live {
    /// A view of a bench that takes `total`, with a line for each arm.
    fn start(total: Duration, arms: &[&str]) -> Self {
        let screen = MultiProgress::new();
        let progress = screen.add(ProgressBar::new(total.as_millis() as u64));
        progress.set_style(style("{bar:40} {msg}"));
        let line = |name: &&str| {
            let line = screen.add(ProgressBar::no_length());
            line.set_style(style("  {prefix:<24} {msg}"));
            line.set_prefix((*name).to_owned());
            line.set_message("-");
            line
        };
        let arms = arms.iter().map(line).collect();
        Self { _screen: screen, progress, arms, total: Cell::new(total) }
    }
}

impl View for Live {
    fn expect(&self, total: Duration) {
        self.total.set(total);
        self.progress.set_length(total.as_millis() as u64);
    }

    fn pass(&self, elapsed: Duration) {
        let left = self.total.get().saturating_sub(elapsed);
        self.progress.set_position(elapsed.as_millis() as u64);
        let seconds = left.as_secs();
        self.progress.set_message(format!("{}:{:02} left", seconds / 60, seconds % 60));
    }

    fn say(&self, arm: usize, so_far: &dyn Fn() -> String) {
        let Some(line) = self.arms.get(arm) else { return };
        if !self.progress.is_hidden() {
            line.set_message(so_far());
        }
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.arms.iter().for_each(ProgressBar::finish_and_clear);
        self.progress.finish_and_clear();
    }
}

fn style(template: &str) -> ProgressStyle {
    // A template that does not parse would be drawn as the default bar.
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
