//! How the two sides of a link find each other.

use std::fmt;
use std::path::PathBuf;

use super::address::{HostPort, Local};

/// How the two sides find each other.
pub(super) enum Way {
    Listen(Local),
    Connect(HostPort),
    File(PathBuf),
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Listen(local) => write!(f, "listens on {local}"),
            Self::Connect(host) => write!(f, "connects to {host}"),
            Self::File(file) => write!(f, "follows {}", file.display()),
        }
    }
}

impl Way {
    /// The port by which its connections are known; `None`: any, as the file may name any.
    pub(super) fn port(&self) -> Option<u16> {
        match self {
            Self::Listen(local) => Some(local.0.port()),
            Self::Connect(host) => Some(host.port),
            Self::File(_) => None,
        }
    }
}
