//! Which root paths share a prefix.
//!
//! Files in shared memory are distinguished by the prefix alone, but the living nodes are listed below the root path.
//! Domains with one prefix and several root paths (the default prefix in two configurations, or one path on the
//! mounts of two containers) must not mistake each other's segments for those of dead processes. So each root path is
//! entered in a file beside the segments before any are created.

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use iceoryx2::config::Config;

use super::locked_file;
use super::segment::FOLDER;

const ATTEMPTS: u32 = 20;
const PAUSE: Duration = Duration::from_millis(1);

/// Enters the domain's root path.
pub(super) fn enter(config: &Config) {
    let Some(line) = line(config) else { return };
    let Some(file) = lock(config) else { return };
    let text = locked_file::read(&file);
    if !text.lines().any(|known| known == line) {
        locked_file::write(&file, &format!("{text}{line}\n"));
    }
}

/// Whether no other root path has the domain's prefix. Ask after listing the segments: a root path that is not
/// entered now had created none of them.
pub(super) fn is_alone(config: &Config) -> bool {
    let found = locked_file::open(&path(config), File::options().read(true));
    let text = found.map(|file| locked_file::read(&file)).unwrap_or_default();
    line(config).is_some_and(|line| text.lines().eq([line]))
}

/// Removes the entry when there is no process at the root path any more.
pub(super) fn leave(config: &Config) {
    let (Some(line), Some(file)) = (line(config), lock(config)) else { return };
    let text = locked_file::read(&file);
    let others = text.lines().filter(|known| *known != line);
    let others: String = others.flat_map(|other| [other, "\n"]).collect();
    if others.is_empty() {
        let _ = fs::remove_file(path(config));
    } else {
        locked_file::write(&file, &others);
    }
}

fn path(config: &Config) -> PathBuf {
    Path::new(FOLDER).join(format!("{}isochrone.roots", config.global.prefix))
}

/// Identifies a root path, also among paths of the same name on other mounts.
fn line(config: &Config) -> Option<String> {
    let root = config.global.root_path().to_string();
    let found = fs::metadata(&root).ok()?;
    Some(format!("{}:{} {}", found.dev(), found.ino(), root.escape_default()))
}

/// Locks the file; `None` if another process holds it for long, or another user created it.
fn lock(config: &Config) -> Option<File> {
    for _ in 0..ATTEMPTS {
        if let Some(file) = locked_file::try_lock(&path(config)).ok()? {
            return Some(file);
        }
        thread::sleep(PAUSE);
    }
    None
}
