//! The header that every frame carries.

use iceoryx2::prelude::ZeroCopySend;

/// When a frame was made and from what. The user header of each sample; 48 bytes, all `u64`.
///
/// All times are nanoseconds of the publisher's `CLOCK_MONOTONIC`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("isochrone.FrameHeader.v1")]
pub struct FrameHeader {
    /// 0, 1, 2 … per publisher; a gap is a loss, a restart at 0 is another publisher.
    pub sequence: u64,
    /// The publisher's cycle index, skipped cycles included.
    pub cycle: u64,
    /// When the cycle was due.
    pub release_ns: u64,
    /// When the frame was sent (read just before sending).
    pub publish_ns: u64,
    /// `publish_ns` of the oldest input sample that this frame was computed from; 0: none.
    pub source_ns: u64,
    /// Cycles lost since the publisher started.
    pub missed: u64,
}
