//! The header that every frame carries, and what its times are worth to a reader.

use iceoryx2::prelude::ZeroCopySend;
use isochrone_quality::Flags;

/// When a frame was made and from what. The user header of each sample; 72 bytes, all `u64`.
///
/// All times are nanoseconds of the publisher's `CLOCK_MONOTONIC`. A plain writer, of any make, fills
/// in `sequence` and `publish_ns` and leaves the rest zero.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("isochrone.FrameHeader.v2")]
pub struct FrameHeader {
    /// 0, 1, 2 … per publisher; a gap is a loss.
    pub sequence: u64,
    /// The publisher's cycle index, skipped cycles included.
    pub cycle: u64,
    /// When the cycle was due.
    pub release_ns: u64,
    /// When the frame was sent (read just before sending).
    pub publish_ns: u64,
    /// Of the oldest sample that this frame was computed from: that frame's `source_ns`, or its
    /// `publish_ns` where that is 0; 0: none.
    pub source_ns: u64,
    /// Cycles lost since the publisher started.
    pub missed: u64,
    /// What the values are worth, the bits of [`Flags`]; 0: nothing to say.
    pub flags: u64,
    /// When this sender took the service, Unix nanoseconds, above every earlier one; 0: a plain
    /// writer.
    pub term: u64,
    /// Which layout the frame has, see [`FrameLayout::number`](crate::FrameLayout::number); 0: a
    /// sender that does not say.
    pub layout: u64,
}

/// Whether the clocks of a frame's sender and of its reader are one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SenderClock {
    /// As far as is known.
    #[default]
    Shared,
    /// The sender runs on another machine.
    Foreign,
}

/// The times of a frame as its reader may believe them, nanoseconds of the reader's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Credible {
    /// From when the age of the frame's values counts: `publish_ns`, or the arrival where that is
    /// not to be believed.
    pub sampled_ns: u64,
    /// The frame's oldest source, handed on to what is computed from it; never 0.
    pub source_ns: u64,
    /// Whether the stamps of the frame are in use, or the arrival in their place.
    pub stamps: Stamps,
}

/// What the stamps of a frame are worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stamps {
    /// They are believed.
    Believed,
    /// `publish_ns` lies in the reader's future: another clock.
    Future,
    /// They are of another machine.
    Foreign,
}

impl FrameHeader {
    /// What the values are worth.
    pub const fn flags(&self) -> Flags {
        Flags::from_bits(self.flags)
    }

    /// Says what the frame's times are worth to a reader at whose clock it arrived at `arrival_ns`.
    ///
    /// `arrival_ns` must not be before the frame was taken out of the subscriber: a frame that came
    /// after an earlier reading of the clock would look like one from the future.
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
        // A source after its frame is no source.
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
