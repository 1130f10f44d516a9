//! The file that is written, or a series of files.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Instant;

use isochrone_recording::{Carried, ChannelId, Failed, Frame, Mark, WriteError, Writer};

use isochrone_runtime::{RecordingFile, read_clocks};
use isochrone_timing::units::counted;

use super::split::Split;
use crate::failure::Failure;
use crate::files::{Numbers, OutputFile, Unwritable};

/// Where frames are written.
pub(super) struct Output {
    path: PathBuf,
    split: Option<Split>,
    /// A file that was opened and not written to yet.
    opened: Option<OutputFile>,
    writer: Option<Writer<OutputFile>>,
    begun: Instant,
    pub(super) files: Vec<WrittenFile>,
    /// The services with written frames, in the order of their first layout.
    services: Vec<String>,
    /// The services, by index, of the newest frames, which the writer may still hold.
    newest: Vec<usize>,
}

/// A file, and what is in it so far.
#[derive(Debug, Clone, serde::Serialize)]
pub(super) struct WrittenFile {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    pub(super) frames: u64,
    /// How many frames of each service.
    #[serde(skip)]
    of_services: Vec<u64>,
}

impl WrittenFile {
    /// Counts one more frame of a service.
    fn count(&mut self, service: usize) {
        self.frames += 1;
        if self.of_services.len() <= service {
            self.of_services.resize(service + 1, 0);
        }
        if let Some(frames) = self.of_services.get_mut(service) {
            *frames += 1;
        }
    }

    /// Takes back the counts of frames that did not get into the file.
    fn take_away(&mut self, services: &[usize]) {
        self.frames = self.frames.saturating_sub(services.len() as u64);
        for service in services {
            if let Some(frames) = self.of_services.get_mut(*service) {
                *frames = frames.saturating_sub(1);
            }
        }
    }
}

/// A channel of one of the files.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct FileChannel {
    file: usize,
    channel: ChannelId,
    service: usize,
}

/// A file that could not be written any more.
#[derive(Debug)]
pub(super) struct Broken {
    path: PathBuf,
    error: WriteError,
    frames: u64,
    /// Whether it is a file that can be read again, rather than a pipe or device.
    is_file: bool,
}

impl Broken {
    /// The message; `unwritten` frames were received and are in no file.
    pub(super) fn failure(&self, unwritten: u64) -> Failure {
        let Self { path, error, frames, is_file } = self;
        let path = path.display();
        let has_reader_left =
            matches!(error, WriteError::Io(cause) if cause.kind() == ErrorKind::BrokenPipe);
        let (there, way_out) = if has_reader_left {
            let way_out = ". Let its reader run until the recording has ended, or record in a file";
            ("handed to its reader", way_out.to_owned())
        } else if *is_file && *frames > 0 {
            let way_out =
                format!(". To close the file, use `isochrone export {path} -o closed.mcap`");
            ("in this file", way_out)
        } else {
            ("in this file", String::new())
        };
        let (frames, unwritten) = (counted(*frames, "frame"), counted(unwritten, "frame"));
        Failure::found(format!(
            "cannot write {path}: {error}; the recording ends here, with {frames} {there}, and {unwritten} \
             received since are lost{way_out}"
        ))
    }
}

impl Output {
    /// Opens the first file before the recording begins, so that it is not in vain.
    pub(super) fn open(path: &Path, split: Option<Split>) -> Result<Self, Failure> {
        let mut output = Self {
            path: path.to_owned(),
            split,
            opened: None,
            writer: None,
            begun: Instant::now(),
            files: Vec::new(),
            services: Vec::new(),
            newest: Vec::new(),
        };
        output.opened = Some(output.create().map_err(Failure::usage)?);
        Ok(output)
    }

    fn create(&self) -> Result<OutputFile, Unwritable> {
        let numbers = if self.split.is_some() { Numbers::Always } else { Numbers::IfTaken };
        OutputFile::create_recording(&self.path, numbers)
    }

    /// The channel for a layout in this file. Begins the file if there is none.
    pub(super) fn place(&mut self, carried: &Carried) -> Result<FileChannel, Broken> {
        let writer = self.writer()?;
        let added = writer.add(carried);
        let channel = self.checked(added)?;
        let known = self.services.iter().position(|service| *service == carried.service);
        let service = known.unwrap_or_else(|| {
            self.services.push(carried.service.clone());
            self.services.len() - 1
        });
        Ok(FileChannel { file: self.files.len(), channel, service })
    }

    /// Whether frames can still go there.
    pub(super) fn has(&self, place: FileChannel) -> bool {
        self.writer.is_some() && place.file == self.files.len()
    }

    pub(super) fn write(&mut self, place: FileChannel, frame: &Frame<'_>) -> Result<(), Broken> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        if let Some(file) = self.files.last_mut() {
            file.count(place.service);
        }
        self.newest.push(place.service);
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

    /// Flushes everything to the system.
    pub(super) fn flush(&mut self) -> Result<(), Broken> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let flushed = writer.follow(read_clocks()).and_then(|()| writer.flush());
        let bytes = writer.bytes();
        if let Some(file) = self.files.last_mut() {
            file.bytes = bytes;
        }
        self.checked(flushed)?;
        self.newest.clear();
        Ok(())
    }

    /// Closes the file.
    pub(super) fn close(&mut self) -> Result<(), Broken> {
        // So that the final length of the file is known.
        self.flush()?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        match writer.finish() {
            Ok(_) => Ok(()),
            Err((error, failed)) => Err(self.broken(error, failed)),
        }
    }

    /// The file that is written now, or was last.
    pub(super) fn file(&self) -> &Path {
        match (&self.opened, self.files.last()) {
            (Some(opened), _) => opened.path(),
            (None, Some(file)) => &file.path,
            (None, None) => &self.path,
        }
    }

    /// Frames in all files.
    pub(super) fn frames(&self) -> u64 {
        self.files.iter().map(|file| file.frames).sum()
    }

    /// Frames of a service in all files.
    pub(super) fn frames_of(&self, service: &str) -> u64 {
        let Some(place) = self.services.iter().position(|it| it == service) else { return 0 };
        self.files.iter().filter_map(|file| file.of_services.get(place)).sum()
    }

    /// Bytes in all files.
    pub(super) fn bytes(&self) -> u64 {
        self.files.iter().map(|file| file.bytes).sum()
    }

    fn writer(&mut self) -> Result<&mut Writer<OutputFile>, Broken> {
        let writer = match self.writer.take() {
            Some(writer) => writer,
            None => self.begin()?,
        };
        Ok(self.writer.insert(writer))
    }

    /// Begins the next file.
    fn begin(&mut self) -> Result<Writer<OutputFile>, Broken> {
        let broken = |path, error| Broken { path, error, frames: 0, is_file: true };
        let file = match self.opened.take() {
            Some(opened) => opened,
            None => self
                .create()
                .map_err(|Unwritable { path, error }| broken(path, WriteError::Io(error)))?,
        };
        let path = file.path().to_owned();
        let writer =
            Writer::create(file, read_clocks()).map_err(|error| broken(path.clone(), error))?;
        self.begun = Instant::now();
        let (bytes, of_services) = (writer.bytes(), Vec::new());
        self.files.push(WrittenFile { path, bytes, frames: 0, of_services });
        Ok(writer)
    }

    fn checked<T>(&mut self, done: Result<T, WriteError>) -> Result<T, Broken> {
        done.map_err(|error| match self.writer.take() {
            Some(writer) => {
                let failed = writer.give_up();
                self.broken(error, failed)
            }
            None => Broken { path: self.path.clone(), error, frames: 0, is_file: true },
        })
    }

    /// Truncates a broken file to its readable part.
    fn broken(&mut self, error: WriteError, mut failed: Failed<OutputFile>) -> Broken {
        let is_file = failed.out.is_watched();
        let left = failed.out.cut(failed.good_bytes);
        let (mut path, mut frames) = (self.path.clone(), 0);
        if let Some(file) = self.files.last_mut() {
            let lost = usize::try_from(failed.lost_frames).unwrap_or(usize::MAX);
            let whole = self.newest.len().saturating_sub(lost);
            file.take_away(self.newest.get(whole..).unwrap_or_default());
            file.bytes = left;
            if left == 0 {
                (file.frames, file.of_services) = (0, Vec::new());
            }
            (path, frames) = (file.path.clone(), file.frames);
        }
        Broken { path, error, frames, is_file }
    }
}
