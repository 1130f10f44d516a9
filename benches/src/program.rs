//! The program, built as whoever runs it is built.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::Failure;

/// How the program is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Without optimisation, as tests are.
    Debug,
    /// As `cargo run --release` has it.
    Release,
}

impl Profile {
    /// The profile of this very program.
    pub fn own() -> Self {
        if cfg!(debug_assertions) { Self::Debug } else { Self::Release }
    }
}

/// Says where the program `isochrone` is; builds it if it is older than its sources. So a user who may
/// not write where it was built can use it.
///
/// # Errors
/// It cannot be built.
pub fn find(profile: Profile) -> Result<PathBuf, Failure> {
    let program = place()?;
    if is_current(&program) { Ok(program) } else { build(profile) }
}

/// Builds the program `isochrone`, and says where it is.
///
/// # Errors
/// It cannot be built.
pub fn build(profile: Profile) -> Result<PathBuf, Failure> {
    let program = place()?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--quiet", "--package", "isochrone-cli", "--bin", "isochrone"]);
    if profile == Profile::Release {
        build.arg("--release");
    }
    if !build.status()?.success() {
        return Err("cannot build the program; run this with cargo".into());
    }
    Ok(program)
}

/// Beside the program that runs: target/<profile>/<program>, or target/<profile>/deps/<test or bench>.
fn place() -> Result<PathBuf, Failure> {
    let own = std::env::current_exe()?;
    let folder = own.ancestors().skip(1).find(|folder| !folder.ends_with("deps"));
    Ok(folder.ok_or("this program has no target folder")?.join("isochrone"))
}

/// Whether the program is younger than every source that cargo noted beside it.
fn is_current(program: &Path) -> bool {
    let age = |path: &Path| fs::metadata(path).and_then(|file| file.modified());
    let Ok(built) = age(program) else { return false };
    let sources = fs::read_to_string(program.with_extension("d")).unwrap_or_default();
    let mut sources = sources.split_whitespace().skip(1).peekable();
    sources.peek().is_some()
        && sources.all(|source| age(Path::new(source)).is_ok_and(|changed| changed < built))
}
