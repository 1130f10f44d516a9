//! The program, built as whoever runs it is built.

use std::path::PathBuf;
use std::process::Command;

use crate::Failure;

/// How the program is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Without optimisation, as tests are.
    Debug,
    /// As users get it.
    Release,
}

impl Profile {
    /// The profile of this very program.
    pub fn own() -> Self {
        if cfg!(debug_assertions) { Self::Debug } else { Self::Release }
    }
}

/// Builds the program `isochrone`, and says where it is.
///
/// # Errors
/// It cannot be built.
pub fn build(profile: Profile) -> Result<PathBuf, Failure> {
    // target/<profile>/<program>, or target/<profile>/deps/<test or bench>.
    let own = std::env::current_exe()?;
    let folder = own.ancestors().skip(1).find(|folder| !folder.ends_with("deps"));
    let program = folder.ok_or("this program has no target folder")?.join("isochrone");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--quiet", "--package", "isochrone"]);
    if profile == Profile::Release {
        build.arg("--release");
    }
    if !build.status()?.success() {
        return Err("cannot build the program; run this with cargo".into());
    }
    Ok(program)
}
