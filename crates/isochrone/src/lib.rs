//! **isochrone**: a control node that runs function blocks at a deterministic period and exchanges
//! values with other processes through shared memory without copying. This crate re-exports
//! everything a program needs to embed a node.
//!
//! # A node in a program
//!
//! `Cargo.toml` of the program, with the path of a checkout:
//!
//! ```toml
//! [dependencies]
//! isochrone = { path = "../isochrone/crates/isochrone" }
//! ```
//!
//! The configuration, `level.toml`:
//!
//! ```toml
//! [node]
//! name = "level"
//! [[task]]
//! name = "fast"
//! period = "1ms"
//! [[block]]
//! name = "ramp"
//! type = "LimRateOfChangeCI"
//! in = { value = 25.0, setChangeRate = 10.0 }
//! [[block]]
//! name = "half"
//! type = "Half"
//! in = { x = "ramp.delayedValue" }
//! [[output]]
//! service = "plant/level"
//! signals = ["half.y"]
//! ```
//!
//! The program, `src/main.rs`:
//!
//! ```
//! use std::time::Duration;
//!
//! use isochrone::prelude::*;
//!
//! /// `block!` uses fixed names (`Inputs`, `Outputs`, `State`), so each block has its module.
//! mod half {
//!     use isochrone::prelude::{Block, Cycle, block};
//!
//!     block! {
//!         /// Half of a value.
//!         pub Half {
//!             inputs {
//!                 /// The value.
//!                 "x" => x: f64,
//!             }
//!             outputs {
//!                 /// Half of it.
//!                 "y" => y: f64,
//!             }
//!             state {}
//!             status {}
//!         }
//!     }
//!
//!     impl Block for Half {
//!         fn step(_: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
//!             Outputs { y: inputs.x / 2.0 }
//!         }
//!     }
//! }
//! use half::Half;
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//! #   let domain = isochrone::ipc::IsolatedDomain::new("frontdoor")?;
//! #   let file = domain.root_path().with_file_name("level.toml");
//! #   std::fs::write(&file, r#"
//! #       [node]
//! #       name = "level"
//! #       [[task]]
//! #       name = "fast"
//! #       period = "1ms"
//! #       [[block]]
//! #       name = "ramp"
//! #       type = "LimRateOfChangeCI"
//! #       in = { value = 25.0, setChangeRate = 10.0 }
//! #       [[block]]
//! #       name = "half"
//! #       type = "Half"
//! #       in = { x = "ramp.delayedValue" }
//! #       [[output]]
//! #       service = "plant/level"
//! #       signals = ["half.y"]
//! #   "#)?;
//! #   #[cfg(any())]
//!     let (file, domain) = ("level.toml", Domain::find()?);
//!
//!     // TOML -> plan: every name resolved, every value checked. All errors are found together.
//!     let catalogue = [CATALOGUE, &[BlockType::of::<Half>()]].concat();
//!     let plan = Plan::read(file, &Rules { catalogue: &catalogue, ..Rules::default() })?;
//!
//!     // Ports open, threads wait; what the machine refused can be looked at.
//!     let node = Node::prepare(&plan, Participant::join("level", domain)?)?;
//!     node.refusals().for_each(|refusal| println!("{refusal}: {}", refusal.remedy()));
//!
//!     // One grid for all tasks.
//!     let node = node.with_cycles(Some(1000)).start();
//!     node.set([("ramp.setChangeRate", 5.0)])?;
//!     // It runs in threads of its own. This one may look, or wait for the end.
//!     while !node.wait_within(Duration::from_millis(100)) {
//!         println!("{:?}", node.value("half.y"));
//!     }
//!
//!     // What each task did, and what it cost after its warm-up of 100 cycles.
//!     let outcome = node.finish()?;
//!     let task = &outcome.tasks[0];
//!     println!("{:?}: {} cycles, {:?} allocations", outcome.end, task.cycles, task.allocations);
//!     outcome.alarms.iter().for_each(|alarm| println!("{}", alarm.sentence()));
//! #   assert_eq!((outcome.end, task.cycles), (End::Cycles, 1000));
//!     Ok(())
//! }
//! ```
//!
//! Each state of a node is a type: [`Prepared`](runtime::Prepared), [`Running`](runtime::Running),
//! [`Outcome`](runtime::Outcome). Dropping a state ends its threads. Quantities that were not
//! measured are `None`.
//!
//! The program polls nothing: beside the tasks' threads, a supervisor does whatever is not real time. A
//! [`Running`](runtime::Running) node may be shared by threads; one of them may [`wait`](runtime::Running::wait) for
//! its end while others operate it.
//!
//! - **Between processes**, a node's ports use [`ipc::Service`](prelude::ipc::Service); within one
//!   process, [`local::Service`](prelude::local::Service), which leaves no files behind.
//! - **Without services**, use [`Node::prepare_alone`](runtime::Node::prepare_alone): set inputs
//!   with [`set`](runtime::Running::set) and read signals with [`value`](runtime::Running::value).
//! - **All verbs of the command line** with your own blocks:
//!   `isochrone_cli::main(&[BlockType::of::<Half>()])`; `isochrone_cli::Program` adds a version and verbs of
//!   your own.
//! - **Test a block** with [`blocks::testing::check`]: extreme inputs, determinism, its state.
//! - **Operate the running node** with [`set`](runtime::Running::set),
//!   [`force`](runtime::Running::force), [`release`](runtime::Running::release),
//!   [`undo`](runtime::Running::undo) and [`get`](runtime::Running::get): each request is checked
//!   whole.
//! - **Learn what happens**: [`events`](runtime::Running::events) hands out each cycle's record and in which cycle
//!   a request was applied, in batches.
//! - **Record it** with [`with_recording`](runtime::Prepared::with_recording): `isochrone replay` repeats the
//!   run bit for bit.
//! - **Read its frames** from another program with [`SignalReader`](prelude::SignalReader): the values of each frame
//!   by their names, see [below](#frames-in-a-program).
//! - **See what is wrong** with [`active_alarms`](runtime::Running::active_alarms) while it runs; afterwards,
//!   [`Outcome::alarms`](runtime::Outcome::alarms) has what came up and
//!   [`Outcome::report`](runtime::Outcome::report) is what `isochrone run --report` writes.
//! - **Ask another node** with [`control::Client`], and **trace it** with [`Trace`](control::Trace): every
//!   cycle of chosen signals.
//! - **Errors** all become an [`Error`]. Its `Debug` is a sentence with the way out, and so is that of each of them,
//!   for a `main` that returns one.
//! - **Memory** of the whole process is locked if the program calls
//!   [`prepare_process`](cyclic::prepare_process).
//! - **Allocations** are counted if the program has
//!   [`CountingAllocator`](cyclic::CountingAllocator) as its `#[global_allocator]`.
//!
//! # Frames in a program
//!
//! ```
//! use std::time::Duration;
//!
//! use isochrone::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let domain = isochrone::ipc::IsolatedDomain::new("signals")?;
//! # #[cfg(any())]
//! let domain = Domain::find()?;
//! let participant = Participant::<ipc::Service>::join("display", &domain)?;
//! // No names: all signals. The publisher may start later, and may come back with other signals.
//! let mut level = SignalReader::open(&participant, "plant/level", &["half.y"])?;
//! while let Some(frame) = level.wait(Duration::from_millis(100)) {
//!     match frame.value("half.y") {
//!         Ok(value) if !frame.flags().is_in_doubt() => println!("{}: {value}", frame.sequence()),
//!         Ok(value) => println!("{}: {value}, but {}", frame.sequence(), frame.flags()),
//!         Err(SignalError::Unnamed { .. }) => println!("its publisher names no signals"),
//!         Err(error) => println!("{error}"),
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # Architecture
//!
//! Each crate answers one question. Of the crates in this table, each uses only those above it:
//!
//! | crate | says |
//! |---|---|
//! | [`blocks`] | *what* to compute: function blocks, pure, without clock or I/O |
//! | [`model`] | *the nouns*: values, roles, flags, forces, changes, refusals, schedules |
//! | [`engine`] | *in what order*: configuration, plan, process image; one call steps a task |
//! | [`machine`] | *what this machine is* and does to a loop |
//! | [`cyclic`] | *when*: an absolute grid, the wait for it, real-time set-up |
//! | [`ipc`] | *how values cross processes*: frames and requests over iceoryx2 |
//! | [`timing`] | *numbers* from cycle records |
//! | [`control`] | *operating a node*: the protocol of its control service, client and server |
//! | [`recording`] | *files* of frames and cycles |
//! | [`report`] | *documents*: reports, tables, pictures |
//! | [`runtime`] | *a node*: the tasks' threads, ports, requests, telemetry |
//!
//! Data flows one way: TOML, `Config` (as written), [`Plan`](engine::Plan) (resolved, checked,
//! ordered), [`TaskEngine`](engine::TaskEngine) (image and banks), cycle. Strings and hash maps are
//! not used beyond the plan.
//!
//! # One cycle
//!
//! Wait for the release; apply values set by operators; read the inputs into the image; step the
//! banks in order; copy the outputs into the frames that were loaned beforehand; send. Then, in the
//! slack: loan the next frames, connect ports, push the cycle record. Between the release and the
//! slack, isochrone makes no allocation, takes no lock, causes no page fault, logs nothing and
//! makes no system call. When a peer joins just before a release, iceoryx2 connects it as the cycle
//! receives or sends, and allocates and maps memory there.

mod error;

pub use error::Error;
#[doc(inline)]
pub use isochrone_blocks as blocks;
#[doc(inline)]
pub use isochrone_control as control;
#[doc(inline)]
pub use isochrone_cyclic as cyclic;
#[doc(inline)]
pub use isochrone_engine as engine;
#[doc(inline)]
pub use isochrone_ipc as ipc;
#[doc(inline)]
pub use isochrone_machine as machine;
#[doc(inline)]
pub use isochrone_model as model;
#[doc(inline)]
pub use isochrone_runtime as runtime;
#[doc(inline)]
pub use isochrone_timing as timing;

/// What [`runtime`] names of the files of recordings.
pub mod recording {
    pub use isochrone_recording::{ClockReading, OutputLayout, TaskLayout, WriteError};
}

/// Reports of runs.
pub mod report {
    pub use isochrone_report::{
        Comparison, CostReport, LeftOut, LinkArm, Outlier, ProgramVersion, RecordingReport, Report,
        TaskArm, TurnReport, Verdict,
    };
}

/// Everything a program needs to embed a node: `use isochrone::prelude::*`.
pub mod prelude {
    pub use isochrone_blocks::{Block, BlockType, CATALOGUE, Cycle, block};
    pub use isochrone_control::desk::{Reading, SaveError, ValueWarning};
    pub use isochrone_control::{ActiveAlarm, ClientError};
    pub use isochrone_cyclic::{
        Clock, CountingAllocator, GrantRefusal, Monotonic, Pace, ProcessGrant, ThreadGrant,
        prepare_process,
    };
    pub use isochrone_engine::{
        BuildError, Diagnostic, Diagnostics, Plan, PlanError, Problem, ReadError, Rules, Source,
    };
    pub use isochrone_ipc::{
        Depth, Domain, DomainError, FrameLayout, FramePublisher, FrameSubscriber, JoinError,
        LayoutError, OpenError, Participant, Receipt, Service, SignalError, SignalFrame,
        SignalReader, SignalSpec, Stamp, ipc, local,
    };
    pub use isochrone_machine::Machine;
    pub use isochrone_model::{
        Action, AlarmMoment, AlarmSeverity, AlarmState, AlarmTotals, AppliedChange, AskedBy,
        Change, Entry, Finding, Flags, Force, Hold, ProcessAlarm, Refusal, Value,
    };
    pub use isochrone_recording::WriteError;
    pub use isochrone_report::Report;
    pub use isochrone_runtime::journal::{Journal, JournalError};
    pub use isochrone_runtime::{
        Alarm, ApplyError, Applying, Batch, CycleEvent, End, Events, IfMissed, Node, NodePanicked,
        Outcome, PrepareError, Prepared, PreparedApply, RecordingFile, RecordingOutcome, Running,
        SendError, Sent, SupervisorPanicked, TaskCpus, TaskPanicked,
    };
    pub use isochrone_timing::{
        CycleRecord, FollowRecord, InputReport, LinkReport, Summary, TaskReport, Warning,
        WarningCode,
    };

    pub use crate::Error;
}
