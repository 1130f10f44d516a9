//! Which cycles are not in a recording although nobody says that they were lost.

use std::collections::HashMap;

use isochrone_engine::escaped;
use isochrone_ipc::FrameHeader;
use isochrone_recording::{Item, RecordedFrame, RecordedRow, RowHead};

/// Where a frame or a row is in what was sent.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SendPosition {
    pub(crate) due_ns: u64,
    /// Its cycle.
    cycle: u64,
    /// How many stand before it, had none been lost.
    number: u64,
    /// Cycles that were missed up to it.
    missed: u64,
    /// The term of its sender, whose numbers it has.
    run: u64,
}

impl SendPosition {
    pub(crate) fn of_frame(frame: &RecordedFrame<'_>) -> Self {
        let FrameHeader { cycle, sequence, missed, term, .. } = frame.header;
        Self { due_ns: frame.due_ns, cycle, number: sequence, missed, run: term }
    }

    pub(crate) fn of_row(row: &RecordedRow<'_>) -> Self {
        let RowHead { cycle, release_ns, missed, .. } = row.head;
        let number = cycle.saturating_sub(missed);
        Self { due_ns: release_ns, cycle, number, missed, run: 0 }
    }

    /// How many there were between this one and a later one; none is known of another run.
    pub(crate) fn between(self, next: Self) -> u64 {
        let numbers = next.number.saturating_sub(self.number).saturating_sub(1);
        if self.run == next.run { numbers } else { 0 }
    }

    /// How many cycles were missed between this one and a later one; none is known of another run.
    pub(crate) fn missed_until(self, next: Self) -> u64 {
        if self.run == next.run { next.missed.saturating_sub(self.missed) } else { 0 }
    }
}

/// Which cycles are not there.
#[derive(Debug, Default)]
pub(crate) struct Gaps {
    /// The last cycle of each service or task.
    last: HashMap<String, SendPosition>,
    cycles: u64,
    /// The node went on from a retained state.
    goes_on: bool,
}

impl Gaps {
    /// Records the next frame of a recording.
    pub(crate) fn note(&mut self, item: &Item<'_>) {
        let (name, place, lost) = match item {
            Item::Frame(frame) => {
                (&frame.carried.service, SendPosition::of_frame(frame), frame.lost)
            }
            Item::State(_) => {
                self.goes_on = true;
                return;
            }
            Item::Row(row) => (&row.layout.task, SendPosition::of_row(row), row.head.lost),
            _ => return,
        };
        let between = match self.last.get_mut(name) {
            Some(last) => std::mem::replace(last, place).between(place),
            None => {
                self.last.insert(name.clone(), place);
                // The recording of a node begins with its first cycle, which has the number 0 unless it goes on.
                let begins = matches!(item, Item::Row(_)) && !self.goes_on;
                if begins { place.number } else { 0 }
            }
        };
        self.cycles = self.cycles.saturating_add(between.saturating_sub(lost));
    }

    /// Cycles and frames that are not there, and that nobody says were lost.
    pub(crate) fn cycles(&self) -> u64 {
        self.cycles
    }

    /// The newest cycle that is there, in words.
    pub(crate) fn newest(&self) -> Option<String> {
        let (name, place) = self.last.iter().max_by_key(|(_, place)| place.due_ns)?;
        Some(format!("cycle {} of \"{}\"", place.cycle, escaped(name)))
    }
}
