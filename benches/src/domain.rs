//! An iceoryx2 domain that nobody else is in, and what is left in it.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::Failure;

/// The configuration of a domain, in its folder.
pub(crate) const DOMAIN_FILE: &str = "domain.toml";
const ROOT: &str = "iceoryx2";
const SHARED_MEMORY: &str = "/dev/shm";

/// A folder with a domain in it, of which nothing is left when it is dropped. By then whoever used it
/// must have ended.
#[derive(Debug)]
pub struct Domain {
    folder: tempfile::TempDir,
    prefix: String,
}

impl Domain {
    /// Makes one.
    ///
    /// # Errors
    /// There is no place for the folder.
    pub fn new() -> Result<Self, Failure> {
        Self::within(tempfile::tempdir()?)
    }

    /// Makes one whose files are in memory: iceoryx2 has them written to the disk when a service or a
    /// port is made, and on a disk that others keep busy that takes seconds.
    ///
    /// # Errors
    /// There is no place for the folder.
    pub fn in_memory() -> Result<Self, Failure> {
        Self::within(tempfile::Builder::new().prefix("isochrone-").tempdir_in(SHARED_MEMORY)?)
    }

    fn within(folder: tempfile::TempDir) -> Result<Self, Failure> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let prefix = format!("bench{}x{number}_", std::process::id());
        let root = folder.path().join(ROOT);
        let config =
            format!("[global]\nroot-path = \"{}\"\nprefix = \"{prefix}\"\n", root.display());
        fs::write(folder.path().join(DOMAIN_FILE), config)?;
        Ok(Self { folder, prefix })
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// What its processes left: files and folders below its root path, and shared memory. What they
    /// named by chance has the same name here, so that two domains can be compared.
    pub fn litter(&self) -> Vec<String> {
        let root = self.folder().join(ROOT);
        let below = below(&root);
        let below = below.iter().filter_map(|path| path.strip_prefix(&root).ok());
        let mut litter: Vec<String> =
            below.map(|path| self.anonymous(&path.display().to_string())).collect();
        litter.extend(
            self.shared_memory().iter().map(|path| self.anonymous(&path.display().to_string())),
        );
        litter.sort();
        litter
    }

    fn shared_memory(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
        let paths = entries.map(|entry| entry.path());
        let ours = |path: &PathBuf| {
            path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&self.prefix))
        };
        paths.filter(ours).collect()
    }

    /// Long numbers, decimal or hexadecimal, are ids.
    fn anonymous(&self, name: &str) -> String {
        const LEAST_DIGITS: usize = 12;
        let mut anonymous = String::new();
        let mut digits = String::new();
        for c in name.replace(&self.prefix, "").chars().chain([' ']) {
            if c.is_ascii_hexdigit() {
                digits.push(c);
                continue;
            }
            let id = std::mem::take(&mut digits);
            anonymous += if id.len() < LEAST_DIGITS { &id } else { "*" };
            anonymous.push(c);
        }
        anonymous.trim_end().to_owned()
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        for segment in self.shared_memory() {
            if let Err(error) = fs::remove_file(&segment) {
                eprintln!("cannot remove {}: {error}", segment.display());
            }
        }
    }
}

fn below(folder: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            paths.extend(self::below(&path));
        }
        paths.push(path);
    }
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_told_without_ids() {
        let domain = Domain::new().unwrap();
        let nodes = domain.folder().join(ROOT).join("nodes/279896065349295382988051");
        fs::create_dir_all(&nodes).unwrap();
        fs::write(nodes.join(format!("{}node.details", domain.prefix)), "").unwrap();
        assert_eq!(domain.litter(), ["nodes", "nodes/*", "nodes/*/node.details"]);
    }
}
