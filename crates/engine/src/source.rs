//! The text of a configuration, whatever a file may turn out to be.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

use sha2::{Digest, Sha256};

/// The text of a configuration and the name to show for it.
#[derive(Clone, Debug)]
pub struct Source {
    /// Path of the file, or what stands in its place.
    pub name: String,
    /// Content.
    pub text: Arc<str>,
}

/// Longest configuration that is read, in bytes. A million blocks are a few lines (`count`), so a
/// file beyond this is no configuration.
pub const MAX_BYTES: u64 = 16 * 1024 * 1024;

/// What a file is read as: its longest size, and the words of the errors about it.
#[derive(Debug)]
pub struct FileKind {
    /// What it is, such as "configuration".
    pub name: &'static str,
    /// The language that it is written in, such as "TOML".
    pub format: &'static str,
    /// Longest that is read, in bytes.
    pub max_bytes: u64,
    /// What makes one that is too long shorter: the end of a sentence, or nothing.
    pub shorten: &'static str,
    /// What one that is empty lacks: the end of a sentence.
    pub needs: &'static str,
}

static CONFIGURATION: FileKind = FileKind {
    name: "configuration",
    format: "TOML",
    max_bytes: MAX_BYTES,
    shorten: "; blocks of one kind go into one entry with `count`",
    needs: "needs at least [node] and one [[task]]",
};

/// Why a file could not be read.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused.
    #[error("cannot read {path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// It is a directory.
    #[error("{path} is a directory; name the {} file in it", .kind.name)]
    Directory {
        /// The directory.
        path: String,
        /// What a file was read as.
        kind: &'static FileKind,
    },
    /// It is a pipe, a socket or a device, which may have no end or never begin.
    #[error("{path} is not a file but a pipe, socket or device; write the {} to a file", .kind.name)]
    NotAFile {
        /// The path.
        path: String,
        /// What it was read as.
        kind: &'static FileKind,
    },
    /// It is longer than its kind may be.
    #[error("{path} is larger than {} MiB, which no {} is{}", .kind.max_bytes >> 20, .kind.name, .kind.shorten)]
    TooLarge {
        /// The file.
        path: String,
        /// What it was read as.
        kind: &'static FileKind,
    },
    /// It is not UTF-8.
    #[error("{path} is not a text file: byte {offset} is not UTF-8; a {} is {}", .kind.name, .kind.format)]
    NotText {
        /// The file.
        path: String,
        /// First byte that is not UTF-8.
        offset: usize,
        /// What it was read as.
        kind: &'static FileKind,
    },
    /// It has no content.
    #[error("{path} is empty; a {} {}", .kind.name, .kind.needs)]
    Empty {
        /// The file.
        path: String,
        /// What it was read as.
        kind: &'static FileKind,
    },
}

/// Reads the text of a file. Whatever the path names, this ends: pipes, devices and files beyond what
/// their kind may be are refused.
///
/// # Errors
/// It is no file, too long, empty, or no text.
pub fn read_text(path: &Path, kind: &'static FileKind) -> Result<String, ReadError> {
    let name = || path.display().to_string();
    let io = |source| ReadError::Io { path: name(), source };
    // Asked before it is opened: opening a pipe waits for somebody to write to it.
    let metadata = std::fs::metadata(path).map_err(io)?;
    if metadata.is_dir() {
        return Err(ReadError::Directory { path: name(), kind });
    }
    if !metadata.is_file() {
        return Err(ReadError::NotAFile { path: name(), kind });
    }
    let file = File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    file.take(kind.max_bytes + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > kind.max_bytes {
        return Err(ReadError::TooLarge { path: name(), kind });
    }
    match String::from_utf8(bytes) {
        Ok(text) if text.trim().is_empty() => Err(ReadError::Empty { path: name(), kind }),
        Ok(text) => Ok(text),
        Err(error) => {
            let offset = error.utf8_error().valid_up_to();
            Err(ReadError::NotText { path: name(), offset, kind })
        }
    }
}

impl Source {
    /// A configuration that is in memory.
    pub fn new(name: impl Into<String>, text: impl Into<Arc<str>>) -> Self {
        Self { name: name.into(), text: text.into() }
    }

    /// SHA-256 of the text, as `sha256sum` writes that of the file: 64 hexadecimal digits.
    pub fn sha256(&self) -> String {
        Sha256::digest(self.text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Line and column, both from 1, of a byte offset; columns count characters.
    pub fn position(&self, offset: usize) -> (usize, usize) {
        let before = self.text.get(..offset).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let column = before.get(line_start..).unwrap_or_default().chars().count() + 1;
        (before.matches('\n').count() + 1, column)
    }

    /// [`position`](Self::position) of ascending offsets, in one pass over the text.
    pub fn positions(
        &self,
        offsets: impl IntoIterator<Item = usize>,
    ) -> impl Iterator<Item = (usize, usize)> {
        let (mut line, mut line_start, mut seen) = (1, 0, 0);
        offsets.into_iter().map(move |offset| {
            let between = self.text.get(seen..offset).unwrap_or_default();
            line += between.matches('\n').count();
            line_start = between.rfind('\n').map_or(line_start, |newline| seen + newline + 1);
            seen = seen.max(offset);
            let before = self.text.get(line_start..offset).unwrap_or_default();
            (line, before.chars().count() + 1)
        })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`read_text`], of at most [`MAX_BYTES`].
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let text = read_text(path, &CONFIGURATION)?;
        Ok(Self { name: path.display().to_string(), text: text.into() })
    }
}

isochrone_model::debug_as_display!(ReadError);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_of_a_text_is_that_of_its_file() {
        // printf 'abc' | sha256sum
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(Source::new("n.toml", "abc").sha256(), expected);
    }
}
