//! The iceoryx2 domain that a process lives in: joining it, and leaving nothing behind.

use std::path::PathBuf;

use isochrone_ipc::{Domain, Participant, ipc};

use crate::base::failure::Failure;

/// Which iceoryx2 domain to use
#[derive(Clone, Debug, clap::Args)]
#[group(skip)]
pub(crate) struct Args {
    /// iceoryx2 configuration file; its root-path and prefix determine which processes see each
    /// other. Default: the file that the environment variable ICEORYX2_CONFIG names, or the first of
    /// ./config/iceoryx2.toml, ~/.config and /etc that iceoryx2 finds. -v shows which domain is used and which file selected it
    #[arg(long, value_name = "FILE")]
    pub(crate) iceoryx2_config: Option<PathBuf>,
}

/// From whom services are taken
#[derive(Clone, Debug, clap::Args)]
#[group(skip)]
pub(crate) struct TakeOver {
    /// Take services over from living writers that are not of isochrone, such as one that uses iceoryx2 alone. Readers
    /// change over at once, and raise an alarm until the other one ends. Another isochrone publisher, or a writer
    /// of another machine, is no such writer: end it first
    #[arg(long)]
    take_over: bool,
}

impl TakeOver {
    /// A participant that does so if it was asked for.
    pub(crate) fn of(&self, participant: Participant<ipc::Service>) -> Participant<ipc::Service> {
        participant.taking_over(self.take_over)
    }
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

    /// Joins the domain and removes what killed processes left behind.
    pub(crate) fn join(&self, name: &str) -> Result<Participant<ipc::Service>, Failure> {
        Participant::join(name, self.find()?).map_err(Failure::found)
    }
}

/// Says that there is nothing in a domain, and how to look into another one.
pub(crate) fn nothing_runs(what: &str, domain: &str) -> String {
    format!(
        "{what} runs in this domain, {domain}; --iceoryx2-config or ICEORYX2_CONFIG names another"
    )
}
