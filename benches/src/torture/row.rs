//! The rows of the table, and what a turn of one comes to.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::ValueEnum;

use super::moments::Moments;
use super::{exhaustion, kills, state, stop, takeover};
use crate::Failure;

/// One kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Row {
    /// The holder of a redundant node is killed.
    Takeover,
    /// One of two redundant processes is stopped for a while (SIGSTOP).
    Stop,
    /// Peers of a node are killed.
    Kills,
    /// A node is killed while it writes its state, and state files are damaged.
    State,
    /// There is too little of something: shared memory, descriptors, disk, memory to lock, /proc.
    Exhaustion,
}

impl Row {
    /// All of them, in the order of their turns.
    pub const ALL: &[Self] =
        &[Self::Takeover, Self::Stop, Self::Kills, Self::State, Self::Exhaustion];

    /// Its name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// What its faults are, for the number of them.
    pub(super) fn faults(self) -> &'static str {
        match self {
            Self::Takeover => "kills of the holder (kill -9)",
            Self::Stop => "stops of one of the two (SIGSTOP, SIGCONT)",
            Self::Kills => "kills of peers (kill -9)",
            Self::State => "kills in a write, damaged files",
            Self::Exhaustion => "starts and runs with too little",
        }
    }

    /// What must hold.
    pub(super) fn must_hold(self) -> &'static [&'static str] {
        match self {
            Self::Takeover => &[
                "the standby takes over within 3 releases that it met",
                "the ramp moves by at most one step with each frame",
                "no cycle is published twice, none goes back",
                "every value whose set was acknowledged is there",
            ],
            Self::Stop => &[
                "no reader sees term, cycle or ramp go back",
                "who was stopped stands by when it goes on",
                "every value whose set was acknowledged is there",
            ],
            Self::Kills => &[
                "the others go on, and new peers have frames soon",
                "files, descriptors and memory do not grow",
            ],
            Self::State => &[
                "a start goes on from a whole state, or",
                "refuses with a sentence; never from half of one",
            ],
            Self::Exhaustion => &[
                "a start works or says what to do",
                "a node that runs goes on; no frame lost or torn",
            ],
        }
    }

    /// Plays a turn.
    ///
    /// # Errors
    /// What it needs cannot be had, such as a folder for its domain.
    pub fn turn(self, stage: &Stage, seed: u64) -> Result<Turn, Failure> {
        let mut turn = Turn::default();
        let moments = &mut Moments::new(seed);
        match self {
            Self::Takeover => takeover::play(stage, moments, &mut turn),
            Self::Stop => stop::play(stage, moments, &mut turn),
            Self::Kills => kills::play(stage, moments, &mut turn),
            Self::State => state::play(stage, moments, &mut turn),
            Self::Exhaustion => exhaustion::play(stage, seed, &mut turn),
        }?;
        if stage.is_due() {
            // What was interrupted proves nothing.
            turn.wrong.clear();
        }
        Ok(turn)
    }
}

/// What all turns need.
#[derive(Debug, Clone)]
pub struct Stage {
    /// The program `isochrone`.
    pub program: PathBuf,
    /// How soon peers that were started again must have frames.
    pub within: Duration,
    /// How many faults a turn does.
    pub faults: u64,
    /// Set when the program is to end.
    pub stop: Arc<AtomicBool>,
}

impl Stage {
    /// Whether the program is to end.
    pub(super) fn is_due(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// What a turn came to.
#[derive(Debug, Clone, Default)]
pub struct Turn {
    /// How many faults were done.
    pub done: u64,
    /// What did not hold.
    pub wrong: Vec<String>,
    /// What cannot be tested here, and why.
    pub untested: Vec<String>,
    /// What was measured, with the unit: the most of each name is shown.
    pub measured: Vec<(&'static str, u64)>,
}

impl Turn {
    /// Keeps what is wrong.
    pub(super) fn keep(&mut self, wrong: impl IntoIterator<Item = String>) {
        self.wrong.extend(wrong);
    }

    /// Keeps what is wrong with one fault; what came of it otherwise.
    pub(super) fn take<T>(&mut self, found: Result<T, String>) -> Option<T> {
        found.map_err(|wrong| self.wrong.push(wrong)).ok()
    }
}
