//! The file that is written, or one after the other.

use std::borrow::Cow;
use std::fs::{self, DirEntry};
use std::path::{Path, PathBuf};
use std::time::Instant;

use isochrone_recording::{Carried, ChannelId, Failed, Frame, Mark, WriteError, Writer};

use isochrone_runtime::{RecordingFile, read_clocks};
use isochrone_timing::units::counted;

use super::split::Split;
use crate::failure::Failure;
use crate::recording_file;
use crate::result_file::ResultFile;

/// Where frames are written.
pub(super) struct Output {
    path: PathBuf,
    split: Option<Split>,
    /// The file that nothing was written to yet.
    opened: Option<ResultFile>,
    writer: Option<Writer<ResultFile>>,
    begun: Instant,
    pub(super) files: Vec<WrittenFile>,
}

/// A file, and what is in it so far.
#[derive(Debug, Clone, serde::Serialize)]
pub(super) struct WrittenFile {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    pub(super) frames: u64,
}

/// A channel of one of the files.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    file: usize,
    channel: ChannelId,
}

/// A file that could not be written any more.
#[derive(Debug)]
pub(super) struct Broken {
    path: PathBuf,
    error: WriteError,
    frames: u64,
}

impl Broken {
    /// What to say; `unwritten` frames were received and are in no file.
    pub(super) fn failure(&self, unwritten: u64) -> Failure {
        let Self { path, error, frames } = self;
        let path = path.display();
        let way_out = match frames {
            0 => String::new(),
            _ => format!(". To close the file, use `isochrone export {path} -o closed.mcap`"),
        };
        let (frames, unwritten) = (counted(*frames, "frame"), counted(unwritten, "frame"));
        Failure::found(format!(
            "cannot write {path}: {error}; the recording ends here, with {frames} in this file, and {unwritten} \
             received since are lost{way_out}"
        ))
    }
}

impl Output {
    /// Opens the first file, so that nothing is recorded for nothing.
    pub(super) fn open(path: &Path, split: Option<Split>) -> Result<Self, Failure> {
        let mut output = Self {
            path: path.to_owned(),
            split,
            opened: None,
            writer: None,
            begun: Instant::now(),
            files: Vec::new(),
        };
        output.refuse_series()?;
        output.opened = Some(ResultFile::open(&output.path_of(1))?);
        Ok(output)
    }

    /// Refuses to begin a series of files where one is: what is left of that would be taken for a part of this.
    fn refuse_series(&self) -> Result<(), Failure> {
        let (first, Some(_)) = (self.path_of(1), self.split) else { return Ok(()) };
        let folder = match first.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        // What is wrong with a folder that cannot be read is said where the file is opened.
        let names = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
        let number = |entry: DirEntry| self.number_of(&entry.file_name().to_string_lossy());
        let Some(last) = names.filter_map(number).max() else { return Ok(()) };
        Err(Failure::usage(format!(
            "there is a series of this name already, up to {}, and the new files would mix with it; choose \
             another name, or remove the old files",
            self.path_of(last).display()
        )))
    }

    /// Where a layout is written, for this file. Begins the file if there is none.
    pub(super) fn place(&mut self, carried: &Carried) -> Result<Place, Broken> {
        let writer = self.writer()?;
        let added = writer.add(carried);
        let channel = self.checked(added)?;
        Ok(Place { file: self.files.len(), channel })
    }

    /// Whether frames can still go there.
    pub(super) fn has(&self, place: Place) -> bool {
        self.writer.is_some() && place.file == self.files.len()
    }

    pub(super) fn write(&mut self, place: Place, frame: &Frame<'_>) -> Result<(), Broken> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        if let Some(file) = self.files.last_mut() {
            file.frames += 1;
        }
        let written = writer.write(place.channel, frame);
        self.checked(written)
    }

    pub(super) fn mark(&mut self, mark: &Mark) -> Result<(), Broken> {
        let writer = self.writer()?;
        let marked = writer.mark(mark);
        self.checked(marked)
    }

    /// Closes a file that is long enough. The next one begins with its first frame.
    pub(super) fn split(&mut self) -> Result<(), Broken> {
        let is_full = match (self.split, &self.writer) {
            (Some(Split::After(time)), Some(_)) => self.begun.elapsed() >= time,
            (Some(Split::Size(bytes)), Some(writer)) => writer.bytes() >= bytes,
            _ => false,
        };
        if is_full { self.close() } else { Ok(()) }
    }

    /// Hands everything to the system.
    pub(super) fn flush(&mut self) -> Result<(), Broken> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let flushed = writer.follow(read_clocks()).and_then(|()| writer.flush());
        let bytes = writer.bytes();
        if let Some(file) = self.files.last_mut() {
            file.bytes = bytes;
        }
        self.checked(flushed)
    }

    /// Closes the file.
    pub(super) fn close(&mut self) -> Result<(), Broken> {
        // So that the length of the file is known.
        self.flush()?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        match writer.finish() {
            Ok(_) => Ok(()),
            Err((error, failed)) => Err(self.broken(error, failed)),
        }
    }

    /// The file that is written next, or now.
    pub(super) fn next_file(&self) -> PathBuf {
        self.path_of(self.files.len().max(1))
    }

    /// Frames in all files.
    pub(super) fn frames(&self) -> u64 {
        self.files.iter().map(|file| file.frames).sum()
    }

    /// Bytes in all files.
    pub(super) fn bytes(&self) -> u64 {
        self.files.iter().map(|file| file.bytes).sum()
    }

    fn writer(&mut self) -> Result<&mut Writer<ResultFile>, Broken> {
        let writer = match self.writer.take() {
            Some(writer) => writer,
            None => self.begin()?,
        };
        Ok(self.writer.insert(writer))
    }

    /// Begins the next file.
    fn begin(&mut self) -> Result<Writer<ResultFile>, Broken> {
        let path = self.path_of(self.files.len() + 1);
        let begin = |opened: Option<ResultFile>| {
            let file = opened.map_or_else(|| ResultFile::create(&path), Ok);
            let mut file = file.map_err(WriteError::Io)?;
            recording_file::keep_unclosed(&mut file)?;
            Writer::create(file, read_clocks())
        };
        match begin(self.opened.take()) {
            Ok(writer) => {
                self.begun = Instant::now();
                self.files.push(WrittenFile { path, bytes: writer.bytes(), frames: 0 });
                Ok(writer)
            }
            Err(error) => Err(Broken { path, error, frames: 0 }),
        }
    }

    fn checked<T>(&mut self, done: Result<T, WriteError>) -> Result<T, Broken> {
        done.map_err(|error| match self.writer.take() {
            Some(writer) => {
                let failed = writer.give_up();
                self.broken(error, failed)
            }
            None => Broken { path: self.path.clone(), error, frames: 0 },
        })
    }

    /// Leaves what can be read of a file.
    fn broken(&mut self, error: WriteError, mut failed: Failed<ResultFile>) -> Broken {
        let left = failed.out.cut(failed.good_bytes);
        let (mut path, mut frames) = (self.path.clone(), 0);
        if let Some(file) = self.files.last_mut() {
            let whole = file.frames.saturating_sub(failed.lost_frames);
            (file.frames, file.bytes) = if left == 0 { (0, 0) } else { (whole, left) };
            (path, frames) = (file.path.clone(), file.frames);
        }
        Broken { path, error, frames }
    }

    /// The name of a file, from 1.
    fn path_of(&self, number: usize) -> PathBuf {
        if self.split.is_none() {
            return self.path.clone();
        }
        let (stem, extension) = self.name_parts();
        self.path.with_file_name(format!("{stem}_{number:04}.{extension}"))
    }

    /// The number of a file of this name in the series.
    fn number_of(&self, name: &str) -> Option<usize> {
        let (stem, extension) = self.name_parts();
        let digits = name.strip_prefix(&*stem)?.strip_prefix('_')?;
        let digits = digits.strip_suffix(&*extension)?.strip_suffix('.')?;
        let is_number = digits.len() >= 4 && digits.bytes().all(|it| it.is_ascii_digit());
        if is_number { digits.parse().ok() } else { None }
    }

    /// What stands before and behind the number in the name of a file.
    fn name_parts(&self) -> (Cow<'_, str>, Cow<'_, str>) {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let extension = self.path.extension().map_or("mcap".into(), |it| it.to_string_lossy());
        (stem, extension)
    }
}
