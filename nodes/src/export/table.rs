//! The rows of a CSV file that is exported.

use std::path::Path;

use isochrone_ipc::SignalSpec;
use isochrone_recording::{Item, RecordedFrame, RecordedRow};

use crate::base::failure::Failure;
use crate::base::mcap_file::SendPosition;
use crate::base::rows::{CYCLE, MISSED, Rows, TIME};
use crate::subscribe::{Column, channels_of};

/// The CSV of one service or task.
pub(super) struct Table {
    rows: Rows,
    /// The columns for each frame or cycle besides its time and number.
    columns: Vec<Column>,
    /// Whether its last column says how many cycles were missed before each.
    tells_missed: bool,
    /// The names in the header row.
    header: Option<Vec<(String, String)>>,
    /// The channel of the last frame, in its file.
    channel: Option<u16>,
    /// When the first frame or cycle in the recording was due, whatever it is of.
    first_ns: Option<u64>,
    last: Option<SendPosition>,
    /// Nothing of the file was written yet.
    begins_file: bool,
    /// The file is not of later than the one before.
    goes_back: bool,
    pub(super) frames: u64,
    pub(super) lost: u64,
    pub(super) missed: u64,
}

impl Table {
    /// Creates the file; `-` is stdout.
    pub(super) fn create(
        path: &Path,
        columns: &[Column],
        tells_missed: bool,
    ) -> Result<Self, Failure> {
        Ok(Self {
            rows: Rows::create(path)?,
            columns: columns.to_vec(),
            tells_missed,
            header: None,
            channel: None,
            first_ns: None,
            last: None,
            begins_file: false,
            goes_back: false,
            frames: 0,
            lost: 0,
            missed: 0,
        })
    }

    /// Goes on with another file of the recording.
    pub(super) fn begin_file(&mut self) {
        (self.channel, self.begins_file) = (None, true);
    }

    /// Takes note of when something was due, which may be the first of all.
    pub(super) fn note_time(&mut self, item: &Item<'_>) {
        let due_ns = match item {
            Item::Frame(frame) => frame.due_ns,
            Item::Row(row) => row.head.release_ns,
            _ => return,
        };
        self.first_ns.get_or_insert(due_ns);
    }

    /// Whether the last file is not of later than the one before.
    pub(super) fn goes_back(&mut self) -> bool {
        std::mem::take(&mut self.goes_back)
    }

    /// Flushes everything for a program that reads the file meanwhile.
    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        self.rows.flush()
    }

    pub(super) fn write_frame(&mut self, frame: &RecordedFrame<'_>) -> Result<(), Failure> {
        self.head(frame.channel, || frame.carried.signals.clone())?;
        let further = self.columns.iter().map(|column| column.of_recorded(frame)).collect();
        self.write(
            frame.header.cycle,
            SendPosition::of_frame(frame),
            frame.lost,
            further,
            frame.values,
        )
    }

    pub(super) fn write_row(&mut self, row: &RecordedRow<'_>) -> Result<(), Failure> {
        self.head(row.channel, || row.layout.columns())?;
        // No other column is allowed of a task.
        let further = self.columns.iter().map(|_| row.release_unix_ns.to_string()).collect();
        self.write(row.head.cycle, SendPosition::of_row(row), row.head.lost, further, row.values)
    }

    /// Writes the names of a channel's values where they are others than before.
    fn head(&mut self, channel: u16, signals: impl Fn() -> Vec<SignalSpec>) -> Result<(), Failure> {
        if self.channel == Some(channel) {
            return Ok(());
        }
        self.channel = Some(channel);
        let signals = signals();
        let channels = channels_of(&signals, signals.len());
        let named = channels.into_iter().map(|channel| (channel.name, channel.unit));
        let mut names: Vec<(String, String)> = named.collect();
        names.extend(self.tells_missed.then(|| (MISSED.to_owned(), String::new())));
        if self.header.as_ref() != Some(&names) {
            let columns = names.iter().map(|(name, unit)| (name.as_str(), unit.as_str()));
            let columns: Vec<_> = columns.collect();
            let further = self.columns.iter().map(|column| column.as_str());
            let own: Vec<&str> = [TIME, CYCLE].into_iter().chain(further).collect();
            self.rows.header(&own, &columns)?;
            self.header = Some(names);
        }
        Ok(())
    }

    fn write(
        &mut self,
        cycle: u64,
        place: SendPosition,
        lost: u64,
        further: Vec<String>,
        values: &[f64],
    ) -> Result<(), Failure> {
        let due_ns = place.due_ns;
        let last = self.last.replace(place);
        let missed = last.map_or(0, |last| last.missed_until(place));
        let before = last.filter(|_| self.begins_file);
        self.begins_file = false;
        self.goes_back |= before.is_some_and(|before| due_ns <= before.due_ns);
        // What is in a file that was not named is not known to the next one.
        let lost = before.map_or(lost, |before| before.between(place).max(lost));
        self.frames += 1;
        self.lost = self.lost.saturating_add(lost);
        self.missed = self.missed.saturating_add(missed);
        let first_ns = *self.first_ns.get_or_insert(due_ns);
        let time_s = due_ns.wrapping_sub(first_ns).cast_signed() as f64 / 1e9;
        let missed = self.tells_missed.then_some(missed as f64);
        let values = values.iter().copied().chain(missed);
        self.rows.row_with(Some(time_s), cycle, &further, values.map(Some))
    }
}
