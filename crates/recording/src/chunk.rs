//! Opening chunks.

use mcap::records::{ChunkHeader, op};

use crate::{MAX_RECORD_BYTES, RecordingReadError};

/// Unpacks a chunk; the inner error says why it is damaged.
pub(crate) fn unpack(
    zstd: &mut zstd::bulk::Decompressor<'_>,
    header: &ChunkHeader,
    data: &[u8],
    chunk: &mut Vec<u8>,
) -> Result<Result<(), String>, RecordingReadError> {
    let size = header.uncompressed_size;
    let size = match usize::try_from(size) {
        Ok(size) if size <= MAX_RECORD_BYTES => size,
        _ => return Ok(Err(format!("a chunk of {size} bytes"))),
    };
    match header.compression.as_str() {
        "" => chunk.extend_from_slice(data),
        "zstd" => {
            chunk.reserve(size);
            if let Err(error) = zstd.decompress_to_buffer(data, chunk) {
                return Ok(Err(format!("a chunk that cannot be decompressed: {error}")));
            }
        }
        // The other one that MCAP knows. What is none of them is damaged.
        "lz4" => {
            let what = "its chunks are compressed with \"lz4\"; recompress it with `mcap compress --compression zstd`";
            return Err(RecordingReadError(what.into()));
        }
        name => return Ok(Err(format!("a chunk with an unknown compression ({name:?})"))),
    }
    let crc = header.uncompressed_crc;
    if chunk.len() != size || crc != 0 && crc != crc32fast::hash(chunk) {
        return Ok(Err("a chunk whose checksum is wrong".into()));
    }
    Ok(Ok(()))
}

/// Whether such a record may stand in a chunk.
pub(crate) fn may_hold(opcode: u8) -> bool {
    matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | 0x80..)
}
