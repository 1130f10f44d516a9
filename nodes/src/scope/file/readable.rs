//! Reading a file: its contents, and its rows as often as it takes.

use std::collections::HashMap;

use isochrone_recording::ClockReading;
use isochrone_scope::{Head, ObservedTask, Triggered};

use crate::base::failure::Failure;

/// The contents of a file: services or tasks with their signals, and the instant that it was captured around.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) tracks: Vec<ObservedTask>,
    /// Who wrote it.
    pub(super) node: String,
    pub(super) trigger: Option<Triggered>,
    /// From where to where it was captured, if it says.
    pub(super) begin_ns: Option<u64>,
    pub(super) end_ns: Option<u64>,
    pub(super) clock: Option<ClockReading>,
    /// What it says of the cycles around those of a task.
    pub(super) around: HashMap<String, Around>,
}

/// The cycles around those that were captured of a task.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Around {
    /// There were some before.
    pub(super) has_history: bool,
    /// The first one behind.
    pub(super) next: Option<Head>,
}

/// Is given the rows of a file: the track of each, and all of its values.
pub(super) type Each<'a> = dyn FnMut(usize, Head, &[f64]) -> Result<Enough, Failure> + 'a;

/// A file that can be read from its beginning as often as it takes.
pub(super) trait Readable {
    /// Its contents.
    fn contents(&self) -> &Contents;

    /// Its rows, until it is enough.
    fn rows(&self, each: &mut Each<'_>) -> Result<(), Failure>;

    /// Says what it lacks. Damage is a failure, for when what there is was shown.
    fn judge(&self) -> Result<(), Failure> {
        Ok(())
    }
}

/// Whether more rows are wanted.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Enough {
    Yes,
    No,
}
