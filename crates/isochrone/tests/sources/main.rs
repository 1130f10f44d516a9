//! The sources of all crates: how they are named, divided and connected.

mod circles;
mod lengths;
mod modules;
mod names;
mod tokens;

use std::fs;
use std::path::{Path, PathBuf};

/// The folder of the workspace.
fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap()
}

/// All Rust files in a folder, without what was built there.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let entries = entries.filter(|path| !path.ends_with("target"));
    let files = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    let files = entries.flat_map(files);
    files.filter(|path| path.extension().is_some_and(|end| end == "rs")).collect()
}
