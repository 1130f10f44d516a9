//! The program that carries the frames: iceoryx2's own link over zenoh.

use std::env;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use crate::failure::Failure;

/// The name of the program that the package installs.
const PROGRAM: &str = "iox2-link-tunnel-zenoh";
const INSTALL: &str = "cargo install iceoryx2-integrations-zenoh-link-tunnel-cli@0.10.0 --locked";

/// The program: the one that was named, or the one on the path or beside this program.
pub(super) fn find(named: Option<&Path>) -> Result<PathBuf, Failure> {
    if let Some(named) = named {
        // A name without a folder is looked up as a shell would.
        let found = if named.components().count() > 1 || is_program(named) {
            Some(named.to_owned())
        } else {
            on_path(named)
        };
        let found = found.filter(|path| is_program(path)).ok_or_else(|| {
            let named = named.display();
            Failure::usage(format!(
                "{named} is no program that can be run; --link names the link's program"
            ))
        })?;
        // The link runs in a folder of its own.
        return std::path::absolute(&found).map_err(Failure::usage);
    }
    let beside = env::current_exe().ok().and_then(|own| Some(own.parent()?.join(PROGRAM)));
    on_path(Path::new(PROGRAM)).or(beside.filter(|path| is_program(path))).ok_or_else(|| {
        Failure::usage(format!(
            "iceoryx2's link over zenoh, {PROGRAM}, is not installed; install it (it compiles for some \
             minutes):\n  {INSTALL}\nor name it with --link"
        ))
    })
}

fn on_path(name: &Path) -> Option<PathBuf> {
    let places = env::var_os("PATH")?;
    let found =
        env::split_paths(&places).map(|place| place.join(name)).find(|path| is_program(path));
    found.and_then(|path| std::path::absolute(path).ok())
}

fn is_program(path: &Path) -> bool {
    path.metadata().is_ok_and(|found| found.is_file() && found.permissions().mode() & 0o111 != 0)
}
