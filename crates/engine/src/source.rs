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

/// Why a file could not be read: the file, what is wrong with it, and what it should be.
#[derive(thiserror::Error)]
#[error("{0}")]
pub struct ReadError(String);

/// Reads the text of a file. Whatever the path names, this ends: pipes, devices and files beyond what
/// their kind may be are refused.
///
/// # Errors
/// It is no file, too long, empty, or no text.
pub fn read_text(path: &Path, kind: &FileKind) -> Result<String, ReadError> {
    let &FileKind { name, format, max_bytes, shorten, needs } = kind;
    let refused = |cause: io::Error| ReadError(format!("cannot read {}: {cause}", path.display()));
    let wrong = |what: String| Err(ReadError(format!("{} is {what}", path.display())));
    // Asked before it is opened: opening a pipe waits for somebody to write to it.
    let metadata = std::fs::metadata(path).map_err(refused)?;
    if metadata.is_dir() {
        return wrong(format!("a directory; name the {name} file in it"));
    }
    if !metadata.is_file() {
        return wrong(format!(
            "not a file but a pipe, socket or device; write the {name} to a file"
        ));
    }
    let file = File::open(path).map_err(refused)?;
    let mut bytes = Vec::new();
    file.take(max_bytes + 1).read_to_end(&mut bytes).map_err(refused)?;
    if bytes.len() as u64 > max_bytes {
        let mib = max_bytes >> 20;
        return wrong(format!("larger than {mib} MiB, which no {name} is{shorten}"));
    }
    match String::from_utf8(bytes) {
        Ok(text) if text.trim().is_empty() => wrong(format!("empty; a {name} {needs}")),
        Ok(text) => Ok(text),
        Err(error) => {
            let offset = error.utf8_error().valid_up_to();
            wrong(format!("not a text file: byte {offset} is not UTF-8; a {name} is {format}"))
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
