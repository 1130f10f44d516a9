//! Closing a file that its writer did not close.

use std::io::{Read, Seek, Write};

use mcap::records::{Metadata, Record};
use mcap::write::NoSeek;
use mcap::{Attachment, McapError};

use crate::condition::PART;
use crate::records::Records;
use crate::writer::options;
use crate::{FileCondition, MAX_RECORD_BYTES, RecordingReadError, RepairError, WriteError};

/// The result of a repair.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Repaired {
    /// Messages in the new file.
    pub messages: u64,
    /// In what state the old file was.
    pub condition: FileCondition,
}

/// Copies what can be read of an MCAP file, whoever wrote it, into a new one, and closes that.
///
/// Channels, schemas and times stay; chunks are made anew. If it was not all that there had been, the copy says
/// so: nobody shall take it for the whole.
///
/// # Errors
/// One of the two cannot be read or written.
pub fn repair<W: Write>(file: impl Read + Seek, out: W) -> Result<(Repaired, W), RepairError> {
    let mut records = Records::open_with_index(file)?;
    let mut new = options().create(NoSeek::new(out)).map_err(WriteError::from)?;
    let mut messages = 0;
    let mut described_bytes = 0;
    while let Some(record) = records.next_record()? {
        described_bytes += match &record {
            Record::Schema { data, .. } => data.len(),
            Record::Channel(it) => {
                it.metadata.iter().map(|(key, value)| key.len() + value.len()).sum()
            }
            _ => 0,
        };
        if described_bytes > MAX_RECORD_BYTES {
            drop(new.into_inner());
            return Err(RecordingReadError::too_many_channels().into());
        }
        let copied = match record {
            Record::Schema { header, data } => {
                new.add_schema_with_id(header.id, &header.name, &header.encoding, &data).map(drop)
            }
            Record::Channel(it) => new
                .add_channel_with_id(
                    it.id,
                    it.schema_id,
                    &it.topic,
                    &it.message_encoding,
                    &it.metadata,
                )
                .map(drop),
            Record::Message { header, data } => {
                let written = new.write_to_known_channel(&header, &data);
                messages += u64::from(written.is_ok());
                written
            }
            Record::Attachment { header, data, .. } => new.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            }),
            Record::Metadata(metadata) => new.write_metadata(&metadata),
            _ => Ok(()),
        };
        match copied {
            Ok(()) => {}
            Err(error @ (McapError::Io(_) | McapError::AttemptedWriteAfterFailure)) => {
                // Not to be closed once more.
                drop(new.into_inner());
                return Err(WriteError::from(error).into());
            }
            // What contradicts the rest of its file.
            Err(error) => records.note(error.to_string()),
        }
    }
    let condition = records.condition().clone();
    if !condition.is_whole() && !condition.is_of_part {
        let is_closed = condition.is_closed.to_string();
        let about = [
            ("is_closed", is_closed),
            ("damaged", condition.damaged.to_string()),
            ("unread_bytes", condition.unread_bytes.to_string()),
        ];
        let metadata = about.map(|(key, value)| (key.to_owned(), value)).into();
        let written = new.write_metadata(&Metadata { name: PART.into(), metadata });
        if let Err(error) = written {
            drop(new.into_inner());
            return Err(WriteError::from(error).into());
        }
    }
    match new.finish() {
        Ok(_) => Ok((Repaired { messages, condition }, new.into_inner().into_inner())),
        Err(error) => Err(WriteError::from(error).into()),
    }
}
