//! The counters of a reader.

/// What a subscriber received and what went wrong, since it was opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct SubscriberCounters {
    /// Frames taken out of the buffer, including those that `newest` passed over.
    pub received: u64,
    /// Frames that newer ones displaced before they were taken: gaps in the sequence between the first
    /// and the last frame.
    pub lost: u64,
    /// How often the publisher restarted or was replaced: the sequence went back, or jumped ahead by
    /// more than could have been sent in the meantime.
    pub restarts: u64,
    /// Frames from publishers other than the current one; they are discarded.
    pub other_writers: u64,
    /// Frames of one of two redundant processes that did not know that the other had taken over; they are discarded.
    pub superseded: u64,
    /// Calls into iceoryx2 that failed.
    pub receive_errors: u64,
    /// How often the number of publishers was seen to change. One that left and one that joined
    /// between two calls are not seen.
    pub connects: u64,
    /// Connections to a publisher that failed. Its frames do not arrive until
    /// [`Participant::tend`](crate::Participant::tend), or the next peer that joins or leaves, makes iceoryx2 try again.
    pub connect_errors: u64,
}
