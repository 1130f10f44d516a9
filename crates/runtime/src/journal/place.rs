//! Whether the file that is written is still the one at its path, and what to do if it is not: others rename,
//! remove and truncate files while a node runs for months.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;

use super::line::Line;
use super::write::{Journal, open};

/// What became of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// It is where it was.
    Same,
    /// There is another one at its path, or none.
    Elsewhere,
    /// It is shorter than what was written.
    Cut,
}

impl Journal {
    /// Sees to it that the file at the path has what was written of the run. One that was renamed or removed
    /// is written anew with all of the run so far, so that each can be repeated; what was cut away is lost.
    ///
    /// # Errors
    /// There is something else at the path, or it cannot be written.
    pub(super) fn keep_place(&mut self) -> io::Result<()> {
        if !self.is_regular {
            return Ok(());
        }
        match self.place()? {
            Place::Same => Ok(()),
            Place::Elsewhere => self.reopen(),
            Place::Cut => self.follow_cut(),
        }
    }

    fn place(&self) -> io::Result<Place> {
        let own = self.file.metadata()?;
        match fs::metadata(&self.path) {
            Ok(there) if (there.dev(), there.ino()) != (own.dev(), own.ino()) => {
                Ok(Place::Elsewhere)
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(Place::Elsewhere),
            // What cannot be looked at now may be there.
            Ok(_) | Err(_) if own.len() >= self.written => Ok(Place::Same),
            Ok(_) | Err(_) => Ok(Place::Cut),
        }
    }

    /// Goes on in a file of the old name, which begins with what this run has written so far.
    fn reopen(&mut self) -> io::Result<()> {
        let mode = self.file.metadata()?.permissions().mode();
        let (file, is_new) = open(&self.path)?;
        let mut new = self.successor(file)?;
        new.lock().map_err(io::Error::other)?;
        let (followed, is_cut) = (new.follow().map_err(io::Error::other), self.is_cut());
        let is_followed = followed.is_ok();
        let begun = followed.and_then(|()| {
            if is_new {
                new.file.set_permissions(fs::Permissions::from_mode(mode))?;
            }
            new.header.run = new.header.run.max(self.header.run);
            new.header.is_cut |= is_cut;
            new.count_on(self);
            new.write_header()?;
            if is_cut { Ok(()) } else { new.copy_run(self) }
        });
        if let Err(error) = begun {
            if is_new {
                // An empty one is no journal.
                let _ = fs::remove_file(&self.path);
            } else if is_followed {
                new.truncate(new.run_begins);
            }
            return Err(error);
        }
        if is_cut {
            tracing::error!("{}", new.lost_words());
            self.drop_begun_line();
        } else {
            tracing::warn!(
                "the journal {} was renamed or removed; another file of this name goes on, with all of run {} \
                 so far",
                self.path.display(),
                new.header.run
            );
            // Gives back the room that is reserved for it.
            self.truncate(self.written);
        }
        self.hand_over(new);
        Ok(())
    }

    /// Goes on counting transactions after those of the file before.
    fn count_on(&mut self, from: &Self) {
        let before = match self.header.is_cut {
            // Those of the run that are lost are before what follows.
            true => from.last_transaction,
            false => from.header.after_transaction.unwrap_or_default(),
        };
        self.header.after_transaction = Some(before.max(self.last_transaction));
        self.last_transaction = self.last_transaction.max(from.last_transaction);
    }

    /// Adds what another file has of its run after the header.
    fn copy_run(&mut self, from: &Self) -> io::Result<()> {
        // It was opened to be written, and may have no name any more.
        let mut old =
            File::open(Path::new("/proc/self/fd").join(from.file.as_raw_fd().to_string()))?;
        let length = from.written.saturating_sub(from.lines_begin);
        old.seek(SeekFrom::Start(from.lines_begin))?;
        let copied = io::copy(&mut old.take(length), &mut self.file)?;
        self.written += copied;
        if copied == length { Ok(()) } else { Err(ErrorKind::UnexpectedEof.into()) }
    }

    /// Goes on in a file of which an end was cut away: the lines from before are lost.
    fn follow_cut(&mut self) -> io::Result<()> {
        let mut new = self.successor(self.file.try_clone()?)?;
        let begun = new.follow().map_err(io::Error::other);
        new.header.run = new.header.run.max(self.header.run);
        new.header.is_cut = true;
        new.count_on(self);
        begun?;
        if let Err(error) = new.write_header() {
            // What is written of it is no line.
            new.truncate(new.run_begins);
            return Err(error);
        }
        tracing::error!("{}", new.lost_words());
        self.drop_begun_line();
        self.hand_over(new);
        Ok(())
    }

    /// Goes on in another file, which has all that was written.
    fn hand_over(&mut self, mut new: Self) {
        new.waiting = std::mem::take(&mut self.waiting);
        new.has_begun_line = self.has_begun_line;
        new.has_ended = false;
        self.has_ended = true;
        *self = new;
    }

    /// Whether an end of the file was cut away, and what is left could not be followed: it may be another's.
    pub(super) fn is_cut(&self) -> bool {
        self.is_regular && self.file.metadata().is_ok_and(|own| own.len() < self.written)
    }

    /// What the file lacks for good, as a sentence without its end.
    pub(super) fn lost_words(&self) -> String {
        let (path, run) = (self.path.display(), self.header.run);
        format!(
            "the journal {path} was truncated while the node ran: what operators did before is lost, and \
             run {run} in it cannot be repeated"
        )
    }

    /// Writes that the run begins, at the end of what there is.
    pub(super) fn write_header(&mut self) -> io::Result<()> {
        let line = Line::Run(self.header.clone()).text().unwrap_or_default();
        self.run_begins = self.written;
        self.file.write_all(&line)?;
        self.written += line.len() as u64;
        self.lines_begin = self.written;
        Ok(())
    }
}
