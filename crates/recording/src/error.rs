//! Errors of recordings.

use std::io;

use mcap::McapError;

use crate::record::MAX_RECORD_BYTES;

/// Why a file cannot be read: what the system says or what the file is, and what to do about it.
#[derive(thiserror::Error)]
#[error("{0}")]
pub struct RecordingReadError(pub(crate) String);

impl RecordingReadError {
    /// Its descriptions of channels would fill the memory.
    pub(crate) fn too_many_channels() -> Self {
        Self(format!("its channels are described in more than {} MiB", MAX_RECORD_BYTES >> 20))
    }
}

impl From<io::Error> for RecordingReadError {
    fn from(error: io::Error) -> Self {
        Self(error.to_string())
    }
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
