//! The iceoryx2 domain that a process lives in: joining it, and leaving nothing behind.

use std::path::PathBuf;

use isochrone_ipc::{Config, Participant, ipc, load_config, remove_leftovers};

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

/// A domain. Drop it after everything that lives in it.
pub(crate) struct Domain {
    config: Config,
}

impl Domain {
    /// Finds the domain.
    pub(crate) fn find(args: &Args) -> Result<Self, Failure> {
        let config = load_config(args.iceoryx2_config.as_deref()).map_err(Failure::usage)?;
        Ok(Self { config })
    }

    /// Joins it; cleans up what killed processes left.
    pub(crate) fn join(&self, name: &str) -> Result<Participant<ipc::Service>, Failure> {
        Participant::join(name, &self.config).map_err(Failure::found)
    }

    /// Joins it with ports that belong to real-time threads.
    pub(crate) fn join_for_real_time(
        &self,
        name: &str,
    ) -> Result<Participant<ipc::Service>, Failure> {
        Participant::join_for_real_time(name, &self.config).map_err(Failure::found)
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        // Whoever leaves last; a domain that is in use is left alone.
        remove_leftovers::<ipc::Service>(&self.config);
    }
}
