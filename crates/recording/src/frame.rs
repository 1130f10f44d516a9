//! Frames and marks, as they are written and read.

use isochrone_ipc::{Flags, FrameHeader};

use crate::Carried;

/// A frame to be written. All times are of `CLOCK_MONOTONIC` of this machine, in ns.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// The header, as it was received.
    pub header: FrameHeader,
    /// The values, one for each signal of its channel.
    pub values: &'a [f64],
    /// When it was received.
    pub received_ns: u64,
    /// When its cycle was due, or the nearest to it that is known on this clock.
    pub due_ns: u64,
    /// When it was sent, or received if that is not known on this clock.
    pub sent_ns: u64,
    /// How many frames were lost immediately before it.
    pub lost: u64,
}

/// A frame that was read from a file.
#[derive(Debug)]
pub struct RecordedFrame<'a> {
    /// Which channel of the file it is from; equal numbers carry the same.
    pub channel: u16,
    /// What it carries.
    pub carried: &'a Carried,
    /// The header, as it was received.
    pub header: FrameHeader,
    /// The values, one for each signal.
    pub values: &'a [f64],
    /// When it was received, in ns of the recorder's `CLOCK_MONOTONIC`.
    pub received_ns: u64,
    /// When its cycle was due, in ns of the recorder's `CLOCK_MONOTONIC`; of Unix time if the file does not
    /// say how the two differ.
    pub due_ns: u64,
    /// When its cycle was due, in Unix ns.
    pub due_unix_ns: u64,
    /// When it was sent, in Unix ns.
    pub sent_unix_ns: u64,
    /// How many frames were lost immediately before it.
    pub lost: u64,
}

impl RecordedFrame<'_> {
    /// What the values are worth.
    pub fn flags(&self) -> Flags {
        self.header.flags()
    }
}

/// What does not become a part of frames, in a recording of ROS 2.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Uncarried {
    /// The service of the topic's frames.
    pub service: String,
    /// The fields, or why the whole topic is left out.
    pub what: String,
}

/// A remark besides the frames: a message on `/isochrone/marks`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Mark {
    /// When it was noticed, in ns of the recorder's `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// The cycle of the frame that it stands before.
    pub cycle: u64,
    /// How many frames it is about.
    pub count: u64,
    /// [`LOST`](Self::LOST) or [`RESTART`](Self::RESTART); readers skip others.
    pub kind: String,
    /// The service that it is about.
    pub service: String,
    /// The same in words.
    pub text: String,
}

impl Mark {
    /// `count` frames were lost before this cycle.
    pub const LOST: &str = "lost";
    /// The publisher was restarted or replaced.
    pub const RESTART: &str = "restart";
}
