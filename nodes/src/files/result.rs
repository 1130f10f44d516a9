//! Texts that are complete before they are written.

use std::io;
use std::path::{Path, PathBuf};

use isochrone_runtime::output_target;
use serde::Serialize;

use super::replacement::Replacement;
use super::{OutputFile, Unwritable, is_stream};
use crate::failure::Failure;

/// The file of a result. It is checked before the run, so that the run is not in vain, and keeps its contents until
/// the result is complete.
pub(crate) struct ResultFile {
    path: PathBuf,
    target: Target,
}

enum Target {
    /// A file that is replaced.
    Replaced(PathBuf),
    /// Written in place: a pipe, a device, or a file in a folder where no other can be created.
    Itself(OutputFile),
}

impl ResultFile {
    /// Checks whether the file can be written.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        let target =
            Target::find(path).map_err(|error| Failure::usage(Unwritable::new(path, error)))?;
        Ok(Self { path: path.to_owned(), target })
    }

    /// Replaces the contents of the file.
    pub(crate) fn write(self, text: &str) -> Result<(), Failure> {
        let Self { path, target } = self;
        let written = target.write(text.as_bytes());
        written.map_err(|error| Failure::found(Unwritable { path, error }))
    }

    /// Writes a report as JSON.
    pub(crate) fn write_report(self, report: &impl Serialize) -> Result<(), Failure> {
        match serde_json::to_string_pretty(report) {
            Ok(text) => self.write(&(text + "\n")),
            Err(error) => Err(Failure::found(Unwritable { path: self.path, error: error.into() })),
        }
    }
}

impl Target {
    fn find(path: &Path) -> io::Result<Self> {
        let target = output_target(path)?;
        if is_stream(&target) {
            return OutputFile::open(path).map(Self::Itself);
        }
        match Replacement::begin(&target) {
            Ok(_) => Ok(Self::Replaced(target)),
            Err(_) if target.is_file() => OutputFile::open(path).map(Self::Itself),
            Err(error) => Err(error),
        }
    }

    fn write(self, text: &[u8]) -> io::Result<()> {
        match self {
            Self::Itself(file) => file.write_whole(text),
            Self::Replaced(target) => {
                let new = Replacement::begin(&target)?.with(text)?;
                // A mount point, or another user's file in a sticky folder, cannot be replaced.
                new.persist().or_else(|_| OutputFile::open(&target)?.write_whole(text))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs::{self, Permissions};
    use std::io::Write;
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    #[test]
    fn a_file_has_what_it_had_until_the_result_is_whole_and_keeps_its_rights() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["out.json", "link.json"].map(|name| folder.path().join(name));
        symlink("out.json", &link).unwrap();
        drop(ResultFile::open(&link).unwrap());
        assert!(!file.exists(), "there was no result");
        ResultFile::open(&link).unwrap().write("one").unwrap();
        fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
        let opened = ResultFile::open(&link).unwrap();
        let before = fs::File::open(&file).unwrap();
        opened.write("two").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "two");
        assert_eq!(io::read_to_string(before).unwrap(), "one", "it was replaced, not changed");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert!(link.is_symlink());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_file_that_is_being_written_is_left_to_its_writer() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.json");
        let mut writer = OutputFile::open(&path).unwrap();
        writer.write_all(b"begun").unwrap();
        let refused = ResultFile::open(&path).map(drop).unwrap_err();
        let said = format!("{:?}", refused.report().unwrap());
        assert!(said.contains("being written already"), "{said}");
        drop(writer);
        ResultFile::open(&path).unwrap().write("done").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "done");
    }
}
