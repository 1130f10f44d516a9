//! Files that verbs write, and those that they [read](open_input).
//!
//! | what is written | how |
//! |---|---|
//! | a text that is whole before it is written: reports, pictures, pages, configurations ([`ResultFile`], [`save`]) | beside the file, which it then replaces |
//! | what grows while a verb runs: tables of rows, recordings ([`OutputFile`]) | into the file itself |
//!
//! A recording never replaces a file: it takes another [name](OutputFile::create_recording). Pipes and devices are
//! written as they are.

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

use isochrone_runtime::output_target;

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

/// Whether what is written goes on to somewhere else, as to a pipe or a device, and replaces nothing.
fn is_stream(target: &Path) -> bool {
    // What an output's target is a link to, the process has open already.
    target.is_symlink() || (target.exists() && !target.is_file())
}

/// Refuses one file for two results.
pub(crate) fn keep_apart<'a>(
    written: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    let mut places: Vec<PathBuf> = Vec::new();
    for path in written {
        let Some(place) = place(path) else { continue };
        if places.contains(&place) {
            let path = path.display();
            return Err(Failure::usage(format!(
                "{path} stands for two results; name another file"
            )));
        }
        places.push(place);
    }
    Ok(())
}

/// The one path of a file, also of one that is not there yet; `None` for pipes, devices and what cannot be written.
fn place(path: &Path) -> Option<PathBuf> {
    let target = output_target(path).ok().filter(|target| !is_stream(target))?;
    Some(folder_of(&target).canonicalize().ok()?.join(target.file_name()?))
}

/// The folder that a file is in.
fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}
