//! The rows of the table.

use clap::ValueEnum;

use super::moments::Moments;
use super::turn::{Stage, Turn};
use super::{exhaustion, kills, state, stop, takeover};
use crate::Failure;

/// One kind of fault, in the order of their turns.
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
