//! Every signal of every cycle that was repeated, as CSV.

use isochrone_ipc::SignalSpec;
use isochrone_recording::{RowHead, TaskLayout};

use super::task::Task;
use crate::base::failure::Failure;
use crate::base::rows::{CYCLE, Rows, TIME};

/// The file with all signals.
pub(super) struct Output {
    rows: Rows,
    /// The columns: of each task, by its index, the names of its signals.
    columns: Vec<Vec<(String, String)>>,
    first_ns: Option<u64>,
}

impl Output {
    pub(super) fn new(rows: Rows) -> Self {
        Self { rows, columns: Vec::new(), first_ns: None }
    }

    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        self.rows.flush()
    }

    /// Writes a row for the last cycle of a task.
    pub(super) fn write(
        &mut self,
        tasks: &[Task],
        index: usize,
        head: RowHead,
    ) -> Result<(), Failure> {
        const TASK: &str = "task";
        let Some(task) = tasks.get(index) else { return Ok(()) };
        let names = |layout: &TaskLayout| -> Vec<(String, String)> {
            let signals = layout.outputs.iter().flat_map(|output| {
                let name = |signal: &SignalSpec| format!("{}.{}", output.service, signal.name);
                output.signals.iter().map(move |signal| (name(signal), signal.unit.clone()))
            });
            signals.collect()
        };
        if self.columns.get(index).is_none_or(|columns| *columns != names(&task.layout)) {
            self.columns = tasks.iter().map(|task| names(&task.layout)).collect();
            let columns = self.columns.iter().flatten();
            let columns: Vec<_> =
                columns.map(|(name, unit)| (name.as_str(), unit.as_str())).collect();
            self.rows.header(&[TIME, CYCLE, TASK], &columns)?;
        }
        let first_ns = *self.first_ns.get_or_insert(head.release_ns);
        let time_s = head.release_ns.wrapping_sub(first_ns).cast_signed() as f64 / 1e9;
        let own = task.layout.placed_outputs().flat_map(|(_, signals)| signals);
        let own = own.map(|place| task.repeated.get(place).copied());
        let before: usize = self.columns.iter().take(index).map(Vec::len).sum();
        let behind: usize = self.columns.iter().skip(index + 1).map(Vec::len).sum();
        let empty = |count| std::iter::repeat_n(None, count);
        let values = empty(before).chain(own).chain(empty(behind));
        self.rows.row_with(Some(time_s), head.cycle, std::slice::from_ref(&task.name), values)
    }
}
