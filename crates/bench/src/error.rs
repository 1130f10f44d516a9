//! What can go wrong with a bench.

use std::io;

use isochrone_engine::{BuildError, Findings, format_duration_ns};
use isochrone_ipc::JoinError;
use isochrone_processes::{ChildError, CompanyError};

/// What can go wrong with a bench.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The tasks do not fit into memory.
    #[error(
        "{instances} instances of {arms} need {} MB, and {} MB are available\n\
         remedy: give fewer with --instances, or name fewer with --arms",
        needed_bytes.div_ceil(1_000_000),
        available_bytes.div_ceil(1_000_000)
    )]
    TooLarge {
        /// Instances of each arm.
        instances: usize,
        /// The arms that take turns.
        arms: String,
        /// What they need.
        needed_bytes: u64,
        /// What there is.
        available_bytes: u64,
    },
    /// Two arms have one name.
    #[error("there are two arms \"{arm}\"; give each once, and configurations other file names")]
    TwoArms {
        /// The name.
        arm: String,
    },
    /// The process may not use a CPU.
    #[error("there is no CPU {cpu} that this process may use; there are: {allowed}")]
    NoSuchCpu {
        /// The CPU.
        cpu: usize,
        /// Those that it may use.
        allowed: String,
    },
    /// The process may use no CPU at all.
    #[error("this process may use no CPU; widen its cpuset or taskset")]
    NoCpu,
    /// The kernel does not say which CPUs the process may use.
    #[error("cannot ask for the usable CPUs: {cause}; see that /proc and /sys are there")]
    Cpus {
        /// What it says instead.
        cause: io::Error,
    },
    /// cyclictest runs in real time only.
    #[error("cyclictest runs with a priority; give --priority")]
    CyclictestPriority,
    /// cyclictest knows whole microseconds.
    #[error(
        "the arm cyclictest cannot run at a {what} of {}: it knows whole microseconds only; give \
         another --{what}, or leave the arm out (--arms sleep,hybrid)",
        format_duration_ns(*ns)
    )]
    CyclictestTime {
        /// `period` or `phase`.
        what: &'static str,
        /// How long it is.
        ns: u64,
    },
    /// cyclictest is not there, or its user may not run in real time.
    #[error("cyclictest is not installed, or may not run: install rt-tests and be root")]
    CyclictestMissing,
    /// cyclictest did not do what it should.
    #[error("cyclictest: {cause}")]
    Cyclictest {
        /// What it said, or did not.
        cause: String,
    },
    /// stress-ng cannot be started.
    #[error(
        "--load {load} needs stress-ng: {cause}\n\
         remedy: install it (Debian: apt-get install stress-ng)"
    )]
    Load {
        /// The load.
        load: &'static str,
        /// Why not.
        cause: ChildError,
    },
    /// stress-ng ended while it was still needed.
    #[error(
        "--load {load}: {cause}, while it was still needed; what was measured is not under that \
         load\nremedy: see what is wrong with \"stress-ng {arguments}\", such as too little memory \
         or disk space"
    )]
    LoadEnded {
        /// The load.
        load: &'static str,
        /// How it ended.
        cause: ChildError,
        /// How it was started.
        arguments: String,
    },
    /// A thread cannot be started.
    #[error("cannot start a thread: {cause}; {}", isochrone_ipc::thread_remedy())]
    Thread {
        /// What the system says.
        cause: io::Error,
    },
    /// A thread panicked.
    #[error("{thread} panicked; this is a bug of the bench, and stderr says where")]
    Panicked {
        /// Which one.
        thread: &'static str,
    },
    /// A block of an arm panicked.
    #[error(
        "arm \"{arm}\": a block panicked{}: {message}; fix the block, or leave the arm out (--arms)",
        .place.as_ref().map(|place| format!(" at {place}")).unwrap_or_default()
    )]
    BlockPanicked {
        /// The arm: the block's type.
        arm: String,
        /// What the panic said.
        message: String,
        /// File, line and column of the source; `None` unless
        /// [`hold_panic_messages`](isochrone_runtime::hold_panic_messages) was called.
        place: Option<String>,
    },
    /// A configuration has errors.
    #[error("the configuration has errors")]
    Configuration(Findings),
    /// An engine cannot be made of a plan.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// An arm has no task to run.
    #[error("arm \"{arm}\": it has no task; give its configuration one")]
    NoTask {
        /// The arm.
        arm: String,
    },
    /// An arm failed.
    #[error("arm \"{arm}\": {cause}")]
    Arm {
        /// The arm.
        arm: String,
        /// Why.
        cause: String,
    },
    /// A file or a folder of the bench cannot be made.
    #[error("cannot write {path}: {cause}; see that there is room")]
    File {
        /// The file.
        path: String,
        /// What the system says.
        cause: io::Error,
    },
    /// A domain of the bench's own cannot be had.
    #[error(transparent)]
    Company(#[from] CompanyError),
    /// The domain cannot be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A process did not do what it should.
    #[error(transparent)]
    Process(#[from] ChildError),
    /// The thread or the process that measures said why it cannot.
    #[error("{0}")]
    Measuring(String),
    /// The thread that measures ended without a word.
    #[error("the thread that measures has ended; this is a bug, and stderr says where")]
    ThreadEnded,
    /// The process at the other end ended without a word.
    #[error("the process at the other end has ended: {cause}")]
    PeerEnded {
        /// What came instead of an answer.
        cause: String,
    },
    /// The process at the other end was not started by a bench.
    #[error("latency-peer is started by `isochrone bench latency`")]
    NoBench,
}

impl BenchError {
    /// Whether the settings are wrong, rather than something that was found while it ran.
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            Self::TooLarge { .. }
                | Self::TwoArms { .. }
                | Self::NoSuchCpu { .. }
                | Self::CyclictestPriority
                | Self::CyclictestTime { .. }
                | Self::CyclictestMissing
                | Self::Load { .. }
                | Self::NoBench
        )
    }
}
