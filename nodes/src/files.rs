//! Files that verbs write, and those that they [read](open_input).
//!
//! | what is written | how |
//! |---|---|
//! | a text that is complete before it is written: reports, pictures, pages, configurations ([`ResultFile`], [`save`]) | to a temporary file beside it, which then replaces it |
//! | data that grows while a verb runs: tables of rows, recordings ([`OutputFile`]) | into the file itself |
//!
//! A recording never replaces a file: it takes another [name](OutputFile::create_recording). Pipes and devices are
//! written to directly. Which file a path leads to, and whether that may be written, is decided in one place, by
//! [`output_target`], for nodes that write a journal, too.

mod input;
mod names;
mod output;
mod pipe;
mod replacement;
mod result;
mod saved;

use std::fmt;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use isochrone_runtime::{folder_of, output_target};

pub(crate) use input::open_input;
pub(crate) use names::numbered;
pub(crate) use output::{Numbers, OutputFile};
pub(crate) use result::ResultFile;
pub(crate) use saved::{Saved, save};

use crate::failure::Failure;

/// A file that cannot be written, and why.
#[derive(Debug)]
pub(crate) struct Unwritable {
    pub(crate) path: PathBuf,
    pub(crate) error: io::Error,
}

impl Unwritable {
    pub(crate) fn new(path: &Path, error: io::Error) -> Self {
        Self { path: path.to_owned(), error }
    }
}

impl fmt::Display for Unwritable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, error } = self;
        let folder = folder_of(path);
        let (path, shown) = (path.display(), folder.display());
        match error.kind() {
            ErrorKind::NotFound if !folder.exists() => {
                write!(f, "cannot write {path}: there is no folder {shown}")
            }
            _ => write!(f, "cannot write {path}: {error}"),
        }
    }
}

/// Whether a target is a pipe, a device or the like, whose contents writing does not replace.
fn is_stream(target: &Path) -> bool {
    // A target is a link only if the system made it: to something that this process has open.
    target.is_symlink() || (target.exists() && !target.is_file())
}

/// Refuses to write two results into one file.
pub(crate) fn keep_apart<'a>(
    written: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    let mut files: Vec<PathBuf> = Vec::new();
    for path in written {
        let Some(file) = file_of(path) else { continue };
        if files.contains(&file) {
            let path = path.display();
            return Err(Failure::usage(format!(
                "{path} stands for two results; name another file"
            )));
        }
        files.push(file);
    }
    Ok(())
}

/// The canonical path of a file, which need not exist yet; `None` for pipes, devices and what cannot be written.
fn file_of(path: &Path) -> Option<PathBuf> {
    let target = output_target(path).ok().filter(|target| !is_stream(target))?;
    Some(folder_of(&target).canonicalize().ok()?.join(target.file_name()?))
}
