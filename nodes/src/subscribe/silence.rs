//! When frames cease to come, and when they come again.

use std::fmt;

use isochrone_ipc::{Flags, FrameHeader, longest_silence_ns};
use isochrone_timing::units::counted;

/// How often a silent service is asked who publishes it.
const LOOK_INTERVAL_NS: u64 = 1_000_000_000;

/// Why no frames come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// Nobody publishes the service any more, or yet.
    NoPublisher,
    /// The sender said that it ends.
    Stopped,
    /// Only a link publishes the service, and has nothing to send.
    Link,
    /// Somebody publishes the service, and sends nothing.
    Unknown,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoPublisher => "nobody publishes it",
            Self::Stopped => "its publisher has ended",
            Self::Link => {
                "nobody publishes it on this machine, and nothing comes through the link, which says whether it is \
                 connected"
            }
            Self::Unknown => "its publisher is there and sends nothing",
        })
    }
}

/// A silence that lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Silence {
    /// Since the newest frame, or since there was a reader.
    pub(super) for_ns: u64,
    pub(super) cause: Cause,
}

impl Silence {
    /// Its length for people, in whole seconds: nothing that lasts is read in tenths.
    pub(super) fn seconds(&self) -> u64 {
        self.for_ns / 1_000_000_000
    }
}

/// Listens whether frames come.
pub(super) struct Listener {
    /// When the newest frame came, or the service was opened.
    heard_ns: u64,
    newest: Option<FrameHeader>,
    frames: u64,
    /// Between the newest frame and the one before, by their own stamps.
    gap_ns: u64,
    /// Why frames ceased, once they did, and when that was looked up.
    ceased: Option<(Cause, u64)>,
}

impl Listener {
    pub(super) fn new(now_ns: u64) -> Self {
        Self { heard_ns: now_ns, newest: None, frames: 0, gap_ns: 0, ceased: None }
    }

    /// Records a frame; returns how long none had arrived, if that was a silence.
    pub(super) fn hear(&mut self, header: &FrameHeader, now_ns: u64) -> Option<u64> {
        let silent_ns = now_ns.saturating_sub(self.heard_ns);
        let after = self.ceased.take().map(|_| silent_ns);
        let stamps = self.newest.map(|newest| header.publish_ns.saturating_sub(newest.publish_ns));
        self.gap_ns = if after.is_some() { 0 } else { stamps.unwrap_or_default() };
        self.heard_ns = now_ns;
        self.newest = Some(*header);
        self.frames += 1;
        after.filter(|_| self.frames > 1)
    }

    /// Looks whether frames have ceased; says so when they just have. `publishers` counts those who
    /// publish the service, and those of them that are links.
    pub(super) fn look(
        &mut self,
        now_ns: u64,
        period_ns: Option<u64>,
        publishers: impl FnOnce() -> (usize, usize),
    ) -> Option<String> {
        if let Some((_, looked_ns)) = self.ceased
            && now_ns < looked_ns.saturating_add(LOOK_INTERVAL_NS)
        {
            return None;
        }
        let silent_ns = now_ns.saturating_sub(self.heard_ns);
        let has_stopped = self.newest.is_some_and(|newest| newest.flags().contains(Flags::STOPPED));
        // A publisher that announces no period may be slow, so the newest gap counts.
        let patience_ns = longest_silence_ns(period_ns.unwrap_or(self.gap_ns));
        if !has_stopped && silent_ns < patience_ns {
            return None;
        }
        let cause = match publishers() {
            _ if has_stopped => Cause::Stopped,
            (0, _) => Cause::NoPublisher,
            (all, links) if all == links => Cause::Link,
            _ => Cause::Unknown,
        };
        let is_new = self.ceased.replace((cause, now_ns)).is_none();
        is_new.then(|| match self.frames {
            0 => format!("is silent: {cause}; no frame has come yet"),
            frames => format!(
                "is silent: {cause}; {} came, the last {:.1} s ago",
                counted(frames, "frame"),
                silent_ns as f64 / 1e9
            ),
        })
    }

    /// The silence that lasts.
    pub(super) fn silence(&self, now_ns: u64) -> Option<Silence> {
        let for_ns = now_ns.saturating_sub(self.heard_ns);
        self.ceased.map(|(cause, _)| Silence { for_ns, cause })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    fn frame(publish_ns: u64, flags: Flags) -> FrameHeader {
        FrameHeader { publish_ns, flags: flags.bits(), ..FrameHeader::default() }
    }

    #[test]
    fn a_silence_is_said_once_and_so_is_its_end() {
        let mut listener = Listener::new(0);
        assert_eq!(listener.hear(&frame(S, Flags::NONE), S), None);
        assert_eq!(listener.look(S + S / 2, Some(1_000_000), || (1, 0)), None);
        let said = listener.look(2 * S, Some(1_000_000), || (0, 0)).unwrap();
        assert_eq!(said, "is silent: nobody publishes it; 1 frame came, the last 1.0 s ago");
        assert_eq!(listener.look(9 * S, Some(1_000_000), || (1, 0)), None);
        let silence = listener.silence(9 * S).unwrap();
        assert_eq!(silence, Silence { for_ns: 8 * S, cause: Cause::Unknown });
        assert_eq!(listener.hear(&frame(10 * S, Flags::NONE), 10 * S), Some(9 * S));
        assert_eq!(listener.silence(10 * S), None);
    }

    #[test]
    fn the_end_of_a_sender_that_says_so_is_said_at_once() {
        let mut listener = Listener::new(0);
        listener.hear(&frame(S, Flags::STOPPED), S);
        let said = listener.look(S + 1, Some(1_000_000), || (1, 0)).unwrap();
        assert_eq!(said, "is silent: its publisher has ended; 1 frame came, the last 0.0 s ago");
    }

    #[test]
    fn a_slow_publisher_is_not_silent_between_two_frames() {
        let mut listener = Listener::new(0);
        listener.hear(&frame(S, Flags::NONE), S);
        listener.hear(&frame(3 * S, Flags::NONE), 3 * S);
        assert_eq!(listener.look(8 * S, None, || (1, 0)), None, "by its gap");
        assert_eq!(listener.look(32 * S, Some(10 * S), || (1, 0)), None, "by its period");
        assert!(listener.look(9 * S, None, || (1, 0)).is_some());
    }

    #[test]
    fn a_link_alone_is_told_from_a_publisher_that_sends_nothing() {
        let mut listener = Listener::new(0);
        let said = listener.look(S, None, || (1, 1)).unwrap();
        assert!(said.contains("nothing comes through the link"), "{said}");
        let mut listener = Listener::new(0);
        let said = listener.look(S, None, || (2, 1)).unwrap();
        assert!(said.contains("its publisher is there"), "{said}");
    }

    #[test]
    fn before_the_first_frame_a_service_is_silent_too() {
        let mut listener = Listener::new(0);
        let said = listener.look(S, None, || (0, 0)).unwrap();
        assert_eq!(said, "is silent: nobody publishes it; no frame has come yet");
        assert_eq!(listener.hear(&frame(2 * S, Flags::NONE), 2 * S), None, "no word is needed");
    }
}
