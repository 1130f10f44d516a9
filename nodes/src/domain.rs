//! The iceoryx2 domain that a process lives in: joining it, and leaving nothing behind.

use std::path::PathBuf;

use isochrone_ipc::{Domain, Participant, ipc};

use crate::failure::Failure;

/// Which iceoryx2 domain to use
#[derive(Clone, Debug, clap::Args)]
#[group(skip)]
pub(crate) struct Args {
    /// iceoryx2 configuration; its root-path and prefix say which processes see each other.
    /// Without it iceoryx2's own places are searched: ./config/iceoryx2.toml, ~/.config, /etc.
    /// -v tells which domain it is, and which file says so
    #[arg(long, value_name = "FILE")]
    pub(crate) iceoryx2_config: Option<PathBuf>,
}

impl Args {
    /// Finds the domain.
    pub(crate) fn find(&self) -> Result<Domain, Failure> {
        match &self.iceoryx2_config {
            Some(file) => Domain::from_file(file),
            None => Domain::find(),
        }
        .map_err(Failure::usage)
    }

    /// Joins the domain; cleans up what killed processes left.
    pub(crate) fn join(&self, name: &str) -> Result<Participant<ipc::Service>, Failure> {
        Participant::join(name, &self.find()?).map_err(Failure::found)
    }
}
