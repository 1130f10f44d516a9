//! Ownership of a domain: all its processes run as one user, and no other user can write to it.

use std::fs::{self, DirBuilder, Metadata, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use rustix::process::geteuid;

use super::{counter, lock};
use crate::JoinError;
use crate::config::describe;

const STICKY: u32 = 0o1000;
const WRITABLE_BY_OTHERS: u32 = 0o022;

/// Creates the root path if necessary, and refuses a domain that has anything of another user.
///
/// # Errors
/// The root path cannot be created, or something in the domain belongs to another user.
pub(super) fn claim(config: &Config) -> Result<(), JoinError> {
    let root = PathBuf::from(config.global.root_path().to_string());
    let failed = |error: io::Error| {
        let cause = format!("{}: {error}; see that the root path is writable", root.display());
        JoinError::of_domain(&describe(config), cause)
    };
    match fs::symlink_metadata(&root) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            DirBuilder::new().recursive(true).mode(0o700).create(&root).map_err(failed)?;
        }
        Err(error) => return Err(failed(error)),
        Ok(_) => {}
    }
    let found = fs::symlink_metadata(&root).map_err(failed)?;
    // A sticky folder such as /tmp, where users cannot remove each other's files, is fine as a root path.
    let is_shared = found.uid() == 0 && found.is_dir() && found.mode() & STICKY != 0;
    if !is_shared {
        require_own(config, &root, &found)?;
        close(&root, &found);
    }
    for folder in folders(config) {
        let Ok(found) = fs::symlink_metadata(&folder) else { continue };
        require_own(config, &folder, &found)?;
        close(&folder, &found);
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            // An entry that is gone again was of a process that ended.
            if let Ok(found) = entry.metadata() {
                require_own(config, &entry.path(), &found)?;
            }
        }
    }
    for file in counter::find(config).into_iter().chain([lock::path(config)]) {
        if let Ok(found) = fs::symlink_metadata(&file) {
            require_own(config, &file, &found)?;
        }
    }
    Ok(())
}

/// The folders in the root path.
pub(super) fn folders(config: &Config) -> [PathBuf; 2] {
    let global = &config.global;
    [global.node_dir().to_string().into(), global.service_dir().to_string().into()]
}

fn require_own(config: &Config, path: &Path, found: &Metadata) -> Result<(), JoinError> {
    let ours = geteuid().as_raw();
    if found.uid() == ours {
        return Ok(());
    }
    let name = user_name(found.uid());
    let with = name.map_or_else(String::new, |name| format!(" (`sudo -u {name} …`)"));
    let cause = format!(
        "{} belongs to {}, whose domain this is, and this process runs as {}; join it as that user{with}, have it \
         removed when no process uses the domain, or choose another root-path and prefix",
        path.display(),
        user(found.uid()),
        user(ours)
    );
    Err(JoinError::of_domain(&describe(config), cause))
}

/// Removes the right of other users to create or remove files in a folder of ours.
fn close(folder: &Path, found: &Metadata) {
    let mode = found.mode();
    if found.is_dir() && mode & WRITABLE_BY_OTHERS != 0 && mode & STICKY == 0 {
        let closed = Permissions::from_mode(mode & 0o7777 & !WRITABLE_BY_OTHERS);
        // On a file system without permissions nothing can be protected, and nobody expects it.
        let _ = fs::set_permissions(folder, closed);
    }
}

/// A user by name and number.
fn user(uid: u32) -> String {
    match user_name(uid) {
        Some(name) => format!("user {name} ({uid})"),
        None => format!("user {uid}"),
    }
}

/// The name of a user, if there is one.
fn user_name(uid: u32) -> Option<String> {
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    users.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(uid)).then(|| name.to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_is_told_by_name_and_number() {
        assert_eq!(user(0), "user root (0)");
        assert_eq!(user(4_000_000_001), "user 4000000001");
    }
}
