//! A received frame.

use std::fmt;

use iceoryx2::sample::Sample;

use crate::{FrameHeader, Service};

/// A received frame, read where the publisher wrote it. The subscriber gives the memory back when it next looks for
/// frames, in [`maintain`](crate::FrameSubscriber::maintain), or at its end.
pub struct FrameRef<'a, S: Service> {
    sample: &'a Sample<S, [f64], FrameHeader>,
}

impl<'a, S: Service> FrameRef<'a, S> {
    pub(crate) fn new(sample: &'a Sample<S, [f64], FrameHeader>) -> Self {
        Self { sample }
    }

    /// When and from what the frame was made.
    pub fn header(&self) -> &'a FrameHeader {
        self.sample.user_header()
    }

    /// One value per channel. How many is the publisher's choice: ask with `get`.
    pub fn values(&self) -> &'a [f64] {
        self.sample.payload()
    }
}

impl<S: Service> fmt::Debug for FrameRef<'_, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FrameRef")
            .field("header", self.header())
            .field("values", &self.values())
            .finish()
    }
}
