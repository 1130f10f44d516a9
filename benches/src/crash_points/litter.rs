//! Leftovers in an iceoryx2 domain.

use std::fs;
use std::path::{Path, PathBuf};

use isochrone_ipc::Domain;

/// What a domain's processes left: files and folders below its root path, and shared memory. What
/// they named by chance has the same name here, so that two domains can be compared.
pub(super) fn litter(domain: &Domain) -> Vec<String> {
    let (root, prefix) = (domain.root_path(), domain.prefix());
    let folders = folders_below(&root);
    let paths = domain.files().into_iter().chain(folders);
    let short = |path: PathBuf| path.strip_prefix(&root).map_or(path.clone(), Path::to_owned);
    let mut litter: Vec<String> =
        paths.map(|path| anonymous(&short(path).display().to_string(), &prefix)).collect();
    litter.sort();
    litter
}

/// Long numbers, decimal or hexadecimal, are ids.
fn anonymous(name: &str, prefix: &str) -> String {
    const LEAST_DIGITS: usize = 12;
    let mut anonymous = String::new();
    let mut digits = String::new();
    for c in name.replace(prefix, "").chars().chain([' ']) {
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

fn folders_below(folder: &Path) -> Vec<PathBuf> {
    let mut folders = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            folders.extend(folders_below(&path));
            folders.push(path);
        }
    }
    folders
}

#[cfg(test)]
mod tests {
    use isochrone_ipc::IsolatedDomain;

    use super::*;

    #[test]
    fn what_is_left_is_told_without_ids() {
        let domain = IsolatedDomain::new("bench").unwrap();
        let nodes = domain.root_path().join("nodes/279896065349295382988051");
        fs::create_dir_all(&nodes).unwrap();
        fs::write(nodes.join(format!("{}node.details", domain.prefix())), "").unwrap();
        assert_eq!(litter(&domain), ["nodes", "nodes/*", "nodes/*/node.details"]);
    }
}
