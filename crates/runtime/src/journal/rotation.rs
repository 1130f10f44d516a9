//! Starting the next file of a journal, once its own is full or was renamed, removed or truncated by others.

use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use super::line::Line;
use super::tail::Tail;
use super::write::{Journal, LARGEST_BYTES, open};

/// How many old files are kept, as `FILE.1` (the latest) to `FILE.8`.
const KEPT: u32 = 8;

impl Journal {
    /// Whether the path still leads to the file that is written, and that has all that was written.
    pub(super) fn is_at_its_place(&self) -> io::Result<bool> {
        if !self.is_regular {
            return Ok(true);
        }
        let own = self.file.metadata()?;
        Ok(own.len() >= self.written
            && match fs::metadata(&self.place) {
                Ok(there) => (there.dev(), there.ino()) == (own.dev(), own.ino()),
                Err(error) => error.kind() != ErrorKind::NotFound,
            })
    }

    pub(super) fn is_full(&self) -> bool {
        self.is_regular && self.written >= self.full_at
    }

    /// Renames the full file and goes on in a new one; whether that succeeded. If not, nothing is lost.
    pub(super) fn rotate(&mut self) -> bool {
        let next = self.beside("new");
        let rotated = self.begin_next(&next);
        if let Err(error) = &rotated {
            let _ = fs::remove_file(next);
            self.full_at = self.written + LARGEST_BYTES / 16;
            let path = self.path.display();
            tracing::warn!(
                "the journal {path} grows beyond 16 MiB: no other can take its place ({error})"
            );
        }
        rotated.is_ok()
    }

    /// Begins a new file, and gives it its name when it has the header line of the run.
    fn begin_next(&mut self, next: &Path) -> io::Result<()> {
        // A killed node may have left one.
        let _ = fs::remove_file(next);
        let (file, _) = open(next)?;
        file.set_permissions(Permissions::from_mode(self.file.metadata()?.permissions().mode()))?;
        file.try_lock()?;
        let line = self.header_line();
        write_whole(&file, &line, 0)?;
        let kept = |number: u32| self.beside(&number.to_string());
        for number in (1..KEPT).rev() {
            match fs::rename(kept(number), kept(number + 1)) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        fs::rename(&self.place, kept(1))?;
        fs::rename(next, &self.place).inspect_err(|_| {
            let _ = fs::rename(kept(1), &self.place);
        })?;
        self.go_on_in(file, line.len(), 0);
        Ok(())
    }

    fn beside(&self, suffix: &str) -> PathBuf {
        let mut name = self.place.clone().into_os_string();
        name.push(format!(".{suffix}"));
        name.into()
    }

    /// Goes on in the file that has the path now, or in a new one.
    pub(super) fn go_on(&mut self) -> io::Result<()> {
        let (file, is_new) = open(&self.place)?;
        let (own, metadata) = (self.file.metadata()?, file.metadata()?);
        if !metadata.is_file() {
            return Err(io::Error::other("there is something else than a file of this name now"));
        }
        if is_new {
            file.set_permissions(Permissions::from_mode(own.permissions().mode()))?;
        }
        // A file that was only truncated is locked by this journal already.
        let is_own = (metadata.dev(), metadata.ino()) == (own.dev(), own.ino());
        let file = if is_own { self.file.try_clone()? } else { file };
        let tail =
            if is_own { Tail::read(&file, &self.path) } else { Tail::take(&file, &self.path) };
        let tail = tail.map_err(io::Error::other)?;
        let length = tail.trim(&file)?;
        self.header.run = self.header.run.max(tail.run);
        self.last_transaction = self.last_transaction.max(tail.transaction);
        self.begin_in(file, length)
    }

    /// Writes the header line of the run at the end of a file of this length, and goes on there.
    pub(super) fn begin_in(&mut self, file: File, length: u64) -> io::Result<()> {
        let line = self.header_line();
        write_whole(&file, &line, length)?;
        self.go_on_in(file, line.len(), length);
        Ok(())
    }

    fn header_line(&mut self) -> Vec<u8> {
        self.header.after_transaction = Some(self.last_transaction);
        Line::Run(self.header.clone()).text().unwrap_or_default()
    }

    fn go_on_in(&mut self, file: File, header_bytes: usize, length: u64) {
        self.file = file;
        self.written = length + header_bytes as u64;
        self.full_at = LARGEST_BYTES + header_bytes as u64;
    }
}

/// Appends a whole line to a file of this length, or nothing.
fn write_whole(mut file: &File, line: &[u8], length: u64) -> io::Result<()> {
    file.write_all(line).inspect_err(|_| {
        // This fails on files without a length, such as pipes.
        let _ = file.set_len(length);
    })
}
