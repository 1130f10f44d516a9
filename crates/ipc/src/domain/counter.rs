//! The node counter of a domain.
//!
//! iceoryx2 numbers nodes by a counter in shared memory, of constant name, that it makes writable by
//! everybody: sixteen bytes written by any user, and no process of the domain could start again. So we
//! make it ourselves, for its owner only, before iceoryx2 would; and close it where another program
//! was first.

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, SemanticString as _};
use iceoryx2_cal::dynamic_storage::posix_shared_memory::{Builder, Configuration, Storage};
use iceoryx2_cal::dynamic_storage::{DynamicStorage as _, DynamicStorageBuilder as _};
use iceoryx2_cal::named_concept::{NamedConceptBuilder as _, NamedConceptConfiguration as _};
use rustix::process::geteuid;

use super::segment::FOLDER;

/// What iceoryx2 0.10.0 keeps there; its name is a part of the file's.
const TYPE_NAME: &str = "iceoryx2::node::global_management_segment::State";
const NAME: &[u8] = b"node";
const VERSION: &str = ".0_10_0";
const OWNER_READ: u32 = 0o400;
const NOT_OWNER: u32 = 0o077;

/// Makes the counter of a domain that has none; nothing but its owner may open it at any time.
///
/// A counter that somebody is just making, or was killed while making, stays as it is: iceoryx2 will
/// say that it is not ready.
pub(super) fn make(config: &Config) {
    let suffix = suffix(config);
    let (Ok(name), Ok(suffix)) = (FileName::new(NAME), FileName::new(suffix.as_bytes())) else {
        return;
    };
    let mut place = Configuration::<u32>::default()
        .prefix(&config.global.prefix)
        .suffix(&suffix)
        .path_hint(config.global.root_path());
    // SAFETY: asked for is that both sides of the storage have the same type. iceoryx2's is a struct
    // of one 32-bit atomic, `repr(C)`; ours is the integer in it.
    #[allow(unsafe_code)]
    unsafe {
        Storage::<u32>::__internal_set_type_name_in_config(&mut place, TYPE_NAME);
    }
    // Where it exists already, this changes nothing.
    let made = Builder::<u32>::new(&name)
        .config(&place)
        .has_ownership(false)
        .enable_global_access(false)
        .initializer(|counter, _| {
            counter.write(0);
            true
        })
        .create();
    drop(made);
}

/// Takes the counter's permissions from everybody but its owner, and removes what stands in its place
/// and can be none: its version is written, and its size set, before anybody may read it. iceoryx2
/// would wait for such a file, or refuse every start.
pub(super) fn repair(config: &Config) {
    const BYTES: u64 = 16;
    for path in find(config) {
        let Ok(file) = fs::symlink_metadata(&path) else { continue };
        let is_ours = file.is_file() && file.uid() == geteuid().as_raw();
        if !is_ours || file.mode() & OWNER_READ == 0 {
            continue;
        }
        let has_version =
            || fs::read(&path).is_ok_and(|bytes| bytes.iter().take(8).any(|b| *b != 0));
        if file.len() != BYTES || !has_version() {
            let _ = fs::remove_file(&path);
        } else if file.mode() & NOT_OWNER != 0 {
            // Should it fail, the counter is as iceoryx2 made it.
            let _ = fs::set_permissions(&path, Permissions::from_mode(0o600));
        }
    }
}

/// The counters of the domain: one, unless somebody plays tricks.
pub(super) fn find(config: &Config) -> Vec<PathBuf> {
    let (prefix, suffix) = (config.global.prefix.to_string(), suffix(config));
    let end = format!("_{}{suffix}", String::from_utf8_lossy(NAME));
    let entries = fs::read_dir(FOLDER).into_iter().flatten().flatten();
    let of_domain = |name: &str| {
        super::segment::after_hash(&prefix, name).is_some_and(|rest| format!("_{rest}") == end)
    };
    entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| of_domain(name))
        .map(|name| Path::new(FOLDER).join(name))
        .collect()
}

fn suffix(config: &Config) -> String {
    format!("{VERSION}{}", config.global.node.global_mgmt_suffix)
}
