//! Which iceoryx2 domain to live in.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::prelude::{FilePath, SemanticString};
use toml::de::{DeTable, Error as TomlError};

use crate::DomainError;
use crate::config_keys::{UnknownKey, unknown_key};
use crate::error::MAX_DOMAIN_BYTES;

/// How long a port waits for a peer that is caught in the middle of its creation.
///
/// iceoryx2's default is 1 s, and the wait happens inside `send` and `receive`; this caps it.
const CREATION_TIMEOUT: Duration = Duration::from_millis(20);

/// Most publishers that have left and whose last frames a subscriber still has to take.
///
/// iceoryx2's default is 128, and each look for a frame passes over a place for each of them: one that found none took
/// 1,137 instructions in there, and takes 177. A service of ours has places for 5 publishers, so all of them may leave
/// between two looks. Of more than 8 whose frames wait, those of the last to leave are lost, and iceoryx2 logs a warning.
const LEFT_PUBLISHERS: usize = 8;

/// Larger than any configuration.
const MAX_BYTES: u64 = 1 << 20;

/// Root path and prefix, for people.
pub(crate) fn describe(config: &Config) -> String {
    format!("{} (prefix {})", config.global.root_path(), config.global.prefix)
}

/// The folder in which iceoryx2 keeps its files.
pub(crate) fn root_path(config: &Config) -> PathBuf {
    config.global.root_path().to_string().into()
}

/// Where a configuration comes from, for people.
pub(crate) fn origin(path: Option<&Path>) -> String {
    path.map_or_else(|| "the built-in defaults".into(), |path| path.display().to_string())
}

/// Names the file for all that a user starts.
const FILE_VARIABLE: &str = "ICEORYX2_CONFIG";

/// The file that `ICEORYX2_CONFIG` names, whether it exists or not, or else the one in the first of
/// the usual places that has one: `./config/iceoryx2.toml`, `~/.config/iceoryx2/iceoryx2.toml`,
/// `/etc/iceoryx2/iceoryx2.toml`.
pub(crate) fn usual_file() -> Option<PathBuf> {
    let named = std::env::var_os(FILE_VARIABLE).filter(|file| !file.is_empty());
    if let Some(file) = named {
        return Some(file.into());
    }
    usual_places().into_iter().find(|path| path.exists())
}

/// Reads a configuration, or takes the built-in one. Whatever the file says, the creation timeout
/// becomes 20 ms, and a subscriber keeps the frames of 8 publishers that left.
///
/// # Errors
/// The file cannot be read or understood. That is more than iceoryx2 itself refuses: an empty file, a
/// key that it does not know and would ignore, and a relative root path would each bring the process
/// into a domain that nobody meant.
pub(crate) fn load(path: Option<&Path>) -> Result<Config, DomainError> {
    let mut config = path.map_or_else(|| Ok(Config::default()), read)?;
    config.global.creation_timeout = CREATION_TIMEOUT;
    config.defaults.publish_subscribe.subscriber_expired_connection_buffer = LEFT_PUBLISHERS;
    let (root_path, prefix) = (config.global.root_path(), &config.global.prefix);
    if root_path.len() + prefix.len() > MAX_DOMAIN_BYTES {
        return Err(DomainError::new(format!(
            "root-path {root_path} and prefix {prefix} are too long for iceoryx2; together at most \
             {MAX_DOMAIN_BYTES} bytes"
        )));
    }
    Ok(config)
}

fn usual_places() -> Vec<PathBuf> {
    let in_directory = Path::new("iceoryx2").join("iceoryx2.toml");
    let home = std::env::home_dir().map(|home| home.join(".config").join(&in_directory));
    [PathBuf::from("config/iceoryx2.toml")]
        .into_iter()
        .chain(home)
        .chain([Path::new("/etc").join(&in_directory)])
        .collect()
}

fn read(path: &Path) -> Result<Config, DomainError> {
    let shown = path.display().to_string();
    let refused = |what| DomainError::of_file(&shown, what);
    let file = path
        .to_str()
        .and_then(|path| FilePath::new(path.as_bytes()).ok())
        .ok_or_else(|| refused("not a usable file path; use an ASCII path of at most 255 bytes"))?;
    let unreadable = |error: std::io::Error| match error.kind() {
        ErrorKind::NotFound => {
            refused("no such file; give an existing file, or none for the defaults")
        }
        _ => refused("cannot be read; check its permissions"),
    };
    // iceoryx2 reads it as well, see below; a pipe has nothing more to say then.
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() || metadata.len() > MAX_BYTES {
        let what = "not an ordinary file of at most 1 MiB; give one, or none for the defaults";
        return Err(refused(what));
    }
    let bytes = fs::read(path).map_err(unreadable)?;
    let config = parse(&shown, &bytes)?;
    // Where iceoryx2 finds no details of a dead node it cleans up in its global configuration's
    // domain, so that should be ours. Only the first call counts; a process has one domain.
    let _ = Config::setup_global_config_from_file(&file);
    Ok(config)
}

/// Reads the text of a configuration.
pub(crate) fn parse(path: &str, bytes: &[u8]) -> Result<Config, DomainError> {
    let malformed = |text: &str, at: usize, cause: &str| {
        let what = format!(
            "not a valid iceoryx2 0.10 configuration: {cause}; compare it with `iox2 config show`"
        );
        DomainError::at(path, position(text, at), &what)
    };
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let valid = String::from_utf8_lossy(bytes.get(..error.valid_up_to()).unwrap_or_default());
        malformed(&valid, valid.len(), "this is not UTF-8 text")
    })?;
    let no_toml = |error: TomlError| {
        malformed(text, error.span().map_or(0, |span| span.start), error.message())
    };
    let file = DeTable::parse(text).map_err(no_toml)?;
    if file.get_ref().is_empty() {
        let what = "empty; write [global] with a root-path and a prefix, or give no file for the \
                    defaults";
        return Err(DomainError::of_file(path, what));
    }
    if let Some(unknown) = unknown_key(file.get_ref()) {
        let UnknownKey { at, table, key, remedy } = unknown;
        let what = format!("{table} has no key {key:?}; {remedy}");
        return Err(DomainError::at(path, position(text, at), &what));
    }
    let config: Config = toml::from_str(text).map_err(no_toml)?;
    let global = file.get_ref().get("global").and_then(|global| global.get_ref().as_table());
    match global.and_then(|global| global.get("root-path")) {
        Some(root_path) if !config.global.root_path().as_bytes().starts_with(b"/") => {
            let place = position(text, root_path.span().start);
            let root_path = config.global.root_path().to_string();
            let what = format!(
                "root-path {root_path:?} is relative, so each folder would have a domain of its own; \
                 begin it with /"
            );
            Err(DomainError::at(path, place, &what))
        }
        _ => Ok(config),
    }
}

/// Line and column, both from 1, of a byte; columns count characters.
fn position(text: &str, byte: usize) -> (usize, usize) {
    let before = text.get(..byte).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}
