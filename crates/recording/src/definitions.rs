//! The definitions of the messages, as ROS 2 writes them.

use isochrone_ipc::SignalSpec;

use crate::spelling::{Head, Spelling};

/// The head of a frame's message. All fields take eight bytes, so there is no padding.
pub(crate) const FRAME: Head =
    Head { field: "frame", message: "FrameHeader", definition: FRAME_HEADER };
const FRAME_HEADER: &str = "\
uint64 sequence
uint64 cycle
uint64 release_ns
uint64 publish_ns
uint64 source_ns
uint64 missed
uint64 flags
uint64 term
uint64 layout
uint64 received_ns
uint64 lost
float64 sent_after_release_s
";
/// Number of fields before the values of a frame.
pub(crate) const FRAME_FIELDS: usize = 12;

/// The head of the message of a task's cycle.
pub(crate) const TASK: Head =
    Head { field: "task", message: "TaskHeader", definition: TASK_HEADER };
const TASK_HEADER: &str = "\
uint64 cycle
uint64 release_ns
uint64 start_ns
uint64 end_ns
uint64 missed
uint64 lost
";
/// Number of fields before the values of a cycle.
pub(crate) const TASK_FIELDS: usize = 6;

/// The definition of `isochrone/Entry`.
pub(crate) const ENTRY: &str = "\
uint64 time_ns
uint64 cycle
string task
string line
";

/// The definition of `isochrone/Mark`.
pub(crate) const MARK: &str = "\
uint64 time_ns
uint64 cycle
uint64 count
string kind
string service
string text
";

/// The names of signals as the fields of a recorded frame, in their order: `ramp.delayedValue` is
/// `ramp.delayed_value`.
pub fn field_names(signals: &[SignalSpec]) -> Vec<String> {
    let fields = Spelling::new("", signals, FRAME).fields;
    fields.into_iter().map(|field| field.path).collect()
}
