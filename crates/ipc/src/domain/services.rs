//! Removing services that dead processes left.

use std::collections::HashSet;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use iceoryx2::node::NodeState;
use iceoryx2::service::__internal_details;
use iceoryx2::service::service_hash::ServiceHash;

use super::segment::is_abandoned;
use crate::Service;

/// More bytes than the description of any service has.
const MOST_BYTES: u64 = 1 << 20;

/// Removes files of services that cannot be read yet, and that no process is writing any more.
pub(super) fn remove_locked(config: &Config) {
    const BEING_WRITTEN: u32 = 0o600;
    for (_, file) in service_files(config) {
        let Ok(found) = fs::symlink_metadata(&file) else { continue };
        if found.permissions().mode() & 0o777 == BEING_WRITTEN && is_abandoned(&found) {
            let _ = fs::remove_file(&file);
        }
    }
}

/// Removes services in which no node is alive; returns the ids of the others, or `None` if one of
/// them cannot be read.
pub(super) fn remove_deserted<S: Service>(config: &Config) -> Option<HashSet<u128>> {
    let mut ids = Some(HashSet::new());
    for (hash, file) in service_files(config) {
        let Ok(hash) = ServiceHash::try_from(hash.as_str()) else { continue };
        let found = catch_unwind(AssertUnwindSafe(|| __internal_details::<S>(config, &hash)));
        let Ok(Ok(Some(service))) = found else {
            // A file that is still being written has no segment yet.
            ids = ids.filter(|_| matches!(found, Ok(Ok(None))));
            continue;
        };
        let is_deserted = match &service.dynamic_details {
            Some(details) => details.nodes.iter().all(|node| matches!(node, NodeState::Dead(_))),
            // Its creator was killed, or has not come so far yet.
            None => fs::symlink_metadata(&file).is_ok_and(|file| is_abandoned(&file)),
        };
        let id = u128::from_str_radix(&service.static_details.unique_service_id().to_string(), 16);
        if is_deserted {
            // SAFETY: iceoryx2 asks that no other process use the service. None does: no living
            // node is registered in it, and processes register under the lock that is held here. A
            // program that knows no lock and registers at this very moment gets a service that others
            // cannot find, as it would from iceoryx2 itself while the last node leaves.
            #[allow(unsafe_code)]
            let _ = unsafe { S::__internal_remove_service(&service.static_details, config) };
        } else if let (Some(ids), Ok(id)) = (&mut ids, id) {
            ids.insert(id);
        } else {
            ids = None;
        }
    }
    ids
}

/// The names of the entries of a folder.
pub(super) fn names(folder: &Path) -> impl Iterator<Item = String> + use<> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.file_name().to_str().map(str::to_owned))
}

/// Hash and file of each service whose description can be one.
fn service_files(config: &Config) -> impl Iterator<Item = (String, PathBuf)> {
    let global = &config.global;
    let folder = PathBuf::from(global.service_dir().to_string());
    let prefix = global.prefix.to_string();
    let suffix = global.service.static_config_storage_suffix.to_string();
    names(&folder).filter_map(move |name| {
        let hash = name.strip_prefix(&prefix)?.strip_suffix(&suffix)?.to_owned();
        let file = folder.join(name);
        // Reading anything else could block for ever.
        let found = fs::symlink_metadata(&file).ok()?;
        (found.is_file() && found.len() <= MOST_BYTES).then_some((hash, file))
    })
}
