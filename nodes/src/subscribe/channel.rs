//! The signals of a frame by the names that people read.

use isochrone_engine::escaped;
use isochrone_ipc::{LayoutWatcher, SignalSpec, ipc};
use isochrone_timing::units::counted;

/// A signal that is shown.
#[derive(Clone)]
pub(crate) struct Channel {
    /// Index in the frame.
    pub(crate) place: usize,
    pub(crate) name: String,
    pub(crate) value_type: String,
    pub(crate) unit: String,
}

/// Stands where a frame has no value for a signal.
pub(crate) const NO_VALUE: &str = "-";

/// Names as a line for people.
pub(crate) fn listed(channels: &[Channel]) -> String {
    const SHOWN: usize = 64;
    let (shown, more) = channels.split_at(channels.len().min(SHOWN));
    let names = shown.iter().map(|channel| channel.name.as_str()).collect::<Vec<_>>().join(", ");
    match more.len() {
        0 => names,
        more => format!("{names}, and {more} more"),
    }
}

/// What frames are of which nobody has learned the names, and why: they have none, or `watcher` could not hear of
/// them.
pub(crate) fn unnamed(
    channels: usize,
    layout: u64,
    watcher: &LayoutWatcher<ipc::Service>,
) -> String {
    let values = counted(channels as u64, "value");
    match watcher.obstacle().filter(|_| layout != 0) {
        Some(obstacle) => format!("{values}, whose names cannot be read: {obstacle}"),
        None => format!("{values}, which nobody names"),
    }
}

/// The channels of a frame, with their numbers where nobody names them. Another process chose the
/// names, so they are escaped, also for a file that somebody will look at.
pub(crate) fn channels_of(signals: &[SignalSpec], channels: usize) -> Vec<Channel> {
    let channel = |place: usize| {
        let signal = signals.get(place).cloned().unwrap_or_default();
        let name = match signal.name.as_str() {
            "" => format!("ch{place}"),
            name => escaped(name).into_owned(),
        };
        let plain = |word: &str| escaped(word).into_owned();
        let (value_type, unit) = (plain(&signal.value_type), plain(&signal.unit));
        Channel { place, name, value_type, unit }
    };
    (0..channels).map(channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_another_process_chose_does_not_reach_the_terminal_as_a_command() {
        let signals = [SignalSpec::new("a\u{1b}[2J\u{9b}", ""), SignalSpec::default()];
        let names = channels_of(&signals, 2).into_iter().map(|channel| channel.name);
        assert_eq!(names.collect::<Vec<_>>(), [r"a\u001b[2J\u009b", "ch1"]);
    }
}
