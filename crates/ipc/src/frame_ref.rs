//! A frame as a reader holds it.

use std::fmt;
use std::marker::PhantomData;

use iceoryx2::sample::Sample;

use crate::{FrameHeader, Service};

/// A received frame, read where the publisher wrote it. Dropping it gives the memory back.
pub struct FrameRef<'a, S: Service> {
    sample: Sample<S, [f64], FrameHeader>,
    /// One at a time: iceoryx2 lets a reader hold only so many.
    subscriber: PhantomData<&'a mut ()>,
}

impl<S: Service> FrameRef<'_, S> {
    pub(crate) fn new(sample: Sample<S, [f64], FrameHeader>) -> Self {
        Self { sample, subscriber: PhantomData }
    }

    /// When and from what the frame was made.
    pub fn header(&self) -> &FrameHeader {
        self.sample.user_header()
    }

    /// One value per channel. How many is the publisher's choice: ask with `get`.
    pub fn values(&self) -> &[f64] {
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
