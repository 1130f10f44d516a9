//! What a service provides: places for ports, and memory for what its readers are behind.

use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::types::{Element, Header};
use crate::{FrameHeader, Service};

/// One writer, one that is about to take over, and those of links between machines.
pub(super) const MAX_PUBLISHERS: usize = 4;
pub(super) const MAX_SUBSCRIBERS: usize = 16;
/// For the peer that a [`Repair`](crate::Repair) shows for a moment, also where all others are taken.
pub(super) const SPARE_PLACES: usize = 1;
pub(super) const MAX_NODES: usize = 40;
/// Finding the newest frame holds the best so far while it looks at the next.
const MAX_BORROWED: usize = 2;
/// Memory for the frames that one reader can be behind, and the bounds of their number.
const BUFFER_BYTES: usize = 1 << 20;
const BUFFER_FRAMES: (usize, usize) = (2, 256);

/// What a service is created with, where there is none. Whoever opens one takes it as it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quality {
    pub(super) buffer: usize,
    pub(super) borrowed: usize,
}

impl Quality {
    /// Of a service whose frames have so many channels.
    pub(crate) fn of_frames(channels: usize) -> Self {
        Self { buffer: buffer_frames(channels), borrowed: MAX_BORROWED }
    }

    /// Of a service of layouts: the newest is all that counts.
    pub(crate) const fn of_layouts() -> Self {
        Self { buffer: 1, borrowed: 1 }
    }
}
/// How many publishers a service has places for, the spare one left out.
pub(crate) fn publisher_places<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
) -> usize {
    places(opened.static_config().max_publishers(), MAX_PUBLISHERS)
}

/// How many subscribers a service has places for, the spare one left out.
pub(crate) fn subscriber_places<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
) -> usize {
    places(opened.static_config().max_subscribers(), MAX_SUBSCRIBERS)
}

/// Who created the service cannot be seen, but that it has a place more than ours are for. Programs
/// of another make, and ports that open at the very same moment, may still take that one.
fn places(provided: usize, ours: usize) -> usize {
    if provided == ours + SPARE_PLACES { ours } else { provided }
}

/// The memory that iceoryx2 sets aside for the messages of a publisher, each with `payload_bytes`: as
/// many as all readers together can be behind or hold, and those being written.
pub(crate) fn segment_bytes<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
    max_loaned: usize,
    payload_bytes: usize,
) -> u64 {
    /// iceoryx2's own header.
    const SYSTEM_HEADER_BYTES: usize = 64;
    let config = opened.static_config();
    let behind = config.subscriber_max_buffer_size() + config.subscriber_max_borrowed_samples();
    let messages = config.max_subscribers() * behind + config.history_size() + max_loaned;
    let message_bytes = SYSTEM_HEADER_BYTES + size_of::<H>() + payload_bytes;
    messages as u64 * message_bytes as u64
}

fn buffer_frames(channels: usize) -> usize {
    let frame_bytes = size_of::<FrameHeader>() + channels * size_of::<f64>();
    let (least, most) = BUFFER_FRAMES;
    (BUFFER_BYTES / frame_bytes).clamp(least, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_are_deep_for_small_frames_and_bounded_for_large_ones() {
        assert_eq!(buffer_frames(1), 256);
        assert_eq!(buffer_frames(1000), (1 << 20) / 8072);
        assert_eq!(buffer_frames(1_000_000), 2);
    }
}
