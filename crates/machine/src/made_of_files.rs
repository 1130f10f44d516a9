//! Machines made of files, for tests.

use std::fs;

use tempfile::TempDir;

use crate::Machine;

/// Path and content.
pub(crate) type File = (&'static str, &'static str);

/// A machine of these files, and the folder that they are in.
pub(crate) fn machine(files: &[File]) -> (TempDir, Machine) {
    let root = tempfile::tempdir().unwrap();
    for (path, text) in files {
        let path = root.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let machine = Machine::below(root.path());
    (root, machine)
}
