//! Errors of recordings.

use std::io;

use mcap::McapError;

use crate::record::MAX_RECORD_BYTES;

/// Why a file cannot be read.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum RecordingReadError {
    /// The system refused.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It does not begin as every MCAP file does.
    #[error("it is no MCAP file")]
    NotMcap,
    /// Its chunks are compressed in another way.
    #[error(
        "its chunks are compressed with {name:?}; recompress it with `mcap compress --compression zstd`"
    )]
    Compression {
        /// The name of the compression.
        name: String,
    },
    /// It was written by a later version.
    #[error("it is of format {format:?}, this program reads 1; use the version that wrote it")]
    Format {
        /// The format.
        format: String,
    },
    /// Its descriptions of channels would fill the memory.
    #[error("its channels are described in more than {} MiB", MAX_RECORD_BYTES >> 20)]
    TooManyChannels,
}

/// Why a file cannot be written. It is readable up to [`Failed::good_bytes`](crate::Failed::good_bytes).
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The system refused.
    #[error("{0}")]
    Io(#[source] io::Error),
    /// More channels than a file can have.
    #[error("a file has at most 65535 channels; record fewer services, or use --split")]
    TooManyChannels,
    /// What else the format does not allow.
    #[error("{0}")]
    Format(#[source] McapError),
}

impl From<McapError> for WriteError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::Io(cause) => Self::Io(cause),
            McapError::TooManyChannels | McapError::TooManySchemas => Self::TooManyChannels,
            error => Self::Format(error),
        }
    }
}

/// Why a file cannot be repaired.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum RepairError {
    /// The damaged file.
    #[error("cannot read it: {0}")]
    Read(#[from] RecordingReadError),
    /// The repaired file.
    #[error("cannot write the repaired file: {0}")]
    Write(#[from] WriteError),
}

isochrone_model::debug_as_display!(RecordingReadError, WriteError, RepairError);
