//! Recordings of frames: MCAP files that are written, read and repaired.
//!
//! A file has a channel for each service and layout. Its messages are CDR with a `ros2msg` schema, so
//! Foxglove, PlotJuggler, `ros2 bag info`, and `mcap` and `rosbags` in Python read it as it is. Names are spelled
//! as ROS spells them; the original ones are metadata of the channel.
//!
//! | in the file | is |
//! |---|---|
//! | channel `/plant/level` | frames of the service `plant/level`, as `isochrone/msg/PlantLevel…` |
//! | field `frame` | the frame's header, when it was received, and how many frames were lost before it |
//! | other fields | the signals: `ramp.delayedValue` is `ramp.delayed_value`, `axis.17.y` is `axis_17.y` |
//! | log time | when the frame's cycle was due, in Unix ns |
//! | publish time | when the frame was sent, in Unix ns |
//! | channel `/isochrone/marks` | [marks](Mark): gaps and restarts |
//! | metadata `isochrone.clock` | what both clocks read, at the start and whenever Unix time was set |
//! | metadata `isochrone.recording` | the [format](FORMAT), and the version that wrote it |
//!
//! The recording of a node ([`Writer::create_for_node`]) has everything that repeating its run needs:
//!
//! | in the file | is |
//! |---|---|
//! | channel `/level/fast` | each cycle of the task `fast` of the node `level`: when it ran, its inputs, which cycle of other tasks it read, its outputs ([`TaskLayout`]) |
//! | channel `/isochrone/journal` | [what was done](RecordedEntry) to the node, as its journal has it |
//! | attachment `configuration.toml` | the configuration that it was started with, and once more where the file was closed |
//! | attachment `node.state` | the state that it went on with, if it retains one |
//! | metadata `isochrone.node` | [which node](RecordedNode) it is of; likewise |
//!
//! [`message`] has the messages of ROS 2 in general: by their definitions, to CDR and back.
//!
//! A recording of ROS 2 (`ros2 bag record -s mcap`) is read, too: each topic whose messages have numbers that all of them
//! have is a service, with these [numbers](message::MessageNumbers) by their dotted names. [`Uncarried`] is the rest.
//!
//! A [`Writer`] hands a chunk to the system whenever it is [flushed](Writer::flush), so a process that is
//! killed loses what came after that. A [`Reader`] reads such a file to where it breaks off, and
//! [`repair`] makes a closed one of it, with metadata `isochrone.part` that say so. Behind a record that cannot be
//! what it says, both look for the next one. Whatever a file claims, a reader's memory stays
//! [bounded](MAX_RECORD_BYTES).
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod carried;
mod cdr;
mod channels;
mod chunk;
mod clock;
mod condition;
mod definitions;
mod encoded;
mod error;
mod frame;
mod index;
mod layout;
pub mod message;
mod node_writer;
mod reader;
mod record;
mod records;
mod repair;
mod ros_channel;
mod row;
mod source;
mod spelling;
mod writer;

pub use carried::Carried;
pub use cdr::{ByteOrder, CdrError};
pub use clock::ClockReading;
pub use condition::{Damage, FileCondition};
pub use definitions::field_names;
pub use error::{RecordingReadError, RepairError, WriteError};
pub use frame::{Frame, Mark, RecordedFrame, Uncarried};
pub use layout::{OutputLayout, TaskLayout};
pub use reader::{Item, Reader};
pub use record::MAX_RECORD_BYTES;
pub use repair::{Repaired, repair};
pub use row::{RecordedEntry, RecordedInput, RecordedNode, RecordedRow, RecordedWire, RowHead};
pub use writer::{ChannelId, Failed, Writer};

/// The version of the format: of names, messages and metadata.
pub const FORMAT: u32 = 1;
