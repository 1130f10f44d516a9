//! Which root paths share a prefix.
//!
//! Shared memory is told apart by the prefix alone, but who lives is known by the root path. Domains
//! with one prefix and several root paths (the default prefix of two configurations, one path on the
//! mounts of two containers) must not take each other's segments for those of the dead. So each root
//! path enters itself in a file beside the segments before it makes any.

use std::fs::{self, File};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use iceoryx2::config::Config;
use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::process::geteuid;

use super::segment::FOLDER;
use super::{is_same, read_text, write_text};

const ATTEMPTS: u32 = 20;
const PAUSE: Duration = Duration::from_millis(1);

/// Enters the domain's root path.
pub(super) fn enter(config: &Config) {
    let Some(line) = line(config) else { return };
    let Some(file) = open(config) else { return };
    let text = read_text(&file);
    if !text.lines().any(|known| known == line) {
        write_text(&file, &format!("{text}{line}\n"));
    }
}

/// Whether no other root path has the domain's prefix. To be asked after its segments were listed:
/// who is not entered now had made none of them.
pub(super) fn is_alone(config: &Config) -> bool {
    let Ok(found) = fs::symlink_metadata(path(config)) else { return false };
    let is_ours = found.is_file() && found.uid() == geteuid().as_raw();
    let text = File::open(path(config)).map(|file| read_text(&file)).unwrap_or_default();
    is_ours && line(config).is_some_and(|line| text.lines().eq([line]))
}

/// Takes the entry away when nobody lives at the root path any more.
pub(super) fn leave(config: &Config) {
    let (Some(line), Some(file)) = (line(config), open(config)) else { return };
    let text = read_text(&file);
    let others = text.lines().filter(|known| *known != line);
    let others: String = others.flat_map(|other| [other, "\n"]).collect();
    if others.is_empty() {
        let _ = fs::remove_file(path(config));
    } else {
        write_text(&file, &others);
    }
}

fn path(config: &Config) -> PathBuf {
    Path::new(FOLDER).join(format!("{}isochrone.roots", config.global.prefix))
}

/// What tells a root path from all others, also from one of the same name on another mount.
fn line(config: &Config) -> Option<String> {
    let root = config.global.root_path().to_string();
    let found = fs::metadata(&root).ok()?;
    Some(format!("{}:{} {}", found.dev(), found.ino(), root.escape_default()))
}

/// Opens and locks the file; `None` where somebody else has it for long, or made it.
fn open(config: &Config) -> Option<File> {
    for _ in 0..ATTEMPTS {
        let mut options = File::options();
        options.create(true).truncate(false).read(true).write(true).mode(0o600);
        options.custom_flags(OFlags::NOFOLLOW.bits() as i32);
        let file = options.open(path(config)).ok()?;
        let is_locked = flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok();
        let current = fs::symlink_metadata(path(config));
        if is_locked && current.is_ok_and(|current| is_same(&current, &file)) {
            return Some(file);
        }
        thread::sleep(PAUSE);
    }
    None
}
