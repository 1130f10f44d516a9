//! Which iceoryx2 domain to live in.

use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::config::{Config, ConfigCreationError};
use iceoryx2::prelude::{FilePath, SemanticString};

use crate::ConfigError;
use crate::error::MAX_DOMAIN_BYTES;

/// How long a port waits for a peer that is caught in the middle of its creation.
///
/// iceoryx2's default is 1 s, and the wait happens inside `send` and `receive`; this caps it.
const CREATION_TIMEOUT: Duration = Duration::from_millis(20);

/// Loads the iceoryx2 configuration: the domain (prefix and root path) that all who talk to each
/// other must share.
///
/// With `None` the usual places are tried: `./config/iceoryx2.toml`,
/// `~/.config/iceoryx2/iceoryx2.toml`, `/etc/iceoryx2/iceoryx2.toml`, then the built-in defaults
/// (silently). Whatever the file says, the creation timeout becomes 20 ms.
///
/// # Errors
/// The given file does not exist, or a file was found but cannot be read or understood.
pub fn load_config(path: Option<&Path>) -> Result<Config, ConfigError> {
    let mut config = match path {
        Some(path) => read(path)?,
        None => match usual_places().into_iter().find(|path| path.exists()) {
            Some(path) => read(&path)?,
            None => Config::default(),
        },
    };
    config.global.creation_timeout = CREATION_TIMEOUT;
    let (root_path, prefix) = (config.global.root_path(), &config.global.prefix);
    if root_path.len() + prefix.len() > MAX_DOMAIN_BYTES {
        let (root_path, prefix) = (root_path.to_string(), prefix.to_string());
        return Err(ConfigError::DomainTooLong { root_path, prefix });
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

fn read(path: &Path) -> Result<Config, ConfigError> {
    let shown = path.display().to_string();
    let file = path
        .to_str()
        .and_then(|path| FilePath::new(path.as_bytes()).ok())
        .ok_or_else(|| ConfigError::UnusablePath { path: shown.clone() })?;
    // Where iceoryx2 finds no details of a dead node it cleans up in its global configuration's
    // domain, so that should be ours. Only the first call counts; a process has one domain.
    let _ = Config::setup_global_config_from_file(&file);
    Config::from_file(&file).map_err(|cause| match cause {
        ConfigCreationError::ConfigFileDoesNotExist => ConfigError::NotFound { path: shown },
        ConfigCreationError::InsufficientPermissions
        | ConfigCreationError::UnableToOpenConfigFile
        | ConfigCreationError::FailedToReadConfigFileContents => {
            ConfigError::Unreadable { path: shown }
        }
        ConfigCreationError::UnableToDeserializeContents => ConfigError::Malformed { path: shown },
    })
}
