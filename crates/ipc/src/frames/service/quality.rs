//! Quality of service: places for ports, and memory for slow readers.

use std::fmt;
use std::ops::RangeInclusive;

use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use iceoryx2::service::static_config::publish_subscribe::StaticConfig;

use super::types::{Element, Header};
use crate::{FrameHeader, Service};

/// One writer, one that is about to take over, and those of links between machines.
const MAX_PUBLISHERS: usize = 4;
/// How many readers a service has places for, unless its writer asks for others.
pub const READERS: usize = 16;
/// A place costs the writer of each frame a look; readers of layouts, which are seldom sent, have as many as anybody
/// may ask for.
const LAYOUT_READERS: usize = 64;
/// For the peer that [`Participant::tend`](crate::Participant::tend) shows for a moment, also where all others are taken.
const SPARE_PLACES: usize = 1;
/// Places for processes that are no readers, or readers that are gone and not yet cleaned up after.
const SPARE_NODES: usize = 24;
/// Finding the newest frame holds the best so far while it looks at the next.
const MAX_BORROWED: usize = 2;
/// Memory for the frames that one reader can be behind, and the bounds of their number.
const BUFFER_BYTES: usize = 1 << 20;
const BUFFER_FRAMES: RangeInclusive<usize> = 2..=256;

/// What a service is created with, where there is none. Whoever opens one takes it as it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quality {
    pub(super) buffer: usize,
    pub(super) borrowed: usize,
    /// How many readers it has places for.
    readers: usize,
    /// With how many places it is as it was asked for.
    fewest_readers: usize,
}

impl Quality {
    /// Of a service whose frames have so many channels.
    pub(crate) fn of_frames(channels: usize) -> Self {
        Self { borrowed: MAX_BORROWED, ..Self::of_burst(buffer_frames(channels)) }
    }

    /// The same for readers that want so many frames to wait, if the memory for one reader allows it.
    pub(crate) fn of_frames_behind(channels: usize, frames: usize) -> Self {
        let buffer = frames.min(BUFFER_BYTES / frame_bytes(channels)).max(*BUFFER_FRAMES.start());
        Self { buffer, ..Self::of_frames(channels) }
    }

    /// For readers that take so many frames at once, one after the other.
    pub(crate) const fn of_burst(frames: usize) -> Self {
        Self { buffer: frames, borrowed: 1, readers: READERS, fewest_readers: 0 }
    }

    /// Where an existing service provides less than this, with both values and what to do; `None`
    /// where it provides all of it.
    pub(crate) fn shortfall<S: Service, E: Element, H: Header>(
        self,
        opened: &PortFactory<S, [E], H>,
    ) -> Option<String> {
        let has = opened.static_config();
        let (buffer, borrowed) =
            (has.subscriber_max_buffer_size(), has.subscriber_max_borrowed_samples());
        let mut differences = Vec::new();
        if buffer < self.buffer {
            let asked = self.buffer;
            let messages = E::MESSAGES;
            differences.push(format!(
                "{buffer} {messages} wait for a reader, where {asked} were asked for"
            ));
        }
        if borrowed < self.borrowed {
            let asked = self.borrowed;
            differences
                .push(format!("a reader holds {borrowed} at once, where {asked} were asked for"));
        }
        let (places, asked) = (subscriber_places(opened), self.fewest_readers);
        if places < asked {
            differences.push(format!("{places} readers have places, where {asked} were asked for"));
        }
        if !has.has_safe_overflow() {
            differences.push(
                "a reader that is late misses the newest, where it was asked that it miss the oldest"
                    .to_owned(),
            );
        }
        if differences.is_empty() {
            return None;
        }
        let differences = differences.join("; ");
        Some(format!(
            "{differences}; to change that, end all its processes and start this one first"
        ))
    }

    /// Of a service of layouts: the newest is all that counts.
    pub(crate) const fn of_layouts() -> Self {
        Self { buffer: 1, borrowed: 1, readers: LAYOUT_READERS, fewest_readers: 0 }
    }

    /// With places for so many readers.
    pub(crate) const fn for_readers(self, readers: usize) -> Self {
        Self { readers, fewest_readers: readers, ..self }
    }

    pub(super) const fn max_publishers(self) -> usize {
        MAX_PUBLISHERS + SPARE_PLACES
    }

    pub(super) const fn max_subscribers(self) -> usize {
        self.readers + SPARE_PLACES
    }

    pub(super) const fn max_nodes(self) -> usize {
        self.readers + SPARE_NODES
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { buffer, borrowed, readers, .. } = self;
        write!(
            f,
            "places for {readers} readers, each with a buffer of {buffer} and {borrowed} to hold"
        )
    }
}

/// How many publishers a service has places for, the spare one left out.
pub(crate) fn publisher_places<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
) -> usize {
    let config = opened.static_config();
    config.max_publishers() - spare_places(config)
}

/// How many subscribers a service has places for, the spare one left out.
pub(crate) fn subscriber_places<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
) -> usize {
    let config = opened.static_config();
    config.max_subscribers() - spare_places(config)
}

/// Who created the service cannot be seen, but that it has a place more for publishers than ours are for. Programs
/// of another make, and ports that open at the very same moment, may still take that one.
fn spare_places(config: &StaticConfig) -> usize {
    if config.max_publishers() == MAX_PUBLISHERS + SPARE_PLACES { SPARE_PLACES } else { 0 }
}

/// The messages of a publisher: as many as it takes to always have the next one to write.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pool {
    /// How many.
    pub(crate) messages: usize,
    /// The memory that iceoryx2 sets aside for them.
    pub(crate) bytes: u64,
}

impl Pool {
    /// Of a publisher that writes so many messages at once, each with `payload_bytes`.
    ///
    /// iceoryx2's own count takes every reader to be behind by different messages. Where a full buffer drops
    /// its oldest, whatever waits for any reader is among the newest that one buffer holds, and counts
    /// once; only what readers hold can be older.
    pub(crate) fn new<S: Service, E: Element, H: Header>(
        opened: &PortFactory<S, [E], H>,
        max_loaned: usize,
        payload_bytes: usize,
    ) -> Self {
        /// iceoryx2's own header.
        const SYSTEM_HEADER_BYTES: usize = 64;
        let config = opened.static_config();
        let (readers, history) = (config.max_subscribers(), config.history_size());
        let (buffer, borrowed) =
            (config.subscriber_max_buffer_size(), config.subscriber_max_borrowed_samples());
        let waiting = if config.has_safe_overflow() {
            buffer.max(history)
        } else {
            readers * buffer + history
        };
        let messages = waiting + readers * borrowed + max_loaned;
        let message_bytes = SYSTEM_HEADER_BYTES + size_of::<H>() + payload_bytes;
        Self { messages, bytes: messages as u64 * message_bytes as u64 }
    }

    /// No more than so many messages; when all are taken, there is none to write.
    pub(crate) fn of_at_most(self, messages: usize) -> Self {
        let kept = self.messages.min(messages);
        Self { messages: kept, bytes: self.bytes / self.messages as u64 * kept as u64 }
    }
}

fn frame_bytes(channels: usize) -> usize {
    size_of::<FrameHeader>() + channels * size_of::<f64>()
}

fn buffer_frames(channels: usize) -> usize {
    (BUFFER_BYTES / frame_bytes(channels)).clamp(*BUFFER_FRAMES.start(), *BUFFER_FRAMES.end())
}

#[cfg(test)]
mod tests {
    use iceoryx2::prelude::{NodeBuilder, ServiceName};

    use crate::{IsolatedDomain, local};

    use super::*;

    #[test]
    fn what_a_service_lacks_is_told_with_both_sides_and_what_to_do() {
        let domain = IsolatedDomain::new("isotest").unwrap();
        let node = NodeBuilder::new().config(domain.config()).create::<local::Service>().unwrap();
        let name = ServiceName::new("x").unwrap();
        let builder = || node.service_builder(&name).publish_subscribe::<[f64]>();
        let poor = builder()
            .enable_safe_overflow(false)
            .subscriber_max_buffer_size(3)
            .subscriber_max_borrowed_samples(1)
            .create()
            .unwrap();
        let told = Quality::of_frames(1).shortfall(&poor).unwrap();
        for part in [
            "3 frames wait for a reader, where 256 were asked for",
            "a reader holds 1 at once, where 2 were asked for",
            "misses the newest, where it was asked that it miss the oldest",
            "end all its processes and start this one first",
        ] {
            assert!(told.contains(part), "{part}: {told}");
        }
        drop(poor);
        let rich = builder().subscriber_max_buffer_size(300).history_size(7).create().unwrap();
        assert_eq!(Quality::of_frames(1).shortfall(&rich), None);
    }

    #[test]
    fn buffers_are_deep_for_small_frames_and_bounded_for_large_ones() {
        assert_eq!(buffer_frames(1), 256);
        assert_eq!(buffer_frames(1000), (1 << 20) / 8072);
        assert_eq!(buffer_frames(1_000_000), 2);
    }
}
