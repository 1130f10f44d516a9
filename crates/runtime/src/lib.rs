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
//! A [`Simulation`] steps the same tasks without a clock and without services, as fast as they go.
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

mod error;
mod keeping;
mod node;
mod placement;
mod redundancy;
mod simulation;
mod supervisor;
mod task;

pub use error::{
    ApplyError, NodePanicked, PrepareError, SendError, SupervisorPanicked, TaskPanicked,
};
pub use keeping::journal;
pub use keeping::output_file::{folder_of, open_output, output_target};
pub use keeping::recorded::task_layouts;
pub use keeping::recorder::{RecordingFile, RecordingOutcome};
pub use keeping::state;
pub use node::alarms::Alarm;
pub use node::apply::{Applying, IfMissed, PreparedApply};
pub use node::operating::Sent;
pub use node::outcome::{End, Outcome};
pub use node::prepare::{Node, Prepared, next_epoch_ns};
pub use node::running::Running;
pub use node::warning::warning;
pub use placement::{
    Conflict, ConflictKind, CpuUser, CpuUsers, Meeting, Neighbours, TaskCpu, TaskCpus,
};
pub use redundancy::{JoinTwinError, Redundancy, TwinRole};
pub use simulation::Simulation;
pub use supervisor::{Batch, CycleEvent, Events};
pub use task::clocks::read_clocks;
pub use task::limiter::{Allowed, Limiter};
pub use task::panics::{Panic, catch_panic, hold_panic_messages};
pub use task::real_time_thread::RealTimeThread;
