//! The signals of a frame by the names that people read.

use isochrone_engine::escaped;
use isochrone_ipc::{Service, SignalFrame, SignalSpec};
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

/// Names as a line of text.
pub(crate) fn listed(channels: &[Channel]) -> String {
    const SHOWN: usize = 64;
    let (shown, more) = channels.split_at(channels.len().min(SHOWN));
    let names = shown.iter().map(|channel| channel.name.as_str()).collect::<Vec<_>>().join(", ");
    match more.len() {
        0 => names,
        more => format!("{names}, and {more} more"),
    }
}

/// What a frame carries, for people: its signals and who publishes them, or that it has no names, and why.
pub(crate) fn carried<S: Service>(frame: &SignalFrame<'_, S>, channels: &[Channel]) -> String {
    if let Some(announced) = frame.announced() {
        return format!("{} (from \"{}\")", listed(channels), announced.publisher);
    }
    let values = counted(channels.len() as u64, "value");
    match frame.obstacle() {
        Some(obstacle) => format!("{values}, whose names cannot be read: {obstacle}"),
        None => format!("{values}, which nobody names"),
    }
}

/// The channels of a frame, see [`channels_of`].
pub(crate) fn channels<S: Service>(frame: &SignalFrame<'_, S>) -> Vec<Channel> {
    let signals = frame.announced().map_or(&[][..], |announced| &announced.layout.signals);
    channels_of(signals, frame.channels().len())
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
