//! The program as a user meets it: files in a folder, a command line, an exit status and two texts.

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// A folder of files in which the program runs. Names on its command line are relative to it.
pub(crate) struct Folder(tempfile::TempDir);

/// What the program left behind.
pub(crate) struct Ran {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with these files.
    pub(crate) fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self::new();
        files.iter().for_each(|(name, content)| folder.write(name, content));
        folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// The program in this folder, not started yet.
    pub(crate) fn command<S: AsRef<std::ffi::OsStr>>(&self, args: &[S]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
        command.args(args).current_dir(&self.0).stdin(Stdio::null());
        command.env_remove("RUST_LOG").env_remove("NO_COLOR").env("RUST_BACKTRACE", "1");
        command
    }

    /// Runs the program with arguments that are separated by spaces.
    #[track_caller]
    pub(crate) fn run(&self, args: &str) -> Ran {
        Ran::new(self.command(&args.split_whitespace().collect::<Vec<_>>()).output().unwrap())
    }
}

impl Ran {
    /// Whatever a user does, there is no panic, no backtrace, and no escape sequence in a pipe.
    #[track_caller]
    pub(crate) fn new(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        let (out, err) = (text(output.stdout), text(output.stderr));
        for ugly in ["panicked", "backtrace", "\u{1b}"] {
            assert!(!out.contains(ugly) && !err.contains(ugly), "{ugly:?} in:\n{out}\n{err}");
        }
        let code = output.status.code().unwrap_or_else(|| panic!("{}", output.status));
        Self { code, out, err }
    }

    /// It did what it should, and had nothing to remark.
    #[track_caller]
    pub(crate) fn silently(self) -> String {
        let (out, err) = self.noting();
        assert_eq!(err, "");
        out
    }

    /// It did what it should: stdout and stderr.
    #[track_caller]
    pub(crate) fn noting(self) -> (String, String) {
        assert_eq!(self.code, 0, "{}", self.err);
        (self.out, self.err)
    }

    /// It refused with an exit status and without a result: stderr.
    #[track_caller]
    pub(crate) fn refused(self, code: i32) -> String {
        assert_eq!((self.code, self.out.as_str()), (code, ""), "{}", self.err);
        self.err
    }
}

#[track_caller]
pub(crate) fn assert_says<S: AsRef<str>>(text: &str, parts: &[S]) {
    for part in parts.iter().map(AsRef::as_ref) {
        assert!(text.contains(part), "{part:?} is not in:\n{text}");
    }
}

/// Cells of a CSV text, row by row, the header first.
pub(crate) fn cells(csv: &str) -> Vec<Vec<&str>> {
    csv.lines().map(|line| line.split(',').collect()).collect()
}
