//! The folder of an isolated domain: temporary, with a lock that tells whether its maker lives.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use tempfile::TempDir;

use super::locked_file;

/// What the names of these folders begin with.
pub(super) const FOLDERS: &str = "isochrone-";
/// Locked for as long as the domain lasts: the kernel releases it when the maker is killed.
pub(super) const MAKER: &str = "maker.lock";

/// What an isolated domain is in.
#[derive(Debug)]
pub(super) struct IsolatedFolder {
    // It is removed before its lock is released.
    pub(super) dir: TempDir,
    _maker: Option<File>,
}

impl IsolatedFolder {
    pub(super) fn make(place: &Path) -> io::Result<Self> {
        let dir = tempfile::Builder::new().prefix(FOLDERS).tempdir_in(place)?;
        // It has its name when it is locked, so that nobody takes the maker for dead.
        let unnamed = dir.path().join("maker.new");
        let maker = locked_file::try_lock(&unnamed)?;
        fs::rename(unnamed, dir.path().join(MAKER))?;
        Ok(Self { dir, _maker: maker })
    }
}
