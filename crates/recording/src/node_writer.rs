//! Writing the recording of a node.

use std::borrow::Cow;
use std::io::Write;

use mcap::Attachment;

use crate::writer::JOURNAL_TOPIC;
use crate::{
    ChannelId, ClockReading, Mark, RecordedEntry, RecordedNode, RowHead, TaskLayout, WriteError,
    Writer, definitions, encoded,
};

/// The attachment with the configuration that a node was started with. A closed file has it twice.
pub(crate) const CONFIGURATION: &str = "configuration.toml";

/// The attachment with the state that a node went on with.
pub(crate) const STATE: &str = "node.state";

impl<W: Write> Writer<W> {
    /// Begins the recording of a node that was started with this text of a configuration.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn create_for_node(
        out: W,
        clock: ClockReading,
        node: &RecordedNode,
        configuration: &str,
    ) -> Result<Self, WriteError> {
        let mut writer = Self::create(out, clock)?;
        let metadata = node.metadata();
        let attachment = Attachment {
            log_time: clock.unix_ns,
            create_time: clock.unix_ns,
            name: CONFIGURATION.into(),
            media_type: "application/toml".into(),
            data: Cow::Owned(configuration.as_bytes().to_vec()),
        };
        writer.file.write_metadata(&metadata)?;
        writer.file.attach(&attachment)?;
        writer.written_twice = Some((metadata, attachment));
        writer.note_progress(0);
        Ok(writer)
    }

    /// Writes the state that the node goes on with, as the file that retains it has it; before the first row.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn attach_state(&mut self, clock: ClockReading, state: Vec<u8>) -> Result<(), WriteError> {
        self.file.attach(&Attachment {
            log_time: clock.unix_ns,
            create_time: clock.unix_ns,
            name: STATE.into(),
            media_type: "application/octet-stream".into(),
            data: Cow::Owned(state),
        })?;
        Ok(())
    }

    /// Adds a channel for a task. After an online change it gets another one, of the same topic.
    ///
    /// # Errors
    /// The file has too many channels, or cannot be written.
    pub fn add_task(&mut self, layout: &TaskLayout) -> Result<ChannelId, WriteError> {
        let spelling = layout.spelling();
        self.add_channel(&layout.path(), &spelling, &layout.metadata(&spelling.fields))
    }

    /// Writes a row. One with other than as many values as its layout has columns gets NaN for those that
    /// are missing.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_row(
        &mut self,
        channel: ChannelId,
        head: &RowHead,
        values: &[f64],
    ) -> Result<(), WriteError> {
        let times = (head.release_ns, head.end_ns);
        self.write_values(channel, values, head.cycle as u32, times, |values, message| {
            encoded::write_row(head, values, message);
        })
    }

    /// Writes that rows of a task were lost that no row follows. Rows that are lost before another one are
    /// in [its head](RowHead::lost).
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn mark_lost_rows(
        &mut self,
        layout: &TaskLayout,
        cycle: u64,
        count: u64,
        time_ns: u64,
    ) -> Result<(), WriteError> {
        let service = layout.path();
        let text = format!("{count} cycles of {service} up to {cycle} are not in the recording");
        self.mark(&Mark { time_ns, cycle, count, kind: Mark::LOST.into(), service, text })
    }

    /// Writes an entry of the node's journal.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_entry(&mut self, entry: &RecordedEntry) -> Result<(), WriteError> {
        let channel_id = match self.journal {
            Some(id) => id,
            None => {
                let id = self.add_other("Entry", definitions::ENTRY, JOURNAL_TOPIC)?;
                *self.journal.insert(id)
            }
        };
        self.write_other(channel_id, entry.time_ns, &encoded::write_entry(entry))
    }
}
