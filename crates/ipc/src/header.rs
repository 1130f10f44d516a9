//! The header that every frame carries, and how a reader checks its times.

use iceoryx2::prelude::ZeroCopySend;
use isochrone_model::Flags;

/// When a frame was made and from what. The user header of each sample; 72 bytes, all `u64`.
///
/// All times are in nanoseconds of the publisher's `CLOCK_MONOTONIC`. A minimal publisher, in any
/// language, sets `sequence` and `publish_ns` and leaves the rest 0.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("isochrone.FrameHeader.v2")]
pub struct FrameHeader {
    /// 0, 1, 2, … per publisher; a gap means lost frames.
    pub sequence: u64,
    /// The publisher's cycle index, skipped cycles included.
    pub cycle: u64,
    /// When the cycle was due.
    pub release_ns: u64,
    /// When the frame was sent (read just before sending).
    pub publish_ns: u64,
    /// Time of the oldest sample that this frame was computed from: the `source_ns` of that sample's
    /// frame, or its `publish_ns` if `source_ns` is 0. 0 means no source.
    pub source_ns: u64,
    /// Cycles lost since the publisher started.
    pub missed: u64,
    /// The quality of the values, as bits of [`Flags`]; 0: good.
    pub flags: u64,
    /// When this publisher took over the service, in Unix nanoseconds: higher than the term of every
    /// earlier publisher. 0 means a publisher that does not set it.
    pub term: u64,
    /// Number of the frame's layout, see [`FrameLayout::number`](crate::FrameLayout::number). 0 means a
    /// publisher that does not announce one.
    pub layout: u64,
}

/// Whether a frame's publisher and its reader share a clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SenderClock {
    /// They share one, as far as is known.
    #[default]
    Shared,
    /// The publisher runs on another machine.
    Foreign,
}

/// The times of a frame after the reader has checked them, in nanoseconds of the reader's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Credible {
    /// Time from which the age of the frame's values is counted: `publish_ns`, or the time of arrival
    /// if `publish_ns` is not plausible.
    pub sampled_ns: u64,
    /// Time of the frame's oldest source, passed on to whatever is computed from it; never 0.
    pub source_ns: u64,
    /// Whether the frame's own stamps are used or the time of arrival replaces them.
    pub stamps: Stamps,
}

/// Whether the time stamps of a frame are used, and why not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Stamps {
    /// They are used.
    #[default]
    Believed,
    /// Not used: `publish_ns` is in the reader's future, so it comes from another clock.
    Future,
    /// Not used: they come from another machine.
    Foreign,
}

impl FrameHeader {
    /// The quality of the values.
    pub const fn flags(&self) -> Flags {
        Flags::from_bits(self.flags)
    }

    /// Checks the frame's times against the reader's clock, which read `arrival_ns` on arrival.
    ///
    /// Read the clock for `arrival_ns` after taking the frame out of the subscriber. With an earlier
    /// reading, a frame that arrived since then appears to come from the future.
    pub fn credible(&self, clock: SenderClock, arrival_ns: u64) -> Credible {
        let stamps = match clock {
            SenderClock::Foreign => Stamps::Foreign,
            SenderClock::Shared if self.publish_ns > arrival_ns => Stamps::Future,
            SenderClock::Shared => Stamps::Believed,
        };
        let sampled_ns = match stamps {
            Stamps::Believed => self.publish_ns,
            Stamps::Future | Stamps::Foreign => arrival_ns,
        };
        // A source that is younger than its frame is ignored.
        let handed_on = stamps == Stamps::Believed && (1..=sampled_ns).contains(&self.source_ns);
        let source_ns = if handed_on { self.source_ns } else { sampled_ns };
        Credible { sampled_ns, source_ns: source_ns.max(1), stamps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW_NS: u64 = 1_000_000;

    fn credible(publish_ns: u64, source_ns: u64, clock: SenderClock) -> Credible {
        FrameHeader { publish_ns, source_ns, ..FrameHeader::default() }.credible(clock, NOW_NS)
    }

    #[test]
    fn the_age_counts_from_the_stamp_and_the_source_is_handed_on() {
        let Credible { sampled_ns, source_ns, stamps } = credible(900, 500, SenderClock::Shared);
        assert_eq!((sampled_ns, source_ns, stamps), (900, 500, Stamps::Believed));
        assert_eq!(credible(NOW_NS, 0, SenderClock::Shared).sampled_ns, NOW_NS);
    }

    #[test]
    fn a_frame_without_a_source_is_the_source_itself() {
        assert_eq!(credible(900, 0, SenderClock::Shared).source_ns, 900);
        assert_eq!(credible(0, 0, SenderClock::Shared).source_ns, 1, "0 would be none");
    }

    #[test]
    fn a_stamp_from_the_future_counts_from_the_arrival() {
        for publish_ns in [NOW_NS + 1, u64::MAX] {
            let credible = credible(publish_ns, 500, SenderClock::Shared);
            assert_eq!((credible.sampled_ns, credible.source_ns), (NOW_NS, NOW_NS));
            assert_eq!(credible.stamps, Stamps::Future);
        }
    }

    #[test]
    fn stamps_of_another_machine_are_not_believed() {
        let credible = credible(900, 500, SenderClock::Foreign);
        assert_eq!((credible.sampled_ns, credible.source_ns), (NOW_NS, NOW_NS));
        assert_eq!(credible.stamps, Stamps::Foreign);
    }

    #[test]
    fn a_source_after_its_frame_is_not_believed() {
        assert_eq!(credible(900, u64::MAX, SenderClock::Shared).source_ns, 900);
    }
}
