//! **A node in any program**: the threads of its tasks, its ports and its telemetry.
//!
//! Each state of a node is a type. [`Node::prepare`] opens the ports of all tasks in threads that
//! then wait ([`Prepared`]); [`Prepared::start`] starts all of them on one grid ([`Running`]);
//! [`Running::finish`] returns what each task did and cost ([`Outcome`]). Dropping a state ends its threads.
//!
//! Besides the tasks, one ordinary thread does everything that is not real time: the supervisor, which drains the
//! rings of the cycles, serves requests, publishes telemetry, resolves layouts and keeps the alarms. The program
//! polls nothing. Its threads may share a [`Running`] node, and may subscribe to its [`Events`]. The ring of a task's
//! records holds the cycles of a second, or 8 MiB of them: records are lost, and counted, only if the supervisor gets
//! no CPU for longer.
//!
//! ```
//! use isochrone_engine::{Plan, Rules, Source};
//! use isochrone_runtime::{End, Node};
//!
//! let text = r#"
//!     [node]
//!     name = "level"
//!     [[task]]
//!     name = "fast"
//!     period = "1ms"
//!     [[block]]
//!     name = "ramp"
//!     type = "LimRateOfChangeCI"
//!     in = { value = 25.0, setChangeRate = 10.0 }
//! "#;
//! let plan = Plan::new(Source::new("level.toml", text), &Rules::default())?;
//! let node = Node::prepare_alone(&plan)?.with_cycles(Some(50)).start();
//! node.set([("ramp.setChangeRate", 5.0)])?;
//! node.wait();
//! let outcome = node.finish()?;
//! assert_eq!(outcome.end, End::Cycles);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The requests with which operators look at and change a running node are in [`isochrone_control`].
//!
//! A cycle is one function: wait for the release, apply values set by operators, read the inputs,
//! step the blocks, copy the outputs into the frames, send them, and then do all less urgent work
//! in the slack. Nothing here accesses the terminal or a service manager; messages for people go to
//! `tracing`, from the supervisor.
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

mod active_alarms;
mod alarms;
mod apply;
mod bindings;
mod clocks;
mod error;
mod event;
mod events;
mod faults;
mod freshness;
mod inputs;
pub mod journal;
mod last_second;
mod limiter;
mod messages;
mod node;
mod operate;
mod operating;
mod orders;
mod outcome;
mod output_file;
mod outputs;
mod panics;
mod placement;
mod real_time_thread;
mod recorded;
mod recorder;
mod records;
mod report;
mod responses;
mod rows;
mod running;
mod snapshots;
mod standing;
mod supervisor;
mod task;
mod threads;
mod timing_channels;
mod traces;
mod warning;

pub use alarms::Alarm;
pub use apply::{Applying, IfMissed, PreparedApply};
pub use clocks::read_clocks;
pub use error::{
    ApplyError, NodePanicked, PrepareError, SendError, SupervisorPanicked, TaskPanicked,
};
pub use limiter::{Allowed, Limiter};
pub use node::{Node, Prepared, next_epoch_ns};
pub use operating::Sent;
pub use outcome::{End, Outcome};
pub use output_file::{folder_of, open_output, output_target};
pub use panics::{Panic, catch_panic, hold_panic_messages};
pub use placement::{
    Conflict, ConflictKind, CpuUser, CpuUsers, Meeting, Neighbours, TaskCpu, TaskCpus,
};
pub use real_time_thread::RealTimeThread;
pub use recorded::task_layouts;
pub use recorder::{RecordingFile, RecordingOutcome};
pub use running::Running;
pub use supervisor::{Batch, CycleEvent, Events};
pub use warning::warning;
