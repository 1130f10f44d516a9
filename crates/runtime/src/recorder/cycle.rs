//! The cycle's side of a recording.

use isochrone_engine::TaskEngine;
use isochrone_recording::TaskLayout;

use crate::records::Cycle;
use crate::rows::{self, RowReceiver, RowSender};

/// The time that a ring holds, unless that takes too much memory.
const RING_NS: u64 = 4_000_000_000;
const RING_BYTES: usize = 64 << 20;

/// Copies the recorded values of each cycle of a task. Nothing here allocates or frees.
pub(crate) struct Recorder {
    rows: RowSender,
    row: Box<[f64]>,
}

/// The other end: the rows of a task while it has one configuration.
pub(crate) struct Capture {
    pub(crate) layout: TaskLayout,
    pub(crate) rows: RowReceiver,
}

impl Recorder {
    /// Both ends for a task.
    pub(crate) fn new(layout: TaskLayout) -> (Box<Self>, Capture) {
        let width = layout.len();
        let count = rows::rows_within(RING_NS, layout.period_ns, width, RING_BYTES);
        let (sender, rows) = rows::ends(width, count);
        let row = vec![0.0; width].into();
        (Box::new(Self { rows: sender, row }), Capture { layout, rows })
    }

    /// Copies the row of a cycle, unless the writer has ended. For the slack.
    #[inline]
    pub(crate) fn take(&mut self, engine: &TaskEngine, cycle: &Cycle) {
        if !self.rows.is_abandoned() {
            engine.read_row(&mut self.row);
            self.rows.push(cycle, self.row.iter().copied());
        }
    }
}
