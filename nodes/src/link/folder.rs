//! The folder in which the link's program runs, with the files that it reads when it starts.

use std::fs::{self, DirBuilder};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use isochrone_ipc::Domain;
use rustix::process::geteuid;
use serde_json::json;

use super::way::Way;
use crate::failure::Failure;

/// The file in which iceoryx2 looks first.
const DOMAIN: &str = "config/iceoryx2.toml";
const ZENOH: &str = "zenoh.json5";
/// How long the other side may be silent before the link connects anew.
const LEASE_MS: u64 = 3000;
/// Between two attempts to connect, at first and at most.
const RETRY_MS: [u64; 2] = [200, 1000];

/// A folder in the domain's root path; removed when this is dropped.
pub(super) struct Folder(PathBuf);

impl Folder {
    /// Creates it, and removes those of programs that were killed.
    ///
    /// # Errors
    /// It cannot be created, or something of another user has its name.
    pub(super) fn create(domain: &Domain) -> Result<Self, Failure> {
        let stem = format!("{}isochrone.link.", domain.prefix());
        let (root, own) = (domain.root_path(), std::process::id());
        for entry in fs::read_dir(&root).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let pid = name.to_str().and_then(|name| name.strip_prefix(&stem)?.parse::<u32>().ok());
            let is_over = |pid| pid == own || !Path::new(&format!("/proc/{pid}")).exists();
            if pid.is_some_and(is_over) {
                remove(&entry.path());
            }
        }
        let path = root.join(format!("{stem}{own}"));
        match create_own(&path) {
            Ok(()) => Ok(Self(path)),
            Err(cause) => Err(unwritable(&path, cause)),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }

    /// The file that says how the two links find each other.
    pub(super) fn zenoh_file(&self, way: &Way) -> PathBuf {
        match way {
            Way::File(file) => file.clone(),
            Way::Listen(_) | Way::Connect(_) => self.0.join(ZENOH),
        }
    }

    /// Writes what the link reads, each time before it starts.
    pub(super) fn write(&self, domain: &Domain, way: &Way) -> Result<(), Failure> {
        let unwritable = |cause| unwritable(&self.0, cause);
        let settings =
            toml::to_string(&domain.config_without_clean_up()).map_err(Failure::found)?;
        let file = self.0.join(DOMAIN);
        // What cleans up old files may have removed it since the last start.
        for folder in [Some(self.path()), file.parent()].into_iter().flatten() {
            create_own(folder).map_err(unwritable)?;
        }
        fs::write(&file, settings).map_err(unwritable)?;
        if let Some(configuration) = zenoh_configuration(way) {
            fs::write(self.zenoh_file(way), configuration).map_err(unwritable)?;
        }
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        remove(&self.0);
    }
}

/// Creates a folder that no other user can write to, unless it is there. In a root path such as /tmp another
/// user may have laid something there first, to have it overwritten or read.
fn create_own(path: &Path) -> io::Result<()> {
    match DirBuilder::new().mode(0o700).create(path) {
        Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
        created => return created,
    }
    if is_own(path) {
        return Ok(());
    }
    let why = format!("{} is there, and is not a folder of this user", path.display());
    Err(io::Error::new(io::ErrorKind::AlreadyExists, why))
}

fn is_own(path: &Path) -> bool {
    let found = fs::symlink_metadata(path);
    found.is_ok_and(|found| found.is_dir() && found.uid() == geteuid().as_raw())
}

fn remove(path: &Path) {
    if is_own(path) {
        let _ = fs::remove_dir_all(path);
    }
}

fn unwritable(path: &Path, cause: io::Error) -> Failure {
    let way_out = match cause.kind() {
        io::ErrorKind::AlreadyExists => {
            "remove it, or use a domain whose root path is a folder of your own"
        }
        _ => "see that there is room",
    };
    Failure::found(format!("cannot write to {}: {cause}; {way_out}", path.display()))
}

/// What zenoh is told; `None` where the user has a file for it. Nothing is scouted for: who the other
/// side is was said. A side that connects listens nowhere, where zenoh would listen on all addresses.
fn zenoh_configuration(way: &Way) -> Option<String> {
    let (listen, connect) = match way {
        Way::Listen(local) => (vec![format!("tcp/{local}")], Vec::new()),
        Way::Connect(host) => (Vec::new(), vec![format!("tcp/{host}")]),
        Way::File(_) => return None,
    };
    let [init_ms, max_ms] = RETRY_MS;
    let configuration = json!({
        "mode": "peer",
        "listen": {"endpoints": listen},
        "connect": {
            "endpoints": connect,
            "retry": {"period_init_ms": init_ms, "period_max_ms": max_ms, "period_increase_factor": 2},
        },
        "scouting": {"multicast": {"enabled": false}, "gossip": {"enabled": false}},
        "transport": {"link": {"tx": {"lease": LEASE_MS}}},
    });
    Some(configuration.to_string())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{PermissionsExt, chown, symlink};

    use super::*;

    #[test]
    fn a_folder_is_for_its_user_alone_and_may_be_there_already() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("folder");
        create_own(&path).unwrap();
        assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, 0o700);
        create_own(&path).unwrap();
        remove(&path);
        assert!(!path.exists());
    }

    #[test]
    fn what_another_user_may_have_laid_there_is_neither_used_nor_removed() {
        let root = tempfile::tempdir().unwrap();
        let [link, file, folder] = ["link", "file", "folder"].map(|name| root.path().join(name));
        symlink(root.path(), &link).unwrap();
        fs::write(&file, "").unwrap();
        let mut laid = vec![link, file];
        if geteuid().is_root() {
            fs::create_dir(&folder).unwrap();
            chown(&folder, Some(65_534), None).unwrap();
            laid.push(folder);
        }
        for path in laid {
            let error = create_own(&path).unwrap_err().to_string();
            assert!(error.contains("is not a folder of this user"), "{error}");
            remove(&path);
            assert!(path.symlink_metadata().is_ok());
        }
    }
}
