//! The command line of `scope`.

use std::path::PathBuf;

use isochrone_engine::parse_seconds;
use isochrone_scope::{Trigger, Window};

use crate::domain;

/// Show what signals do around an instant, cycle by cycle
///
/// Waits for the trigger, captures every cycle before and after it, and draws a chart: a curve for each
/// signal, the least and the greatest value of each column, and 0 at the trigger. Without --trigger it
/// begins at once. Signals of several tasks lie on one axis of time, at the releases of their cycles. What
/// is missing is shaded. A trigger fires in the first cycle in which its condition is true after one in which
/// it was false, so what is true from the beginning has to become false first. A NaN is unequal to every level,
/// and nothing else.
///
/// With a FILE that scope or `record` wrote, or CSV as `subscribe` and `export` write it, draws that one.
#[derive(Clone, clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone scope level 'ramp.*' --trigger 'ramp.delayedValue > 1.0'\n  \
    isochrone scope level ramp.delayedValue --trigger 'rising ramp.error' --pre 50ms --post 200ms\n  \
    isochrone scope level level.y --trigger 'changed mode' --timeout 60 -o shot.svg\n  \
    isochrone scope level level.y --auto\n  \
    isochrone scope shot.mcap\n  isochrone scope shift.mcap level.y --trigger 'falling level.y 0.5' -o dip.svg\n\n\
    Triggers: X > 1, X < 1, X >= 1, X <= 1, X == 1, X != 1, `rising X` and `falling X` of a BOOL, \
    `rising X 1.5` and `falling X 1.5` of a number, which has to come from the other side, and `changed X`. \
    A number that rises or falls without a level crosses half of what is seen of it: for a second, or in the FILE. In a running node one that only rises needs a level to rise across.\n\n\
    With --repeat and --auto on a terminal, the chart is drawn anew until q or Ctrl-C.\n\n\
    Exit status: 0 captured, or left with q or Ctrl-C after a shot; 1 the node or the FILE ended within the shot, which \
    is shown as far as it goes, or the node refuses (no such signal, or four scopes look \
    at the task already) or does not answer; 2 the command line is wrong, or the FILE: it cannot be read, or has no such \
    signal; 3 no such node runs, or it ended before the trigger came; 4 the trigger did not come within --timeout, in \
    the FILE, or before Ctrl-C, or the FILE is damaged."
)]
pub(crate) struct Args {
    /// Running control node, or a file to look at: .mcap or .csv
    #[arg(value_name = "NODE|FILE")]
    pub(super) node: String,
    /// Signals to show, at most 64; `*` matches within one part of a name. Default: of a node, that of the
    /// trigger; of a file, all
    #[arg(value_name = "SIGNAL")]
    pub(super) names: Vec<String>,
    /// What to wait for, such as 'ramp.delayedValue > 1.0'; its signal need not be among those shown
    #[arg(short, long, value_name = "CONDITION")]
    pub(super) trigger: Option<Trigger>,
    /// How long before the trigger to show: 0, 0.5, 200ms. Default: 200ms
    #[arg(long, value_name = "TIME", value_parser = parse_history, requires = "trigger", allow_hyphen_values = true)]
    pub(super) pre: Option<f64>,
    /// How long from the trigger on to show. Without one: from now on, or from the beginning of a file. Default: 1s,
    /// and all of a file without a trigger
    #[arg(long, value_name = "TIME", value_parser = parse_time, allow_hyphen_values = true)]
    pub(super) post: Option<f64>,
    /// Capture once, then end; this is the default
    #[arg(long, group = "mode")]
    pub(super) single: bool,
    /// Capture each time the trigger comes; -o numbers the files
    #[arg(long, group = "mode", requires = "trigger")]
    pub(super) repeat: bool,
    /// As --repeat, but also show what there is while no trigger comes
    #[arg(long, group = "mode", conflicts_with = "output")]
    pub(super) auto: bool,
    /// Give up if the trigger has not come after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_time, requires = "trigger", allow_hyphen_values = true)]
    pub(super) timeout: Option<f64>,
    /// Write this file instead of a chart. CSV ("-": to stdout) is for signals of one task
    #[arg(short, long, value_name = "OUT.mcap|OUT.csv|OUT.svg")]
    pub(super) output: Option<PathBuf>,
    #[command(flatten)]
    pub(super) domain: domain::Args,
}

pub(super) fn ns(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

/// When to show what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    Single,
    Repeat,
    Auto,
}

const DEFAULT_HISTORY_S: f64 = 0.2;
const DEFAULT_POST_S: f64 = 1.0;

impl Args {
    pub(super) fn mode(&self) -> Mode {
        match (self.repeat, self.auto) {
            (true, _) => Mode::Repeat,
            (_, true) => Mode::Auto,
            _ => Mode::Single,
        }
    }

    pub(super) fn post_s(&self) -> f64 {
        self.post.unwrap_or(DEFAULT_POST_S)
    }

    pub(super) fn window(&self) -> Window {
        let has_history = self.trigger.is_some();
        let before_s = self.pre.unwrap_or(if has_history { DEFAULT_HISTORY_S } else { 0.0 });
        Window { before_ns: ns(before_s), after_ns: ns(self.post_s()) }
    }
}

fn parse_history(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(0.0) => Ok(0.0),
        _ => parse_time(text).map_err(|why| format!("{why}, or 0")),
    }
}

/// A time may begin with a minus, to be told what is wrong with it, and so may the option behind a time that is
/// missing.
fn parse_time(text: &str) -> Result<f64, String> {
    match text.strip_prefix('-') {
        Some(rest) if rest.starts_with(|c: char| c == '-' || c.is_ascii_alphabetic()) => {
            Err("that is an option; give a time before it, such as 0.5, 500ms or 5min".into())
        }
        _ => parse_seconds(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_history_may_be_none_and_has_units() {
        assert_eq!(parse_history("0"), Ok(0.0));
        assert_eq!(parse_history("200ms"), Ok(0.2));
        assert!(parse_history("-1").unwrap_err().ends_with("or 0"));
        assert!(parse_time("-5ms").unwrap_err().contains("cannot be negative"));
        assert!(parse_time("--pre").unwrap_err().contains("is an option"));
    }
}
