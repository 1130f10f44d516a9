//! Errors of a retained state.

use std::path::PathBuf;

/// The damage of a file that should hold a state.
#[derive(thiserror::Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum DamagedState {
    /// It is a file of another kind.
    #[error("it is not a state file")]
    NoState,
    /// It is of another version of the format.
    #[error("its format is version {found}, and this program reads version {known}")]
    Version {
        /// Its version.
        found: u32,
        /// The version that this program reads.
        known: u32,
    },
    /// Its end is missing, or something stands behind it.
    #[error("it is truncated, or has extra bytes")]
    Truncated,
    /// It was changed.
    #[error("its checksum is wrong")]
    Checksum,
    /// Its header is not what this program writes.
    #[error("its header cannot be read: {0}")]
    Header(String),
}

/// A state that could not be read or written.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// The system refuses to read it.
    #[error(
        "the state {path} cannot be read: {source}; see that this user may read it, and may have enough files open \
         (ulimit -n)",
        path = path.display()
    )]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The system refuses to write it.
    #[error(
        "the state {path} cannot be written: {source}; see that its disk has room, and that this user may write there \
         and have enough files open (ulimit -n), or name another file (`--state FILE`, StateDirectory= in its unit)",
        path = path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// It is damaged, and there is no whole one before it.
    #[error(
        "the state {path} is damaged ({damage}), and there is no whole one before it; start without it \
         (`run --cold`), which keeps it as {path}.cold, or write on_damaged = \"cold\"",
        path = path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Its damage.
        damage: DamagedState,
    },
    /// It is of a version that this program does not read.
    #[error(
        "the state {path} has a format of version {found}, and this program reads version {known}; start it with the \
         program that wrote it, or without it (`run --cold`), which keeps it",
        path = path.display()
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The version that this program reads.
        known: u32,
    },
    /// It is no ordinary file.
    #[error("{path} is no ordinary file; choose another one (`--state FILE`)", path = path.display())]
    NoFile {
        /// The path.
        path: PathBuf,
    },
    /// It is the state of another node.
    #[error(
        "{path} is the state of node \"{other}\", not of \"{node}\"; choose another file (`--state FILE`), or start \
         without it (`run --cold`), which keeps it as {path}.cold",
        path = path.display()
    )]
    OtherNode {
        /// The file.
        path: PathBuf,
        /// The node that starts.
        node: String,
        /// The node of the state.
        other: String,
    },
    /// Another process retains its state there.
    #[error(
        "the state {path} is in use by another process: the node runs already, or another one has the same file; end it, or \
         choose another file (`--state FILE`)",
        path = path.display()
    )]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// There is no usual folder for it.
    #[error(
        "there is no folder for the state of a node: neither STATE_DIRECTORY nor HOME is set; name a file \
         (`--state FILE`)"
    )]
    NoFolder,
}

isochrone_model::debug_as_display!(DamagedState, StateError);
