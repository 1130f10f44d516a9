//! The program, built for tests.

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

    /// Its name for cargo.
    const fn name(self) -> &'static str {
        match self {
            Self::Debug => "dev",
            Self::Release => "release",
        }
    }

    /// Its folder in the target folder.
    const fn folder(self) -> &'static str {
        match self {
            Self::Debug => "debug",
            Self::Release => self.name(),
        }
    }
}

/// Says where the program `isochrone` is; builds it if it is older than its sources. So a user who may
/// not write where it was built can use it.
///
/// # Errors
/// It cannot be built.
pub fn find(profile: Profile) -> Result<PathBuf, Failure> {
    let program = place(&std::env::current_exe()?, profile)?;
    if is_current(&program) { Ok(program) } else { build(profile) }
}

/// Builds the program `isochrone`, and says where it is.
///
/// # Errors
/// It cannot be built.
pub fn build(profile: Profile) -> Result<PathBuf, Failure> {
    let program = place(&std::env::current_exe()?, profile)?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--package", "isochrone-cli", "--bin", "isochrone"]);
    build.args(["--quiet", "--profile", profile.name()]);
    if !build.status()?.success() {
        return Err("cannot build the program; run this with cargo".into());
    }
    Ok(program)
}

/// Where cargo builds the program, in the target folder of a test or a bench: `own` is
/// target/<profile>/<program>, or target/<profile>/deps/<test or bench>.
fn place(own: &Path, profile: Profile) -> Result<PathBuf, Failure> {
    let of_own = own.ancestors().skip(1).find(|folder| !folder.ends_with("deps"));
    let target = of_own.and_then(Path::parent).ok_or("this program has no target folder")?;
    Ok(target.join(profile.folder()).join("isochrone"))
}

/// Whether the program is younger than every source that cargo noted beside it.
fn is_current(program: &Path) -> bool {
    let age = |path: &Path| fs::metadata(path).and_then(|file| file.modified());
    let Ok(built) = age(program) else { return false };
    let sources = sources(&fs::read_to_string(program.with_extension("d")).unwrap_or_default());
    !sources.is_empty()
        && sources.iter().all(|source| age(source).is_ok_and(|changed| changed < built))
}

/// The sources in what cargo notes, a rule of make: `program: source source`. A space in a path is written `\ `.
fn sources(rule: &str) -> Vec<PathBuf> {
    // No path holds a NUL.
    let rule = rule.replace("\\ ", "\0");
    rule.split_whitespace().skip(1).map(|path| path.replace('\0', " ").into()).collect()
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::time::{Duration, SystemTime};

    use super::*;

    #[test]
    fn the_program_of_a_profile_is_in_that_profiles_folder_whatever_this_one_is_built_as() {
        for own in ["/t/release/deps/cyclictest-1f", "/t/debug/crash-points", "/t/dist/deps/x"] {
            let program = |profile| place(Path::new(own), profile).unwrap();
            assert_eq!(program(Profile::Debug), Path::new("/t/debug/isochrone"));
            assert_eq!(program(Profile::Release), Path::new("/t/release/isochrone"));
        }
    }

    #[test]
    fn a_program_is_current_until_a_source_of_it_changes_wherever_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("my own  folder");
        fs::create_dir(&place).unwrap();
        let [program, first, second] = ["isochrone", "first.rs", "a second.rs"].map(|name| {
            let path = place.join(name);
            fs::write(&path, "").unwrap();
            path
        });
        let built = SystemTime::now();
        let change = |path: &Path, at| File::options().write(true).open(path)?.set_modified(at);
        change(&program, built).unwrap();
        assert!(!is_current(&program), "nothing is known of its sources");
        let paths = [&program, &first, &second].map(|path| path.to_str().unwrap());
        let [program_noted, sources_noted @ ..] = paths.map(|path| path.replace(' ', "\\ "));
        let rule = format!("{program_noted}: {}\n", sources_noted.join(" "));
        fs::write(program.with_extension("d"), rule).unwrap();
        let (before, after) = (built - Duration::from_secs(1), built + Duration::from_secs(1));
        change(&first, before).unwrap();
        for (changed, is_older) in [(before, true), (after, false)] {
            change(&second, changed).unwrap();
            assert_eq!(is_current(&program), is_older, "{changed:?}");
        }
        fs::remove_file(&first).unwrap();
        assert!(!is_current(&program), "a source is gone");
    }
}
