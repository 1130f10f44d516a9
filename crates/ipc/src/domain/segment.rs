//! The segments of a domain in shared memory, distinguished by their names.

use std::fs::{self, Metadata};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use iceoryx2::config::Config;
use rustix::process::geteuid;

/// Where POSIX shared memory lives on Linux.
pub(crate) const FOLDER: &str = "/dev/shm";

const OWNER_READ: u32 = 0o400;

/// A program that does not know our lock takes some milliseconds to create a file. A file that has been unfinished
/// for this long belongs to no living process.
const ABANDONED: Duration = Duration::from_millis(500);

/// A segment of ours.
pub(super) struct Segment {
    path: PathBuf,
    pub(super) content: Content,
    /// It has no size or no permissions yet.
    pub(super) is_half_made: bool,
    pub(super) is_abandoned: bool,
}

/// The contents of a segment, and its owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// Frames of the publisher with this id.
    Data(u128),
    /// Which frames are on their way from a sender to a receiver.
    Connection(u128, u128),
    /// Nodes and ports of the service with this id.
    Dynamic(u128),
    /// Anything else.
    Other,
}

impl Segment {
    /// Removes its name. Another process may do the same at this moment.
    pub(super) fn remove(&self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Files in shared memory whose names begin with the prefix.
pub(crate) fn files(config: &Config) -> Vec<PathBuf> {
    let prefix = config.global.prefix.to_string();
    let entries = fs::read_dir(FOLDER).into_iter().flatten().flatten();
    let ours =
        entries.filter(|entry| entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()));
    ours.map(|entry| entry.path()).collect()
}

/// Removes these files, whoever they are of.
pub(super) fn remove_all(config: &Config) {
    for segment in files(config) {
        if let Err(error) = fs::remove_file(&segment) {
            tracing::warn!("cannot remove {}: {error}", segment.display());
        }
    }
}

/// The domain's segments that belong to this user.
pub(super) fn list(config: &Config) -> Vec<Segment> {
    let prefix = config.global.prefix.to_string();
    let ours = geteuid().as_raw();
    let entries = fs::read_dir(FOLDER).into_iter().flatten().flatten();
    let segments = entries.filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        let rest = after_hash(&prefix, &name)?;
        let file = entry.metadata().ok().filter(|file| file.is_file() && file.uid() == ours)?;
        Some(Segment {
            path: Path::new(FOLDER).join(&name),
            content: content(config, rest),
            is_half_made: file.len() == 0 || file.mode() & OWNER_READ == 0,
            is_abandoned: is_abandoned(&file),
        })
    });
    segments.collect()
}

/// Whether a file has not changed for so long that no process is creating it any more.
pub(super) fn is_abandoned(file: &Metadata) -> bool {
    // If the clock was set back since, the file is older than that.
    let age = |changed| SystemTime::now().duration_since(changed).unwrap_or(Duration::MAX);
    file.modified().is_ok_and(|changed| age(changed) > ABANDONED)
}

/// The rest of a segment's name, if it is one of the domain with this prefix. iceoryx2 names it by the
/// prefix, the SHA-1 of a type in hexadecimal digits, an underscore and more; by the prefix alone,
/// that of a domain whose prefix begins with ours would look like ours.
pub(super) fn after_hash<'a>(prefix: &str, name: &'a str) -> Option<&'a str> {
    const HASH_DIGITS: usize = 40;
    let (hash, rest) = name.strip_prefix(prefix)?.split_at_checked(HASH_DIGITS)?;
    let rest = rest.strip_prefix('_')?;
    hash.bytes().all(|byte| byte.is_ascii_hexdigit()).then_some(rest)
}

fn content(config: &Config, rest: &str) -> Content {
    let service = &config.global.service;
    let id = |suffix: &dyn ToString| rest.strip_suffix(&suffix.to_string())?.parse().ok();
    let ends = || {
        let ids = rest.strip_suffix(&service.connection_suffix.to_string())?;
        let (sender, receiver) = ids.split_once('_')?;
        Some(Content::Connection(sender.parse().ok()?, receiver.parse().ok()?))
    };
    let data = id(&service.data_segment_suffix).map(Content::Data);
    let dynamic = || id(&service.dynamic_config_storage_suffix).map(Content::Dynamic);
    data.or_else(dynamic).or_else(ends).unwrap_or(Content::Other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_tells_what_a_segment_holds() {
        let config = Config::default();
        let hash = "0354a209029e7d094a819e2d4030ea331e6caaf0";
        let of = |rest: &str| {
            let name = format!("iox2_{hash}_{rest}");
            after_hash("iox2_", &name).map(|rest| content(&config, rest))
        };
        assert_eq!(of("17.data"), Some(Content::Data(17)));
        assert_eq!(of("17_18.connection"), Some(Content::Connection(17, 18)));
        assert_eq!(of("19.dynamic"), Some(Content::Dynamic(19)));
        assert_eq!(of("node.0_10_0.global_mgmt"), Some(Content::Other));
        assert_eq!(after_hash("iox2_", "iox2_x_17.data"), None);
        assert_eq!(after_hash("iox2", &format!("iox2_{hash}_17.data")), None);
    }
}
